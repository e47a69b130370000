//! The smoothest surface inside a box: a thin plate that gives way where the data shows real steps.
//!
//! Minimises, over heights `h` with `|h - q| <= half` at every texel,
//!
//! `sum wx (h_xx)^2 + wy (h_yy)^2 + 2 wxy (h_xy)^2 + tie (h - q)^2`
//!
//! by accelerated projected gradient steps (Nesterov 1983; Beck and Teboulle 2009), which are parallel,
//! keep the box at every step, and give the same bits on any number of threads. Heights are in
//! quanta of the input, `q`.
//!
//! The weights come from what rounding can do. The second difference of a rounding error is 2 quanta
//! at most and its mean square over a slope of fraction `f` quanta a texel is `2 min(f, 1 - f)`.
//! * A single difference beyond that is a real step or crease: its weight falls to 0 between
//!   [`SURE_NOISE`] and [`SURE_STEP`] (Tukey 1974). Averaging hides steps, so coarse plates are told
//!   where the finest data has some.
//! * A local mean square beyond that, or the plate's own curvature, is real relief of that variance
//!   `v`: the plate then bends at a cost of `1 / (1 + 12 v)` and is tied to the data by the rest, as a
//!   rounding error of variance 1/12 asks for.

use heightfield::lanes::{self, Kernel, Lanes};
use rayon::prelude::*;

use super::grid::{Grid, mixed, second, second_across};

/// Second differences up to this are taken as rounding, in quanta.
const SURE_NOISE: f32 = 1.5;
/// Second differences from this on are taken as real, in quanta.
const SURE_STEP: f32 = 4.0;
/// How much of a smooth surface's own squared curvature counts as relief: what stairs it still has
/// must not keep themselves up.
const OWN_BENDS: f32 = 0.25;
/// One over the variance of a rounding error.
const PRECISION: f32 = 12.0;
/// Largest eigenvalue of the sum of the plate's terms, 16 + 16 + 32, and of the tie.
const STIFFEST: f32 = 65.0;
/// Rows of one task.
const TASK_ROWS: usize = 32;

/// A map of integers in quanta at one resolution, and what surface the relief may have.
pub(super) struct Plate<'a> {
    pub grid: Grid,
    /// The quantised heights, in quanta.
    pub quantised: &'a [f32],
    /// How far from them the surface may go, in quanta.
    pub half: f32,
    /// The lowest and the highest height there is, in quanta.
    pub range: [f32; 2],
    /// Of averaged data: 1 where no step runs through the texel, 0 where one does.
    pub clear: Option<&'a [f32]>,
}

/// How stiff the plate is, and how firmly tied to the data.
pub(super) struct Stiffness {
    /// Along x, along y and twisted; 255 stands for 1.
    along: [Vec<u8>; 3],
    tie: Vec<f32>,
}

/// Weight of a second difference of the data.
fn trust(difference: f32) -> f32 {
    let x = ((difference.abs() - SURE_NOISE) / (SURE_STEP - SURE_NOISE)).clamp(0.0, 1.0);
    let y = 1.0 - x * x;
    y * y
}

