//! The exact search for many rays at once.
//!
//! A block of rays goes down in two stages. [`beams`] takes bundles of neighbours as far as all of them are
//! free. [`cells`] takes each ray on over a max pyramid, in `f32`, to within a cell of where the surface may
//! be, then from cell to cell, and solves the bilinear patch in `f64`. Rays that went through their cells
//! without a hit take the second stage again, packed together so that no lane idles. Only `f64` decides on a
//! hit, and `f32` only on what is surely free: bounds have a margin for its rounding. Rays that rise, are
//! level or start on the surface take the search for one ray.

// Unchecked table reads.
#![allow(unsafe_code)]

mod beams;
mod block;
mod cells;
mod grid;

use crate::HeightField;
use crate::chunk::{Chunk, Outcome};
use crate::lanes::{Kernel, Lanes};
use crate::order::RUN;
use crate::rays::load;
use beams::Bundles;
use block::{BATCH, Block, LEFT, Results};
use grid::Grid;

/// Rounds of walks without new rays, after which the rays left take the search for one.
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
            chunk.march_singly(field, 0..n);
            return;
        }
        let mut results = Results::new(n);
        descend::<L>(field, chunk, &mut Block::new(), &mut Bundles::new(), &mut results);
        if chunk.cancelled() {
            return;
        }
        let left = write::<L>(field, chunk, &results);
        chunk.march_singly(field, left);
    }
}

/// Writes the hits. Returns the numbers of the rays that need the search for one.
#[inline(always)]
fn write<L: Lanes>(field: &HeightField, chunk: &mut Chunk<'_>, results: &Results) -> Vec<usize> {
    let n = chunk.origins.len();
    let highest = L::splat_wide(f64::from(field.pyramid().highest()));
    let mut left = Vec::new();
    for at in (0..n).step_by(L::WIDTH) {
        let (origin, direction) = (load::<L>(chunk.origins, at), load::<L>(chunk.directions, at));
        let drop = L::load_wide(&results.drop[at..]);
        let t = (drop - (highest - origin[2])) * (L::splat_wide(-1.0) / direction[2]);
        let active = L::first(n - at);
        // False for NaN.
        let hit = active & L::le_wide(drop, drop);
        let outcome =
            Outcome::<L> { hit, unconverged: L::first(0), t, steps: L::load_int(&results.steps[at..]) };
        chunk.write_all(field, at, hit, &outcome, origin, direction);
        let mut others = L::bits(active & !hit);
        while others != 0 {
            left.push(at + others.trailing_zeros() as usize);
            others &= others - 1;
        }
    }
    left
}

/// Finds the hits of the rays of a chunk. New rays are taken in while others still look, for a few that
/// are left over would leave most lanes idle.
#[inline(always)]
fn descend<L: Lanes>(
    field: &HeightField,
    chunk: &Chunk<'_>,
    block: &mut Block,
    bundles: &mut Bundles,
    results: &mut Results,
) {
    let margins = field.margins();
    let gx = Grid::<L>::new(field.cells()[0], field.is_periodic());
    let gy = Grid::<L>::new(field.cells()[1], field.is_periodic());
    let places = if chunk.order.is_empty() { chunk.origins.len() } else { chunk.order.len() * RUN };
    let (mut next, mut rounds) = (0, 0);
    while rounds < ROUNDS && !chunk.cancelled() {
        let old = block.len;
        // New rays begin a vector, so that runs stay together.
        let new = old.next_multiple_of(L::WIDTH);
        block.len = new;
        if next < places && old <= LEFT {
            let to = (next + BATCH).min(places);
            block.fill::<L>(field, chunk, next..to, bundles);
            bundles.descend::<L>(block, !chunk.order.is_empty(), margins, &gx, &gy);
            (next, rounds) = (to, 0);
        } else if old == 0 {
            return;
        }
        let len = std::mem::take(&mut block.len);
        for slots in [0..old, new..len] {
            cells::walk::<L>(block, slots, field, &gx, &gy, results);
        }
        rounds += 1;
    }
}

#[cfg(test)]
mod tests;
