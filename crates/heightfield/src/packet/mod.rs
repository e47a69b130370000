//! The exact search for many rays at once.
//!
//! A block of rays goes down in three stages. [`beams`] takes bundles of neighbours as far as all of
//! them are free; [`coarse`] takes each ray on over a max pyramid, in `f32`, to within a cell of where
//! the surface may be; [`cells`] walks it from cell to cell and solves the bilinear patch in `f64`.
//! Rays that went through their cells without a hit take the last two stages again, packed together so
//! that no lane idles. Only `f64` decides on a hit, and `f32` only on what is surely free: bounds
//! have a margin for its rounding. The few rays that pass a corner of a cell too closely for it, and
//! those that rise, are level or start on the surface, take the search for one ray.

// Unchecked table reads.
#![allow(unsafe_code)]

mod beams;
mod block;
mod cells;
mod coarse;
mod grid;

use crate::HeightField;
use crate::chunk::{Chunk, Outcome};
use crate::lanes::{Kernel, Lanes};
use block::{BLOCK, Block, Results};
use grid::Grid;

/// Rounds of coarse and fine walks after which the rays left take the search for one ray.
const ROUNDS: usize = 1 << 14;

/// Level at which rays begin that have come down in a bundle, and others.
const BEGIN: [usize; 2] = [2, 5];

/// Cells above which node numbers would not fit.
const MOST_CELLS: usize = 1 << 28;

/// The exact search over the rays of a chunk.
pub(crate) struct Exact<'a, 'b> {
    /// The map.
    pub field: &'a HeightField,
    /// The rays.
    pub chunk: &'a mut Chunk<'b>,
}

impl Kernel for Exact<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { field, chunk } = self;
        let [nx, ny] = field.cells();
        let n = chunk.origins.len();
        if chunk.from_surface || nx * ny > MOST_CELLS {
            chunk.march_singly(field, 0..n, |_| true);
            return;
        }
        let mut block = Block::new();
        let mut results = Results::new();
        for from in (0..n).step_by(BLOCK) {
            if chunk.cancelled() {
                return;
            }
            let to = (from + BLOCK).min(n);
            descend::<L>(field, chunk, from..to, &mut block, &mut results);
            write::<L>(field, chunk, from, to - from, &results);
            chunk.march_singly(field, from..to, |i| results.drop[i - from].is_nan());
        }
    }
}

/// Writes the hits of `n` rays from ray `from` on.
#[inline(always)]
fn write<L: Lanes>(field: &HeightField, chunk: &mut Chunk<'_>, from: usize, n: usize, results: &Results) {
    for at in (0..n).step_by(L::WIDTH) {
        let drop = L::load_wide(&results.drop[at..]);
        let begin = L::load_wide(&results.begin[at..]);
        let t = (drop - begin) * L::load_wide(&results.scale[at..]);
        // False for NaN.
        let hit = L::first(n - at) & L::le_wide(drop, drop);
        let outcome = Outcome::<L> { hit, t, steps: L::load_int(&results.steps[at..]) };
        let (origin, direction) = chunk.positions::<L>(from + at);
        chunk.write_all(field, from + at, hit, &outcome, origin, direction);
    }
}

/// Finds the hits of the rays of a block.
#[inline(always)]
fn descend<L: Lanes>(
    field: &HeightField,
    chunk: &Chunk<'_>,
    range: std::ops::Range<usize>,
    block: &mut Block,
    results: &mut Results,
) {
    let margins = field.margins();
    let origins = chunk.origins.slice(range.start, range.end);
    let directions = chunk.directions.slice(range.start, range.end);
    let gx = Grid::<L>::new(field.cells()[0], field.is_periodic());
    let gy = Grid::<L>::new(field.cells()[1], field.is_periodic());
    let free = beams::free_drops::<L>(field, margins, origins, directions);
    block.fill::<L>(field, origins, directions, &free, results);
    let mut begin = BEGIN[usize::from(free[0] == 0.0)];
    for _ in 0..ROUNDS {
        if block.len == 0 || chunk.cancelled() {
            return;
        }
        coarse::walk::<L>(block, margins.narrowest(), &gx, &gy, begin);
        cells::walk::<L>(block, field, results);
        begin = 1;
    }
}

#[cfg(test)]
mod tests;
