//! In which order the exact search follows rays.
//!
//! It bounds rays that follow one another together, so these should lie close together on the map. The rays
//! of a picture come row by row: squares of them are closer together than strips. Only the order in which
//! rays are looked at changes; results go where they belong.

use crate::{HeightField, RayArray};

/// Rays that follow one another in the order as they do in their arrays; the side of a square.
pub(crate) const RUN: usize = 8;
/// The narrowest picture that is worth it.
const NARROWEST: usize = 64;
/// The widest whose rows are looked for.
const WIDEST: usize = 1 << 16;
/// Pairs of rays that stand for all.
const SAMPLES: usize = 64;
/// From the end of a row to the next it is this many times as far as from ray to ray.
const JUMP: f64 = 8.0;
/// Squares pay as long as rows are at most this many times farther apart than rays are in a row.
const ROWS_APART: f64 = 3.0;
/// Rays closer together than this, in cells, are as good as in one place.
const CLOSE: f64 = 0.25;

/// Eight rows of a picture, cut into squares. The rows after them are cut alike.
pub(crate) struct Squares {
    /// Where the rows of each square begin, square by square.
    pub runs: Vec<u32>,
    /// How many rays the eight rows have.
    pub rays: usize,
}

/// How rays are cut into squares; `None` for rays that do not lie in rows.
pub(crate) fn squares(
    field: &HeightField,
    origins: RayArray<'_>,
    directions: RayArray<'_>,
) -> Option<Squares> {
    let width = Paths { field, origins, directions }.width()?;
    Some(Squares { runs: runs(width), rays: RUN * width })
}

/// Squares from left to right. The last overlaps the one before unless all are whole.
fn runs(width: usize) -> Vec<u32> {
    let lefts = (0..width).step_by(RUN).map(|left| left.min(width - RUN));
    lefts.flat_map(|left| (0..RUN).map(move |row| (row * width + left) as u32)).collect()
}

/// Rays on the map.
struct Paths<'a> {
    field: &'a HeightField,
    origins: RayArray<'a>,
    directions: RayArray<'a>,
}

impl Paths<'_> {
    /// Where a ray comes into the relief and where it reaches the floor, in cells. A ray that does not go
    /// down is where it starts.
    fn ends(&self, i: usize) -> [f64; 4] {
        let (o, d) = (self.origins.get(i), self.directions.get(i));
        let [nx, ny] = self.field.cells().map(|n| n as f64);
        let down = if d[2] < 0.0 { -1.0 / d[2] } else { 0.0 };
        let [enter, leave] = [1.0, 0.0].map(|z| (o[2] - z).max(0.0) * down);
        let (x, y) = (|t| (o[0] + t * d[0]) * nx, |t| (o[1] + t * d[1]) * ny);
        [x(enter), y(enter), x(leave), y(leave)]
    }

    /// The largest of the distances between the ends of two rays along an axis, in cells.
    fn distance(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (self.ends(a), self.ends(b));
        a.iter().zip(b).fold(0.0, |most, (a, b)| (a - b).abs().max(most))
    }

    /// The median distance of rays to others so many places on. Multiples of the golden ratio do not fall into
    /// step with rows.
    fn middle_distance(&self, on: usize) -> f64 {
        let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
        let last = (self.origins.len() - on) as f64;
        let mut distances: [f64; SAMPLES] = std::array::from_fn(|k| {
            let i = ((k as f64 * golden).fract() * last) as usize;
            self.distance(i, i + on)
        });
        *distances.select_nth_unstable_by(SAMPLES / 2, f64::total_cmp).1
    }

    /// How many rays are in a row, if these are the rows of a picture and lie close enough to each other.
    fn width(&self) -> Option<usize> {
        let n = self.origins.len();
        let widest = WIDEST.min(n / RUN);
        if widest < NARROWEST {
            return None;
        }
        let step = self.middle_distance(1).max(CLOSE);
        let ends_row = |i: usize| self.distance(i - 1, i) > JUMP * step;
        let width = (1..=widest).find(|&i| ends_row(i)).filter(|&width| width >= NARROWEST)?;
        let rows = n / width;
        let regular = (1..RUN).all(|k| ends_row((1 + k * (rows - 2) / RUN) * width));
        (regular && self.middle_distance(width) <= ROWS_APART * step).then_some(width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Wrap;

    /// Rays from above over a map of 64 x 64 texels, so many in a row.
    fn picture(width: usize, height: usize, apart: [f32; 2]) -> (Vec<f32>, Vec<f32>) {
        let at = |i: usize| [(i % width) as f32 * apart[0] / 64.0, (i / width) as f32 * apart[1] / 64.0, 1.0];
        ((0..width * height).flat_map(at).collect(), [0.3, 0.1, -1.0].repeat(width * height))
    }

    fn cut((origins, directions): &(Vec<f32>, Vec<f32>)) -> Option<Squares> {
        let field = HeightField::new(&[0.5; 64 * 64], 64, 64, Wrap::Repeat).unwrap();
        squares(&field, RayArray::F32(origins), RayArray::F32(directions))
    }

    #[test]
    fn rows_of_a_picture_are_cut_into_squares() {
        for (width, height) in [(64, 64), (100, 9), (1023, 40), (640, 481)] {
            let squares = cut(&picture(width, height, [1.0, 1.0])).unwrap();
            assert_eq!(squares.rays, RUN * width, "{width} x {height}");
            let mut seen = vec![0; RUN * width];
            for square in squares.runs.chunks(RUN) {
                for (row, &start) in square.iter().enumerate() {
                    assert_eq!(start as usize, row * width + square[0] as usize);
                    assert!(square[0] as usize + RUN <= width);
                    seen[start as usize..][..RUN].iter_mut().for_each(|count| *count += 1);
                }
            }
            // Once, but for columns in which two squares overlap.
            assert!(seen.iter().all(|&count| count >= 1), "{width} x {height}");
            let twice = seen.iter().filter(|&&count| count == 2).count();
            assert_eq!(twice, RUN * (width.next_multiple_of(RUN) - width), "{width} x {height}");
        }
    }

    #[test]
    fn a_camera_has_rows_too() {
        let (width, height) = (320, 200);
        let directions = (0..width * height).flat_map(|i| {
            let (x, y) = ((i % width) as f32 / 320.0 - 0.5, (i / width) as f32 / 320.0 - 0.3);
            [x, 0.4 + y, -1.0]
        });
        let rays = ([0.5, 0.5, 2.0].repeat(width * height), directions.collect());
        assert_eq!(cut(&rays).unwrap().rays, RUN * width);
    }

    #[test]
    fn other_rays_stay_as_they_are() {
        // One row, rows far apart, too few rows, too narrow.
        for (width, height, apart) in [(65_536, 1, 1.0), (100, 100, 9.0), (300, 7, 1.0), (24, 600, 1.0)] {
            assert!(cut(&picture(width, height, [1.0, apart])).is_none());
        }
        let (mut origins, directions) = picture(256, 256, [1.0, 1.0]);
        for i in 0..256 * 256 {
            origins.swap(3 * i, 3 * (i * 7919 % 65_536));
        }
        assert!(cut(&(origins.clone(), directions.clone())).is_none());
        origins.fill(f32::NAN);
        assert!(cut(&(origins, directions)).is_none());
    }
}
