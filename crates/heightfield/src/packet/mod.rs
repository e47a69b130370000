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

use std::ops::Range;

use crate::HeightField;
use crate::chunk::{Chunk, Outcome};
use crate::lanes::{Kernel, Lanes};
use block::{BATCH, Block, LEFT, Queue, Results, WINDOW};
use grid::Grid;

/// Rounds of coarse and fine walks without new rays, after which the rays left take the search for one.
const ROUNDS: usize = 1 << 14;

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
        let mut bundles = Queue::new();
        let mut results = Results::new();
        for from in (0..n).step_by(WINDOW) {
            let to = (from + WINDOW).min(n);
            descend::<L>(field, chunk, from..to, &mut block, &mut bundles, &mut results);
            if chunk.cancelled() {
                return;
            }
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

/// Finds the hits of the rays of a window. New rays are taken in while others still look, for a few that
/// are left over would leave most lanes idle.
#[inline(always)]
fn descend<L: Lanes>(
    field: &HeightField,
    chunk: &Chunk<'_>,
    range: Range<usize>,
    block: &mut Block,
    bundles: &mut Queue,
    results: &mut Results,
) {
    let margins = field.margins();
    let gx = Grid::<L>::new(field.cells()[0], field.is_periodic());
    let gy = Grid::<L>::new(field.cells()[1], field.is_periodic());
    let mut next = range.start;
    let mut rounds = 0;
    block.queue.len = 0;
    results.drop.fill(f64::NAN);
    while rounds < ROUNDS && !chunk.cancelled() {
        if next < range.end && block.queue.len <= LEFT {
            let to = (next + BATCH).min(range.end);
            let (origins, directions) = (chunk.origins.slice(next, to), chunk.directions.slice(next, to));
            let old = block.queue.len;
            block.fill::<L>(field, origins, directions, next - range.start, results);
            beams::descend::<L>(&mut block.queue, old, bundles, margins, &gx, &gy);
            (next, rounds) = (to, 0);
        } else if block.queue.len == 0 {
            return;
        }
        coarse::walk::<L>(&mut block.queue, margins.narrowest(), &gx, &gy);
        cells::walk::<L>(block, field, results);
        rounds += 1;
    }
}

#[cfg(test)]
mod tests;
