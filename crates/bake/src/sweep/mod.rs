//! The horizon of every texel along one azimuth, linear in texels however far the horizon lies.
//!
//! An azimuth has a *main* axis, the one along which it crosses more texels, and a *cross* axis. It
//! advances `slant` texels of the cross axis for each *step*, a texel of the main axis, `|slant| <= 1`.
//!
//! **Near**, up to [`NEAR`] steps, each texel follows its own line over the bilinear surface: the
//! tangent at the texel, then every place where the line meets a row or a column of texels, and the
//! middles between those. Texels side by side use the same weights.
//!
//! **Far**, a sweep over lines that start one texel apart on the cross axis: from the far end to the
//! near one a stack keeps the upper convex hull of what lies ahead, and the horizon is the tangent to
//! it (Ville Timonen and Jan Westerholm, Scalable Height Field Self-Shadowing, Computer Graphics Forum
//! 29(2), 2010). A texel takes the sines of the elevation from the two lines that pass it, corrected
//! to its own height, and interpolates. That is exact where a line goes through the texel (azimuths
//! along an axis, and the diagonals of square texels) and on a plane; elsewhere it shifts what stands
//! `d` steps away sideways by less than a texel, so by less than `1 / d` radians.

mod grid;
mod hull;
mod lines;
mod near;
mod plan;
#[cfg(test)]
mod tests;

use heightfield::{HeightField, lanes};
use rayon::prelude::*;

use crate::maps;

use grid::Grid;
use lines::{Far, Scratch, SweepLines};
use plan::Plan;

/// Lines swept together. Their samples share one weight, so a lane of samples is one vector.
const LANES: usize = 16;
/// Steps that each texel looks at for itself.
const NEAR: usize = 8;
/// Steps from which on lines look. What a texel sees just beyond its own steps may stand nearer on one
/// of its two lines; it must not be lost there.
const FAR_FROM: usize = 6;

/// What is seen along the lines of one azimuth; kept between azimuths for its memory.
#[derive(Default)]
pub(crate) struct Lines {
    /// `[block of lines][step]`.
    far: Vec<Far>,
}

/// Working memory for one row of texels: what is seen along the lines beside them.
#[derive(Default)]
pub(crate) struct RowScratch {
    rises: Vec<f32>,
    nearness: Vec<f32>,
}

/// One azimuth of a field: the plan of its lines, and the grid on which they run.
pub(crate) struct Sweep<'a> {
    pub plan: Plan,
    grid: &'a Grid,
}

/// The heights in both orders, each with its cross axis contiguous.
pub(crate) struct Grids {
    along_x: Grid,
    along_y: Grid,
}

/// Bytes that sweeps over a map need at most.
pub(crate) fn working_bytes(grid: maps::Grid) -> u128 {
    let heights =
        Grid::bytes(grid.width, grid.height, grid.wrap) + Grid::bytes(grid.height, grid.width, grid.wrap);
    let [w, h] = [grid.width, grid.height].map(|n| n as u128 + LANES as u128);
    // Slanted lines that do not come round are up to twice as many as texels across them.
    let lines = 2 * w * h * (size_of::<Far>() / LANES) as u128;
    heights + lines + grid.texels() * size_of::<f32>() as u128
}

impl Grids {
    pub fn new(field: &HeightField) -> Self {
        let texels = field.texels();
        let [w, h] = [field.width(), field.height()];
        Self {
            along_x: Grid::new(&transposed(&texels, w, h), w, h, field.wrap()),
            along_y: Grid::new(&texels, h, w, field.wrap()),
        }
    }

    /// The sweep towards a horizontal direction of mesh space, x right and y **up** the image.
    pub fn towards(&self, field: &HeightField, direction: [f64; 2]) -> Sweep<'_> {
        let plan = Plan::new(field, [&self.along_x, &self.along_y], direction);
        let grid = if plan.along_x { &self.along_x } else { &self.along_y };
        Sweep { plan, grid }
    }
}

