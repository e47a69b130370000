//! Bundles of neighbouring rays that go down together.
//!
//! The rays of a bundle share one coarse walk along the middle of a box around them, over a pyramid whose
//! margin is as wide as the box. Down to where that walk stops all of them are free. Squares of a picture
//! go on from there in quads of two by two, which come almost as far as a ray by itself and take a quarter of
//! its steps.

use std::ops::Range;

use super::block::{BATCH, Block, DROP, LEVEL};
use super::grid::{Axis, Coarse, Grid};
use crate::lanes::Lanes;
use crate::margin::Margins;
use crate::order::RUN;

/// Rays in a bundle, at most.
pub const BUNDLE: usize = 64;
/// Bundles in a batch, at most. A whole number of vectors.
const BUNDLES: usize = (BATCH / BUNDLE).next_multiple_of(32);

/// Farthest position, in cells, whose rounding [`ALLOWANCE`] has room for.
const FARTHEST: f32 = (1 << 18) as f32;
/// Allowed for the overshoot of steps, 1/8 cell, and for rounding: five times 2^-24 of a position.
const ALLOWANCE: f32 = 0.25;

/// Level at which bundles begin, at least.
const BEGIN: usize = 5;
/// Level at which rays begin that have come down in a bundle, and others.
const BEGIN_RAYS: [f32; 2] = [1.0, 5.0];

/// Quads in a batch, at most, and room for the last vector.
const QUADS: usize = BATCH / 4 + 32;

/// Lanes 0, 2, 4 and so on.
const EVEN: u32 = 0x5555;

/// Vectors of groups in flight.
const STREAMS: usize = 2;

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

/// Boxes around the rays of groups.
struct Boxes<const N: usize> {
    /// Start x, y and end x, y of their middles, in tiles.
    middles: [[f32; N]; 4],
    /// How far rays are from there at most along an axis, in cells.
    spreads: [f32; N],
    /// The drops down to which all rays are free.
    free: [f32; N],
    len: usize,
}

impl<const N: usize> Boxes<N> {
    const NONE: Self = Self { middles: [[0.0; N]; 4], spreads: [0.0; N], free: [0.0; N], len: 0 };

    /// Writes boxes from the one at `at` on, given the largest and least of start x, y and end x, y.
    #[inline(always)]
    fn set<L: Lanes>(&mut self, at: usize, largest: [L::F; 4], least: [L::F; 4], cells: [L::F; 2]) {
        let half = L::splat(0.5);
        let mut spread = L::splat(0.0);
        for k in 0..4 {
            let (upper, lower) = (largest[k] * half, least[k] * half);
            spread = L::max((upper - lower) * cells[k % 2], spread);
            L::store(upper + lower, &mut self.middles[k][at..]);
        }
        L::store(spread, &mut self.spreads[at..]);
    }

    /// Takes the groups down as far as all of their rays are free, from where they are and from a node
    /// so many levels above the finest. Those too wide for all pyramids stay where they are.
    #[inline(always)]
    fn descend<L: Lanes>(&mut self, begin: Begin, margins: &Margins, gx: &Grid<L>, gy: &Grid<L>) {
        if self.len == 0 {
            return;
        }
        // One pyramid for all: as wide as most of them need, and for none too narrow.
        let mut sorted = self.spreads;
        let (_, &mut most, _) = sorted[..self.len].select_nth_unstable_by(self.len * 3 / 4, f32::total_cmp);
        let Some(bound) = margins.at_least(most + ALLOWANCE) else { return };
        let width = L::splat((1_u32 << bound.margin()) as f32 - ALLOWANCE);
        let cells = [gx.cells(), gy.cells()];
        let level = L::splat_int((bound.finest() + begin.above).max(begin.least).min(bound.top()) as i32);
        for at in (0..self.len).step_by(STREAMS * L::WIDTH) {
            let second = (at + L::WIDTH).min(self.len);
            let mut packets =
                [self.load::<L>(at, width, level, cells), self.load::<L>(second, width, level, cells)];
            for _ in 0..STEPS {
                let mut running = 0;
                for packet in &mut packets {
                    packet.step(bound, gx, gy);
                    running |= L::bits(packet.running);
                }
                if running == 0 {
                    break;
                }
            }
            // Steps leave the drop of those not chosen alone.
            L::store(packets[1].drop, &mut self.free[second..]);
            L::store(packets[0].drop, &mut self.free[at..]);
        }
    }

