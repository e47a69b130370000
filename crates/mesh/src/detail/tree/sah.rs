//! Where to cut a set of boxes in two.

use glam::Vec3A;

use super::{Bounds, EMPTY};

/// Cuts tried along each axis, and one more.
const BINS: usize = 16;

/// A leaf on its way into the tree.
#[derive(Debug, Clone, Copy)]
pub(super) struct Item {
    pub bounds: Bounds,
    /// Index of the leaf.
    pub leaf: u32,
}

impl Item {
    /// Twice the centre.
    #[inline(always)]
    fn middle(&self) -> Vec3A {
        self.bounds.low + self.bounds.high
    }
}

/// The box around some items.
pub(super) fn around(items: &[Item]) -> Bounds {
    items.iter().fold(EMPTY, |b, item| b.union(item.bounds))
}

/// Puts at least two items in two parts, and says where the second begins, never at either end, and
/// the boxes around both.
///
/// The parts have the least sum of area times number among the cuts tried. `balanced` asks for
/// halves instead, as do items whose centres agree.
pub(super) fn cut(items: &mut [Item], balanced: bool) -> (usize, [Bounds; 2]) {
    if balanced || items.len() < 3 {
        return halve(items);
    }
    let (middles, axis) = middles(items);
    let scale = BINS as f32 * (1.0 - 1e-6) / (middles.high[axis] - middles.low[axis]);
    if !(scale.is_finite() && scale > 0.0) {
        return parted(items, items.len() / 2);
    }
    let first = middles.low[axis];
    let bin = |item: &Item| (((item.middle()[axis] - first) * scale) as usize).min(BINS - 1);
    let mut boxes = [EMPTY; BINS];
    let mut counts = [0usize; BINS];
    for item in items.iter() {
        let at = bin(item);
        boxes[at] = boxes[at].union(item.bounds);
        counts[at] += 1;
    }
    let mut right = [(EMPTY, 0.0); BINS];
    let (mut b, mut n) = (EMPTY, 0);
    for at in (1..BINS).rev() {
        (b, n) = (b.union(boxes[at]), n + counts[at]);
        right[at] = (b, b.half_area() * n as f32);
    }
    let (mut b, mut n) = (EMPTY, 0);
    let mut best = (f32::INFINITY, 0, EMPTY);
    for at in 1..BINS {
        (b, n) = (b.union(boxes[at - 1]), n + counts[at - 1]);
        let cost = b.half_area() * n as f32 + right[at].1;
        if n > 0 && n < items.len() && cost < best.0 {
            best = (cost, at, b);
        }
    }
    let (_, at, left) = best;
    if at == 0 {
        return halve(items);
    }
    let mut split = 0;
    for i in 0..items.len() {
        if bin(&items[i]) < at {
            items.swap(i, split);
            split += 1;
        }
    }
    (split, [left, right[at].0])
}

/// The box of the centres, twice as large, and its longest side.
fn middles(items: &[Item]) -> (Bounds, usize) {
    let middles = items.iter().fold(EMPTY, |b, item| b.with(item.middle()));
    let sides = middles.high - middles.low;
    (middles, (0..3).fold(0, |best, k| if sides[k] > sides[best] { k } else { best }))
}

/// Halves along the longest side of the centres' box.
fn halve(items: &mut [Item]) -> (usize, [Bounds; 2]) {
    let half = items.len() / 2;
    let (_, axis) = middles(items);
    items.select_nth_unstable_by(half, |a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
    parted(items, half)
}

fn parted(items: &[Item], at: usize) -> (usize, [Bounds; 2]) {
    (at, [around(&items[..at]), around(&items[at..])])
}
