//! Bundles of neighbouring rays that go down together.
//!
//! The rays of a bundle share one coarse walk along the middle of a box around them, over a pyramid whose
//! margin is as wide as the box. Down to where that walk stops all of them are free.

use std::ops::Range;

use super::block::{BATCH, Block, DROP, LEVEL};
use super::grid::{Axis, Coarse, Grid};
use crate::lanes::Lanes;
use crate::margin::Margins;

/// Rays in a bundle, at most.
pub const BUNDLE: usize = 64;
/// Bundles in a batch, at most. A whole number of vectors.
const BUNDLES: usize = (BATCH / BUNDLE).next_multiple_of(16);

/// Farthest position, in cells, that `f32` gives well within the half cell that is allowed for it.
const FARTHEST: f32 = (1 << 18) as f32;
/// Allowed for rounding, and for the overshoot of steps.
const ALLOWANCE: f32 = 0.5;

/// Level at which bundles begin, at least.
const BEGIN: usize = 5;
/// Level at which rays begin that have come down in a bundle, and others.
const BEGIN_RAYS: [f32; 2] = [1.0, 5.0];

/// Most steps of a bundle.
const STEPS: usize = 128;

/// A box around rays.
pub struct Enclosing<L: Lanes> {
    /// For each lane the largest of start x, y and end x, y in tiles, and of the same with the other sign.
    largest: [L::F; 8],
}

impl<L: Lanes> Enclosing<L> {
    /// The box around no ray.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { largest: [L::splat(f32::NEG_INFINITY); 8] }
    }

    /// Makes room for the chosen rays, given where they are at drop 0 and drop 1.
    #[inline(always)]
    pub fn add(&mut self, chosen: L::M, start: [L::F; 2], end: [L::F; 2]) {
        let all = L::bits(chosen).count_ones() as usize == L::WIDTH;
        let (zero, nowhere) = (L::splat(0.0), L::splat(f32::NEG_INFINITY));
        let positions = [start[0], start[1], end[0], end[1]];
        for (k, position) in positions.into_iter().enumerate() {
            let (mut up, mut down) = (position, zero - position);
            if !all {
                up = L::select(chosen, up, nowhere);
                down = L::select(chosen, down, nowhere);
            }
            self.largest[k] = L::max(self.largest[k], up);
            self.largest[4 + k] = L::max(self.largest[4 + k], down);
        }
    }
}

/// Which rays of a block lie together.
pub struct Bundles {
    /// As in [`Enclosing`], of each bundle.
    largest: [[f32; BUNDLES]; 8],
    slots: [Range<usize>; BUNDLES],
    len: usize,
}

impl Bundles {
    /// None.
    pub fn new() -> Self {
        Self { largest: [[0.0; BUNDLES]; 8], slots: std::array::from_fn(|_| 0..0), len: 0 }
    }

    /// Forgets all bundles.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds the rays at some slots, with a box around them.
    #[inline(always)]
    pub fn push<L: Lanes>(&mut self, slots: Range<usize>, enclosing: &Enclosing<L>) {
        for (row, &largest) in self.largest.iter_mut().zip(&enclosing.largest) {
            row[self.len] = L::largest(largest);
        }
        self.slots[self.len] = slots;
        self.len += 1;
    }

    /// Takes all rays down as far as their bundles are free.
    #[inline(always)]
    pub fn descend<L: Lanes>(&self, block: &mut Block, margins: &Margins, gx: &Grid<L>, gy: &Grid<L>) {
        let free = self.free(margins, gx, gy);
        let top = margins.narrowest().top() as f32;
        for (slots, &free) in self.slots.iter().zip(&free[..self.len]) {
            let begin = L::splat(BEGIN_RAYS[usize::from(free == 0.0)].min(top));
            let free = L::splat(free);
            for at in slots.clone().step_by(L::WIDTH) {
                // Of the slots behind them the next bundle's are not touched.
                let chosen = L::first(slots.end - at);
                let drop = L::load(&block.single[DROP][at..]);
                let further = L::select(chosen, L::max(drop, free), drop);
                L::store(further, &mut block.single[DROP][at..]);
                L::store(begin, &mut block.single[LEVEL][at..]);
            }
        }
    }

    /// The drops down to which bundles are free. Those too wide for all pyramids stay at the top.
    #[inline(always)]
    fn free<L: Lanes>(&self, margins: &Margins, gx: &Grid<L>, gy: &Grid<L>) -> [f32; BUNDLES] {
        let mut free = [0.0; BUNDLES];
        let half = L::splat(0.5);
        let cells = [gx.cells(), gy.cells()];
        let mut spreads = [f32::INFINITY; BUNDLES];
        for at in (0..self.len).step_by(L::WIDTH) {
            let mut spread = L::splat(0.0);
            for k in 0..4 {
                let wide = L::load(&self.largest[k][at..]) + L::load(&self.largest[4 + k][at..]);
                spread = L::max(wide * half * cells[k % 2], spread);
            }
            L::store(spread, &mut spreads[at..]);
        }
        if self.len == 0 {
            return free;
        }
        // One pyramid for all: as wide as most of them need, and for none too narrow.
        let mut sorted = spreads;
        let (_, &mut most, _) = sorted[..self.len].select_nth_unstable_by(self.len * 3 / 4, f32::total_cmp);
        let Some(bound) = margins.at_least(most + ALLOWANCE) else { return free };
        let width = L::splat((1_u32 << bound.margin()) as f32 - ALLOWANCE);
        let limit = L::splat(FARTHEST);
        let level = L::splat_int((bound.finest() + 2).max(BEGIN).min(bound.top()) as i32);
        for at in (0..self.len).step_by(L::WIDTH) {
            let mut chosen = L::first(self.len - at) & L::le(L::load(&spreads[at..]), width);
            let mut middles = [half; 4];
            for (k, middle) in middles.iter_mut().enumerate() {
                *middle = (L::load(&self.largest[k][at..]) - L::load(&self.largest[4 + k][at..])) * half;
                chosen = chosen & L::le(L::abs(*middle) * cells[k % 2], limit);
            }
            let [start_x, start_y, end_x, end_y] = middles;
            let (x, y) = (axis::<L>(start_x, end_x, cells[0]), axis::<L>(start_y, end_y, cells[1]));
            let mut packet = Coarse::<L>::new(x, y, L::splat(0.0), level, chosen);
            for _ in 0..STEPS {
                packet.step(bound, gx, gy);
                if !L::any(packet.running) {
                    break;
                }
            }
            L::store(L::select(chosen, packet.drop, L::splat(0.0)), &mut free[at..]);
        }
        free
    }
}

/// One axis of rays from here to there, in tiles.
#[inline(always)]
fn axis<L: Lanes>(start: L::F, end: L::F, cells: L::F) -> Axis<L> {
    let direction = end - start;
    Axis { start, direction, inverse: Axis::<L>::inverse_of(direction * cells) }
}

const _: () = assert!(BATCH.is_multiple_of(BUNDLE));