impl Plate<'_> {
    /// Second differences along an axis; 0 where the map ends.
    fn bends(&self, plane: &[f32], axis: usize) -> Vec<f32> {
        let grid = self.grid;
        grid.fill(|j, out: &mut [f32]| {
            if axis == 0 {
                second(grid.row(plane, j), out);
                if !grid.periodic {
                    out[0] = 0.0;
                    out[grid.size[0] - 1] = 0.0;
                }
            } else if grid.inside(j, 1) {
                let (above, below) = grid.around(j);
                second_across(grid.row(plane, above), grid.row(plane, j), grid.row(plane, below), out);
            }
        })
    }

    /// Slopes along an axis; 0 where the map ends.
    fn slopes(&self, axis: usize) -> Vec<f32> {
        let (grid, q) = (self.grid, self.quantised);
        let n = grid.size[0];
        grid.fill(|j, out: &mut [f32]| {
            if axis == 1 && grid.inside(j, 1) {
                let (above, below) = grid.around(j);
                for ((out, a), b) in out.iter_mut().zip(grid.row(q, above)).zip(grid.row(q, below)) {
                    *out = 0.5 * (b - a);
                }
            } else if axis == 0 {
                let row = grid.row(q, j);
                for (i, out) in out.iter_mut().enumerate().filter(|(i, _)| grid.inside(*i, 0)) {
                    *out = 0.5 * (row[(i + 1) % n] - row[(i + n - 1) % n]);
                }
            }
        })
    }

    /// The variance of second differences along an axis that rounding does not explain.
    pub fn relief(&self, axis: usize) -> Vec<f32> {
        let grid = self.grid;
        let mut squares = self.bends(self.quantised, axis);
        squares.par_iter_mut().for_each(|d| *d = d.clamp(-SURE_STEP, SURE_STEP).powi(2));
        let mut found = grid.local_mean(&squares);
        drop(squares);
        let mut noise = grid.local_mean(&self.slopes(axis));
        noise.par_iter_mut().for_each(|slope| {
            let fraction = slope.abs().fract();
            *slope = 2.0 * fraction.min(1.0 - fraction);
        });
        let noise = grid.local_mean(&noise);
        // The slope is only known as a mean: the rest allows for its changes.
        found.par_iter_mut().zip(&noise).for_each(|(v, noise)| *v = (*v - (0.8 * noise + 0.2)).max(0.0));
        found
    }

    /// How much each texel takes part in a real step, 0 to 1.
    pub fn steps(&self) -> Vec<f32> {
        let [across, down] = [0, 1].map(|axis| self.bends(self.quantised, axis));
        across.par_iter().zip(&down).map(|(x, y)| 1.0 - trust(x.abs().max(y.abs()))).collect()
    }

    /// The least clear of a texel and its neighbours along an axis.
    fn clear_along(&self, i: usize, j: usize, axis: usize) -> f32 {
        let Some(clear) = self.clear else { return 1.0 };
        let [columns, rows] = self.grid.size;
        let at = |i: usize, j: usize| clear[j * columns + i];
        let (before, after) = if axis == 0 {
            (at((i + columns - 1) % columns, j), at((i + 1) % columns, j))
        } else {
            (at(i, (j + rows - 1) % rows), at(i, (j + 1) % rows))
        };
        at(i, j).min(before).min(after)
    }

    /// Adds the curvature of a smooth surface to the variance.
    fn with_bends_of(&self, relief: &[f32], surface: &[f32], axis: usize) -> Vec<f32> {
        let trusted = self.bends(self.quantised, axis);
        let mut squares = self.bends(surface, axis);
        let share = |d: f32, data: f32| OWN_BENDS * d * d * trust(data);
        squares.par_iter_mut().zip(&trusted).for_each(|(d, data)| *d = share(*d, *data));
        let mut found = self.grid.local_mean(&squares);
        found.par_iter_mut().zip(relief).for_each(|(v, relief)| *v = v.max(*relief));
        found
    }

    /// Weights for the variances along both axes, and for those of a smooth surface if there is one.
    pub fn stiffness(&self, relief: &[Vec<f32>; 2], surface: Option<&[f32]>) -> Stiffness {
        let grid = self.grid;
        let added = surface.map(|surface| [0, 1].map(|a| self.with_bends_of(&relief[a], surface, a)));
        let [across, down] = added.as_ref().unwrap_or(relief);
        let along = |axis: usize, relief: &[f32]| -> Vec<u8> {
            let bends = self.bends(self.quantised, axis);
            grid.fill(|j, out: &mut [u8]| {
                for (i, out) in out.iter_mut().enumerate() {
                    let at = j * grid.size[0] + i;
                    if grid.inside(if axis == 0 { i } else { j }, axis) {
                        let trust = trust(bends[at]) * self.clear_along(i, j, axis);
                        *out = byte(trust / (1.0 + PRECISION * relief[at]));
                    }
                }
            })
        };
        let twisted = grid.fill(|j, out: &mut [u8]| {
            if !grid.periodic && j + 1 == grid.size[1] {
                return;
            }
            let mut twist = vec![0.0; grid.size[0]];
            mixed(grid.row(self.quantised, j), grid.row(self.quantised, grid.around(j).1), &mut twist);
            for (i, out) in out.iter_mut().enumerate() {
                let at = j * grid.size[0] + i;
                if grid.periodic || i + 1 < grid.size[0] {
                    let v = 0.5 * (across[at] + down[at]);
                    let clear = self.clear_along(i, j, 0).min(self.clear_along(i, j, 1));
                    *out = byte(trust(twist[i]) * clear / (1.0 + PRECISION * v));
                }
            }
        });
        let tie = across.par_iter().zip(down).map(|(x, y)| {
            let v = 0.5 * PRECISION * (x + y);
            v / (1.0 + v)
        });
        Stiffness { along: [along(0, across), along(1, down), twisted], tie: tie.collect() }
    }

    /// Runs `steps` steps from `surface`, which is inside the box and stays there. `report` is called
    /// after each step and may stop them.
    pub fn relax<E>(
        &self,
        stiffness: &Stiffness,
        surface: &mut [f32],
        steps: usize,
        mut report: impl FnMut() -> Result<(), E>,
    ) -> Result<(), E> {
        let width = self.grid.size[0];
        let mut from = surface.to_vec();
        let mut to = vec![0.0_f32; from.len()];
        let mut age = 1.0_f32;
        for _ in 0..steps {
            let next = 0.5 * (1.0 + (1.0 + 4.0 * age * age).sqrt());
            let momentum = (age - 1.0) / next;
            age = next;
            let block = TASK_ROWS * width;
            surface.par_chunks_mut(block).zip(to.par_chunks_mut(block)).enumerate().for_each_init(
                || Scratch::new(width),
                |scratch, (task, (surface, to))| {
                    let (plate, from, first) = (self, from.as_slice(), task * TASK_ROWS);
                    lanes::dispatch(Rows { plate, stiffness, from, first, surface, to, momentum, scratch });
                },
            );
            std::mem::swap(&mut from, &mut to);
            report()?;
        }
        Ok(())
    }
}

