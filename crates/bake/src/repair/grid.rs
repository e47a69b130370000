//! Planes of floats on a grid that repeats or ends: differences across rows and local means.

use rayon::prelude::*;

/// Size of a plane, and whether it goes on at the other side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Whether the last row and column meet the first.
    pub periodic: bool,
}

/// Taps of the local mean on each side of the centre: a box of 5 run twice.
const REACH: usize = 4;
const MEAN: [f32; REACH + 1] = [5.0 / 25.0, 4.0 / 25.0, 3.0 / 25.0, 2.0 / 25.0, 1.0 / 25.0];

impl Grid {
    /// Number of texels.
    pub fn texels(self) -> usize {
        self.size[0] * self.size[1]
    }

    /// A row of a plane.
    #[inline(always)]
    pub fn row(self, plane: &[f32], j: usize) -> &[f32] {
        &plane[j * self.size[0]..][..self.size[0]]
    }

    /// A plane made row by row.
    pub fn fill<T: Copy + Default + Send>(self, fill: impl Fn(usize, &mut [T]) + Sync) -> Vec<T> {
        let mut plane = vec![T::default(); self.texels()];
        plane.par_chunks_mut(self.size[0]).enumerate().for_each(|(j, row)| fill(j, row));
        plane
    }

    /// The rows above and below, round the edge whether periodic or not.
    #[inline(always)]
    pub fn around(self, j: usize) -> (usize, usize) {
        let rows = self.size[1];
        ((j + rows - 1) % rows, (j + 1) % rows)
    }

    /// Whether index `i` of an axis has a neighbour on each side.
    pub fn inside(self, i: usize, axis: usize) -> bool {
        self.periodic || (i > 0 && i + 1 < self.size[axis])
    }

    /// The index at a distance along an axis: round the edge, or the last one before it.
    fn step(self, i: usize, by: isize, axis: usize) -> usize {
        let n = self.size[axis] as isize;
        let to = i as isize + by;
        (if self.periodic { to.rem_euclid(n) } else { to.clamp(0, n - 1) }) as usize
    }

    /// Local means: a tent 9 texels wide along both axes.
    pub fn local_mean(self, plane: &[f32]) -> Vec<f32> {
        let width = self.size[0];
        let mut target = vec![0.0_f32; self.texels()];
        target.par_chunks_mut(width).enumerate().for_each_init(
            || vec![0.0_f32; width + 2 * REACH],
            |padded, (j, out)| {
                let centre = &mut padded[REACH..REACH + width];
                for (sum, &value) in centre.iter_mut().zip(self.row(plane, j)) {
                    *sum = MEAN[0] * value;
                }
                for (k, &weight) in MEAN.iter().enumerate().skip(1) {
                    let above = self.row(plane, self.step(j, -(k as isize), 1));
                    let below = self.row(plane, self.step(j, k as isize, 1));
                    for ((sum, &a), &b) in centre.iter_mut().zip(above).zip(below) {
                        *sum += weight * (a + b);
                    }
                }
                for k in 1..=REACH {
                    padded[REACH - k] = padded[REACH + self.step(0, -(k as isize), 0)];
                    padded[REACH + width - 1 + k] = padded[REACH + self.step(width - 1, k as isize, 0)];
                }
                for (i, out) in out.iter_mut().enumerate() {
                    let window = &padded[i..i + 2 * REACH + 1];
                    let mut sum = MEAN[0] * window[REACH];
                    for k in 1..=REACH {
                        sum += MEAN[k] * (window[REACH - k] + window[REACH + k]);
                    }
                    *out = sum;
                }
            },
        );
        target
    }
}

/// Second differences along a row, round its ends.
#[inline(always)]
pub(super) fn second(row: &[f32], out: &mut [f32]) {
    let n = row.len();
    for (out, window) in out[1.min(n)..].iter_mut().zip(row.windows(3)) {
        *out = (window[0] - window[1]) + (window[2] - window[1]);
    }
    for i in [0, n - 1] {
        out[i] = (row[(i + n - 1) % n] - row[i]) + (row[(i + 1) % n] - row[i]);
    }
}

/// Second differences across three rows.
#[inline(always)]
pub(super) fn second_across(above: &[f32], here: &[f32], below: &[f32], out: &mut [f32]) {
    for (((out, a), h), b) in out.iter_mut().zip(above).zip(here).zip(below) {
        *out = (a - h) + (b - h);
    }
}

/// Mixed differences between a row and the one below, and to the right, round the end.
#[inline(always)]
pub(super) fn mixed(here: &[f32], below: &[f32], out: &mut [f32]) {
    let n = here.len();
    for ((out, h), b) in out.iter_mut().zip(here.windows(2)).zip(below.windows(2)) {
        *out = (b[1] - h[1]) - (b[0] - h[0]);
    }
    out[n - 1] = (below[0] - here[0]) - (below[n - 1] - here[n - 1]);
}