impl Sweep<'_> {
    /// Sweeps all lines into `lines`.
    pub fn run(&self, lines: &mut Lines) {
        let block = stride(&self.plan);
        let blocks = self.plan.line_count.div_ceil(LANES);
        // What an earlier azimuth left stands only where no texel reads.
        lines.far.resize(blocks * block, Far::default());
        lines.far.par_chunks_mut(block).enumerate().for_each_init(Scratch::default, |scratch, (b, out)| {
            let line = self.plan.first_line + (b * LANES) as i64;
            lanes::dispatch(SweepLines { plan: &self.plan, grid: self.grid, line, scratch, out });
        });
    }

    /// Sines of the horizon's elevation for the texels at place `at` of the main axis, along the
    /// cross axis.
    pub fn texels(&self, lines: &Lines, at: usize, scratch: &mut RowScratch, out: &mut [f32]) {
        let plan = &self.plan;
        let step = if plan.forward { at } else { plan.steps - 1 - at };
        let n = out.len();
        // Texel `j` lies `share` of the way from line `j + lower` to the next.
        let offset = -plan.slant * step as f64;
        let lower = offset.floor();
        let share = (offset - lower) as f32;
        self.gather(lines, step, lower as i64 - plan.first_line, n + 1, scratch);
        let RowScratch { rises, nearness } = &*scratch;
        let (rises, nearness) = (&rises[..=n], &nearness[..=n]);
        lanes::dispatch(RowOfTexels { sweep: self, step: step as i64, share, rises, nearness, out });
    }

    /// What `count` lines see at a step, from line `first` of the plan on.
    fn gather(&self, lines: &Lines, step: usize, first: i64, count: usize, row: &mut RowScratch) {
        let plan = &self.plan;
        let RowScratch { rises, nearness } = row;
        let all = plan.line_count as i64;
        let mut line = if plan.cyclic { first.rem_euclid(all) } else { first.clamp(0, all - 1) } as usize;
        rises.clear();
        nearness.clear();
        while rises.len() < count {
            let (block, lane) = (line / LANES, line % LANES);
            let run = (LANES - lane).min(plan.line_count - line).min(count - rises.len());
            let far = &lines.far[block * stride(plan) + step];
            if run == LANES {
                // Of a size known beforehand: two moves in place of two calls.
                rises.extend_from_slice(&far.rises);
                nearness.extend_from_slice(&far.nearness);
            } else {
                rises.extend_from_slice(&far.rises[lane..lane + run]);
                nearness.extend_from_slice(&far.nearness[lane..lane + run]);
            }
            line += run;
            if line == plan.line_count {
                if !plan.cyclic {
                    break;
                }
                line = 0;
            }
        }
        // Open lines reach one beyond the last texel wherever its weight is not 0.
        rises.resize(count, 0.0);
        nearness.resize(count, 0.0);
    }
}

/// Steps from one block of lines to the next: odd, so that the same step of many blocks does not fall on the same few
/// places of the cache.
fn stride(plan: &Plan) -> usize {
    plan.steps | 1
}

/// A row of texels to be given their horizon.
struct RowOfTexels<'a> {
    sweep: &'a Sweep<'a>,
    step: i64,
    /// How far each texel lies from its line to the next.
    share: f32,
    /// What is seen along the line of each texel, and the one after the last.
    rises: &'a [f32],
    nearness: &'a [f32],
    out: &'a mut [f32],
}

impl lanes::Kernel for RowOfTexels<'_> {
    type Output = ();

    /// Of the lanes only the instruction set is taken.
    #[inline(always)]
    fn run<L: lanes::Lanes>(self) {
        let Self { sweep: Sweep { plan, grid }, step, share, rises, nearness, out } = self;
        let n = out.len();
        near::rises(plan, grid, step, out);
        let slope = plan.slope as f32;
        let (before, own, after) = near::neighbours(plan, grid, step);
        let (before, own, after) = (&before[..n], &own[..n], &after[..n]);
        let (rises, nearness) = (&rises[..=n], &nearness[..=n]);
        let (before_share, after_share) = (share, 1.0 - share);
        for j in 0..n {
            // How much higher the texel is than each of its lines, and than what the two say of it.
            let over_a = (own[j] - before[j]) * before_share;
            let over_b = (own[j] - after[j]) * after_share;
            let excess = over_a + (over_b - over_a) * share;
            let a = sine((rises[j] - excess * nearness[j]) * slope);
            let b = sine((rises[j + 1] - excess * nearness[j + 1]) * slope);
            // What either line shows seen from the texel: a pit or a post beside it must not raise that.
            let most = larger(rises[j] - over_a * nearness[j], rises[j + 1] - over_b * nearness[j + 1]);
            let far = smaller(a + (b - a) * share, sine(most * slope));
            let near = sine(out[j] * slope);
            out[j] = larger(near, far);
        }
    }
}

/// The larger of two numbers, neither of which is NaN: one instruction.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers, neither of which is NaN.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Sine of the elevation of a slope; 0 for one that falls.
#[inline(always)]
fn sine(tangent: f32) -> f32 {
    // Steeper ones are upright to the last digit, and their squares stay finite.
    let tangent = tangent.clamp(0.0, 1e9);
    tangent / (1.0 + tangent * tangent).sqrt()
}

/// `width * height` values row by row, turned column by column.
pub(crate) fn transposed<T: Copy + Default + Send + Sync>(
    values: &[T],
    width: usize,
    height: usize,
) -> Vec<T> {
    let mut turned = vec![T::default(); values.len()];
    transpose(values, width, height, &mut turned);
    turned
}

/// As [`transposed`], into as many values.
pub(crate) fn transpose<T: Copy + Send + Sync>(values: &[T], width: usize, height: usize, turned: &mut [T]) {
    const TILE: usize = 32;
    turned.par_chunks_mut(height * TILE).enumerate().for_each(|(block, columns)| {
        for top in (0..height).step_by(TILE) {
            for (i, column) in columns.chunks_mut(height).enumerate() {
                let x = block * TILE + i;
                for (j, to) in column[top..(top + TILE).min(height)].iter_mut().enumerate() {
                    *to = values[(top + j) * width + x];
                }
            }
        }
    });
}