/// Rows of one step; of the lanes they run with they only take the instruction set.
struct Rows<'a, 'p> {
    plate: &'a Plate<'p>,
    stiffness: &'a Stiffness,
    from: &'a [f32],
    first: usize,
    surface: &'a mut [f32],
    to: &'a mut [f32],
    momentum: f32,
    scratch: &'a mut Scratch,
}

impl Kernel for Rows<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { plate, stiffness, from, first, surface, to, momentum, scratch } = self;
        let Plate { grid, range: [low, high], half, quantised, .. } = *plate;
        let width = grid.size[0];
        scratch.begin(grid, stiffness, from, first);
        for (k, (surface, to)) in surface.chunks_mut(width).zip(to.chunks_mut(width)).enumerate() {
            let j = first + k;
            scratch.gradient(grid, stiffness, from, j);
            let at = j * width..(j + 1) * width;
            let (start, q, tie) = (&from[at.clone()], &quantised[at.clone()], &stiffness.tie[at]);
            // Of one length, so that no index is checked.
            let (surface, to, force) = (&mut surface[..width], &mut to[..width], &scratch.force[..width]);
            for i in 0..width {
                let pull = force[i] + tie[i] * (start[i] - q[i]);
                let moved = start[i] - pull * (1.0 / STIFFEST);
                let inside = moved.max(q[i] - half).min(q[i] + half).max(low).min(high);
                to[i] = inside + momentum * (inside - surface[i]);
                surface[i] = inside;
            }
        }
    }
}

fn byte(weight: f32) -> u8 {
    (weight * 255.0 + 0.5) as u8
}

/// Multiplies differences by weights.
#[inline(always)]
fn weigh(differences: &mut [f32], weights: &[u8]) {
    for (difference, &weight) in differences.iter_mut().zip(weights) {
        *difference *= f32::from(weight) * (1.0 / 255.0);
    }
}

/// Rows that one task works with.
struct Scratch {
    /// Weighted second differences across the rows above, here and below.
    down: [Vec<f32>; 3],
    /// Weighted mixed differences of the rows above and here.
    twist: [Vec<f32>; 2],
    along: Vec<f32>,
    force: Vec<f32>,
}

impl Scratch {
    fn new(width: usize) -> Self {
        let row = || vec![0.0; width];
        Self { down: [row(), row(), row()], twist: [row(), row()], along: row(), force: row() }
    }

    /// Fills in what the row before `first` would have left.
    #[inline(always)]
    fn begin(&mut self, grid: Grid, stiffness: &Stiffness, from: &[f32], first: usize) {
        let above = grid.around(first).0;
        down(grid, stiffness, from, above, &mut self.down[1]);
        down(grid, stiffness, from, first, &mut self.down[2]);
        twist(grid, stiffness, from, above, &mut self.twist[1]);
    }

    /// The gradient of the plate's energy in row `j`, called row after row.
    #[inline(always)]
    fn gradient(&mut self, grid: Grid, stiffness: &Stiffness, from: &[f32], j: usize) {
        let width = grid.size[0];
        self.down.rotate_left(1);
        down(grid, stiffness, from, grid.around(j).1, &mut self.down[2]);
        self.twist.rotate_left(1);
        twist(grid, stiffness, from, j, &mut self.twist[1]);
        second(grid.row(from, j), &mut self.along);
        weigh(&mut self.along, &stiffness.along[0][j * width..][..width]);
        second(&self.along, &mut self.force);
        let [above, here, below] = &self.down;
        for (((force, a), h), b) in self.force.iter_mut().zip(above).zip(here).zip(below) {
            *force += (a - h) + (b - h);
        }
        let [above, here] = &self.twist;
        let (above, here, force) = (&above[..width], &here[..width], &mut self.force[..width]);
        let last = width - 1;
        force[0] += 2.0 * ((above[last] - here[last]) - (above[0] - here[0]));
        for i in 1..width {
            force[i] += 2.0 * ((above[i - 1] - here[i - 1]) - (above[i] - here[i]));
        }
    }
}

#[inline(always)]
fn down(grid: Grid, stiffness: &Stiffness, from: &[f32], j: usize, out: &mut [f32]) {
    let (above, below) = grid.around(j);
    second_across(grid.row(from, above), grid.row(from, j), grid.row(from, below), out);
    weigh(out, &stiffness.along[1][j * grid.size[0]..][..grid.size[0]]);
}

#[inline(always)]
fn twist(grid: Grid, stiffness: &Stiffness, from: &[f32], j: usize, out: &mut [f32]) {
    mixed(grid.row(from, j), grid.row(from, grid.around(j).1), out);
    weigh(out, &stiffness.along[2][j * grid.size[0]..][..grid.size[0]]);
}
