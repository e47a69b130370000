//! Bundles of neighbouring rays that go down together.
//!
//! Sixteen rays, then four, share one coarse walk along the middle of a box around them, over a
//! pyramid whose margin is as wide as the box. Down to where that walk stops all of them are free.

use super::block::{BATCH, DROP, LEVEL, Queue};
use super::coarse;
use super::grid::{Axis, Grid};
use crate::lanes::Lanes;
use crate::margin::Margins;

/// Bundles, or rays, in a larger bundle.
const FEW: usize = 4;
/// Room for the smaller bundles of a batch; vectors may be written whole behind the last.
const BUNDLES: usize = BATCH / FEW + 16;

/// Farthest position, in cells, that `f32` gives well within the half cell that is allowed for it.
const FARTHEST: f32 = (1 << 18) as f32;
/// Allowed for rounding, and for the overshoot of steps.
const ALLOWANCE: f32 = 0.5;

/// Level at which bundles begin, at least.
const BEGIN: usize = 4;
/// Level at which rays begin that have come down in a bundle, and others.
const BEGIN_RAYS: [f32; 2] = [1.0, 5.0];

/// For each bundle: least and largest x and y at drop 0, then at drop 1, in tiles.
type Boxes = [[f32; BUNDLES]; 8];

/// Takes the rays from slot `from` on down as far as their bundles are free.
#[inline(always)]
pub fn descend<L: Lanes>(
    rays: &mut Queue,
    from: usize,
    queue: &mut Queue,
    margins: &Margins,
    gx: &Grid<L>,
    gy: &Grid<L>,
) {
    let count = rays.len - from;
    if count == 0 {
        return;
    }
    let (few, many) = (count.div_ceil(FEW), count.div_ceil(FEW * FEW));
    let mut small: Boxes = [[0.0; BUNDLES]; 8];
    let mut large: Boxes = [[0.0; BUNDLES]; 8];
    // The last of them fills its bundle.
    for row in &mut rays.single[..4] {
        let last = row[rays.len - 1];
        row[rays.len..][..FEW].fill(last);
    }
    for at in (0..count).step_by(L::WIDTH) {
        for k in 0..2 {
            let start = L::load(&rays.single[k][from + at..]);
            let end = start + L::load(&rays.single[2 + k][from + at..]);
            for (row, x) in [(k, start), (2 + k, end)] {
                enclose::<L>(x, x, at / FEW, &mut small[2 * row..]);
            }
        }
    }
    for (large, small) in large.chunks_exact_mut(2).zip(small.chunks_exact_mut(2)) {
        for row in &mut *small {
            let last = row[few - 1];
            row[few..][..FEW].fill(last);
        }
        for at in (0..few).step_by(L::WIDTH) {
            enclose::<L>(L::load(&small[0][at..]), L::load(&small[1][at..]), at / FEW, large);
        }
    }
    let mut free = [0.0; BUNDLES];
    walk::<L>(&large, many, &mut free, queue, margins, gx, gy);
    for k in (0..few).rev() {
        free[k] = free[k / FEW];
    }
    walk::<L>(&small, few, &mut free, queue, margins, gx, gy);
    let top = margins.narrowest().top() as f32;
    let [drops, levels] = &mut rays.single[DROP..=LEVEL] else { return };
    let slots = drops[from..].chunks_mut(FEW).zip(levels[from..].chunks_mut(FEW));
    for ((drops, levels), &free) in slots.zip(&free[..few]) {
        let begin = BEGIN_RAYS[usize::from(free == 0.0)].min(top);
        for (drop, level) in drops.iter_mut().zip(levels) {
            *drop = if *drop < free { free } else { *drop };
            *level = begin;
        }
    }
}

/// Writes the least of every four numbers to a row, and the largest of every four others to the next.
#[inline(always)]
fn enclose<L: Lanes>(least: L::F, largest: L::F, at: usize, rows: &mut [[f32; BUNDLES]]) {
    let firsts = L::from_bits(0x1111);
    L::compress(firsts, L::least_of_four(least), &mut rows[0][at..]);
    L::compress(firsts, L::largest_of_four(largest), &mut rows[1][at..]);
}

/// Walks the middles of boxes down from the given drops. Those too wide for all pyramids stay.
#[inline(always)]
fn walk<L: Lanes>(
    boxes: &Boxes,
    count: usize,
    free: &mut [f32; BUNDLES],
    queue: &mut Queue,
    margins: &Margins,
    gx: &Grid<L>,
    gy: &Grid<L>,
) {
    let half = L::splat(0.5);
    let cells = [gx.cells(), gy.cells()];
    let mut spreads = [f32::INFINITY; BUNDLES];
    for at in (0..count).step_by(L::WIDTH) {
        let mut spread = L::splat(0.0);
        for k in 0..4 {
            let (least, largest) = (L::load(&boxes[2 * k][at..]), L::load(&boxes[2 * k + 1][at..]));
            spread = L::max((largest - least) * half * cells[k % 2], spread);
        }
        L::store(spread, &mut spreads[at..]);
    }
    // One pyramid for all: as wide as most of them need, and for none too narrow.
    let mut sorted = spreads;
    let (_, &mut most, _) = sorted[..count].select_nth_unstable_by(count * 3 / 4, f32::total_cmp);
    let Some(bound) = margins.at_least(most + ALLOWANCE) else { return };
    let width = L::splat((1_u32 << bound.margin()) as f32 - ALLOWANCE);
    let limit = L::splat(FARTHEST);
    let level = L::splat((bound.finest() + 2).max(BEGIN).min(bound.top()) as f32);
    let mut order = [0; BUNDLES];
    let numbers: [i32; BUNDLES] = std::array::from_fn(|k| k as i32);
    queue.len = 0;
    for at in (0..count).step_by(L::WIDTH) {
        let mut chosen = L::first(count - at) & L::le(L::load(&spreads[at..]), width);
        let mut rows = [L::load(&free[at..]); 8];
        rows[LEVEL] = level;
        for k in 0..2 {
            let middle = |k: usize| (L::load(&boxes[2 * k][at..]) + L::load(&boxes[2 * k + 1][at..])) * half;
            let (start, end) = (middle(k), middle(2 + k));
            let direction = end - start;
            let inside = L::max(L::abs(start), L::abs(end)) * cells[k];
            chosen = chosen & L::le(inside, limit);
            rows[k] = start;
            rows[2 + k] = direction;
            rows[4 + k] = Axis::<L>::inverse_of(direction * cells[k]);
        }
        for (to, row) in queue.single.iter_mut().zip(rows) {
            L::compress(chosen, row, &mut to[queue.len..]);
        }
        L::compress_int(chosen, L::load_int(&numbers[at..]), &mut order[queue.len..]);
        queue.len += L::bits(chosen).count_ones() as usize;
    }
    coarse::walk::<L>(queue, bound, gx, gy);
    for (&at, &drop) in order[..queue.len].iter().zip(&queue.single[DROP]) {
        free[at as usize] = drop;
    }
}

const _: () = assert!(BATCH.is_multiple_of(FEW * FEW));