    /// The middles from `at` on; those of boxes too wide or too far away are not to run.
    #[inline(always)]
    fn load<L: Lanes>(&self, at: usize, width: L::F, level: L::I, cells: [L::F; 2]) -> Coarse<L> {
        let limit = L::splat(FARTHEST);
        let mut chosen = L::first(self.len - at) & L::le(L::load(&self.spreads[at..]), width);
        let mut middles = [limit; 4];
        for (k, middle) in middles.iter_mut().enumerate() {
            *middle = L::load(&self.middles[k][at..]);
            chosen = chosen & L::le(L::abs(*middle) * cells[k % 2], limit);
        }
        let [start_x, start_y, end_x, end_y] = middles;
        let (x, y) = (axis::<L>(start_x, end_x, cells[0]), axis::<L>(start_y, end_y, cells[1]));
        Coarse::<L>::new(x, y, L::load(&self.free[at..]), level, chosen)
    }
}

/// Where groups begin.
#[derive(Clone, Copy)]
struct Begin {
    /// Levels above the finest.
    above: usize,
    /// The least level.
    least: usize,
}

/// Which rays of a block lie together.
pub struct Bundles {
    /// As in [`Enclosing`], of each bundle.
    largest: [[f32; BUNDLES]; 8],
    slots: [Range<usize>; BUNDLES],
    len: usize,
    boxes: Boxes<BUNDLES>,
    quads: Boxes<QUADS>,
}

impl Bundles {
    /// None.
    pub fn new() -> Self {
        Self {
            largest: [[0.0; BUNDLES]; 8],
            slots: std::array::from_fn(|_| 0..0),
            len: 0,
            boxes: Boxes::NONE,
            quads: Boxes::NONE,
        }
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

    /// Takes all rays down as far as their bundles are free, and those of squares, which are bundles of
    /// eight rows, as far as the four around each corner of two by two are.
    #[inline(always)]
    pub fn descend<L: Lanes>(
        &mut self,
        block: &mut Block,
        squares: bool,
        margins: &Margins,
        gx: &Grid<L>,
        gy: &Grid<L>,
    ) {
        let cells = [gx.cells(), gy.cells()];
        self.boxes.len = self.len;
        self.boxes.free.fill(0.0);
        for at in (0..self.len).step_by(L::WIDTH) {
            let (mut largest, mut least) = ([L::splat(0.0); 4], [L::splat(0.0); 4]);
            for k in 0..4 {
                largest[k] = L::load(&self.largest[k][at..]);
                least[k] = least[k] - L::load(&self.largest[4 + k][at..]);
            }
            self.boxes.set::<L>(at, largest, least, cells);
        }
        self.boxes.descend::<L>(Begin { above: 2, least: BEGIN }, margins, gx, gy);
        let top = margins.narrowest().top() as f32;
        for (slots, &free) in self.slots.iter().zip(&self.boxes.free[..self.len]) {
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
        if squares && L::WIDTH > 1 {
            self.gather_quads::<L>(block, cells);
            self.quads.descend::<L>(Begin { above: 1, least: 0 }, margins, gx, gy);
            self.hand_out::<L>(block);
        }
    }

    /// Makes quads of the rays of whole squares: two of a row and the two below them.
    #[inline(always)]
    fn gather_quads<L: Lanes>(&mut self, block: &Block, cells: [L::F; 2]) {
        let even = L::from_bits(EVEN & ((1 << L::WIDTH) - 1));
        self.quads.len = 0;
        for (slots, &free) in self.slots.iter().zip(&self.boxes.free[..self.len]) {
            if slots.len() < BUNDLE {
                continue;
            }
            for rows in slots.clone().step_by(4 * RUN) {
                for at in (rows..rows + RUN).step_by(L::WIDTH) {
                    let (mut largest, mut least) = ([L::splat(0.0); 4], [L::splat(0.0); 4]);
                    for k in 0..4 {
                        let mut of = [L::splat(0.0); 4];
                        for (row, position) in of.iter_mut().enumerate() {
                            *position = L::load(&block.single[k % 2][at + row * RUN..]);
                            if k >= 2 {
                                *position = *position + L::load(&block.single[k][at + row * RUN..]);
                            }
                        }
                        // In even lanes quads of the two rows above, in odd lanes of the two below.
                        let (upper, lower) = (L::max(of[0], of[1]), L::max(of[2], of[3]));
                        let upper = L::max(upper, L::neighbours(upper));
                        let lower = L::max(lower, L::neighbours(lower));
                        largest[k] = L::select(even, upper, lower);
                        let (upper, lower) = (L::min(of[0], of[1]), L::min(of[2], of[3]));
                        let upper = L::min(upper, L::neighbours(upper));
                        let lower = L::min(lower, L::neighbours(lower));
                        least[k] = L::select(even, upper, lower);
                    }
                    self.quads.set::<L>(self.quads.len, largest, least, cells);
                    L::store(L::splat(free), &mut self.quads.free[self.quads.len..]);
                    // Of vectors longer than a row the rest is written over.
                    self.quads.len += L::WIDTH.min(RUN);
                }
            }
        }
    }

    /// Takes the rays of quads down as far as those are free.
    #[inline(always)]
    fn hand_out<L: Lanes>(&self, block: &mut Block) {
        let even = L::from_bits(EVEN & ((1 << L::WIDTH) - 1));
        let row = L::first(RUN);
        let mut quad = 0;
        for slots in self.slots[..self.len].iter().filter(|slots| slots.len() == BUNDLE) {
            for rows in slots.clone().step_by(4 * RUN) {
                for at in (rows..rows + RUN).step_by(L::WIDTH) {
                    let free = L::load(&self.quads.free[quad..]);
                    quad += L::WIDTH.min(RUN);
                    let others = L::neighbours(free);
                    let upper = L::select(even, free, others);
                    let lower = L::select(even, others, free);
                    for (k, free) in [upper, upper, lower, lower].into_iter().enumerate() {
                        let to = &mut block.single[DROP][at + k * RUN..];
                        let drop = L::load(to);
                        L::store(L::select(row, L::max(drop, free), drop), to);
                    }
                }
            }
        }
    }
}

/// One axis of rays from here to there, in tiles.
#[inline(always)]
fn axis<L: Lanes>(start: L::F, end: L::F, cells: L::F) -> Axis<L> {
    let direction = end - start;
    Axis { start, direction, inverse: Axis::<L>::inverse_of(direction * cells) }
}

const _: () = assert!(BATCH.is_multiple_of(BUNDLE));

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Kernel, Level, dispatch_at};

    /// Rays of three squares, of which the middle one is not whole.
    struct Quads;

    impl Kernel for Quads {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            if L::WIDTH == 1 {
                return;
            }
            let (nx, ny) = (640.0_f32, 480.0_f32);
            let (mut block, mut bundles) = (Block::new(), Bundles::new());
            bundles.len = 3;
            bundles.slots[..3].clone_from_slice(&[0..64, 64..127, 127..191]);
            for slot in 0..191 {
                let i = if slot < 127 { slot } else { slot + 1 };
                let (x, y) = ((i % RUN + i / BUNDLE * RUN) as f32, (i / RUN % RUN) as f32);
                let ray = [0.1 + 1.5 * x / nx, 0.2 + 1.2 * y / ny, 0.3 + 0.25 * x / nx, 0.5 * y / ny];
                ray.into_iter().enumerate().for_each(|(k, number)| block.single[k][slot] = number);
            }
            bundles.gather_quads::<L>(&block, [L::splat(nx), L::splat(ny)]);
            assert_eq!(bundles.quads.len, 32);
            for (quad, free) in bundles.quads.free.iter_mut().enumerate() {
                *free = 1.0 + quad as f32;
            }
            bundles.hand_out::<L>(&mut block);
            let mut rays = [0; 32];
            for slot in 0..191 {
                if bundles.slots[1].contains(&slot) {
                    assert_eq!(block.single[DROP][slot], 0.0);
                    continue;
                }
                let quad = block.single[DROP][slot] as usize - 1;
                rays[quad] += 1;
                let spread = bundles.quads.spreads[quad];
                // Along x rays are 1.75 cells apart where they end, so half of that from the middle.
                assert!((spread - 0.875).abs() < 1e-3, "{quad} {spread}");
                for k in 0..4 {
                    let start = block.single[k % 2][slot];
                    let at = if k < 2 { start } else { start + block.single[k][slot] };
                    let off = (at - bundles.quads.middles[k][quad]).abs() * [nx, ny][k % 2];
                    // 0.75 and 0.6 cells where they start; 0.875 and 0.85 where they end.
                    let half = [0.75, 0.6, 0.875, 0.85][k];
                    assert!((off - half).abs() < 1e-3, "{} slot {slot} {k} {off}", L::WIDTH);
                }
            }
            assert_eq!(rays, [4; 32]);
        }
    }

    #[test]
    fn quads_are_the_nearest_four_rays_at_every_level() {
        for &level in Level::available() {
            dispatch_at(level, Quads);
        }
    }
}
