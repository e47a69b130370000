//! Where to cut a set of boxes in two.

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
    /// Twice the centre along an axis.
    #[inline(always)]
    fn middle(&self, axis: usize) -> f32 {
        self.bounds.low[axis] + self.bounds.high[axis]
    }
}

/// The box around some items.
pub(super) fn around(items: &[Item]) -> Bounds {
    items.iter().fold(EMPTY, |b, item| b.union(item.bounds))
}

/// Puts the items in two parts, and says where the second begins: never at either end.
///
/// The parts have the least sum of area times number among the cuts tried. `balanced` asks for
/// halves instead, as do items whose centres agree.
pub(super) fn cut(items: &mut [Item], balanced: bool) -> usize {
    let half = items.len() / 2;
    if balanced || items.len() < 3 {
        return halve(items);
    }
    let middles = items.iter().fold(EMPTY, |b, item| b.with([0, 1, 2].map(|k| item.middle(k))));
    let sides: [f32; 3] = std::array::from_fn(|k| middles.high[k] - middles.low[k]);
    let axis = (0..3).fold(0, |best, k| if sides[k] > sides[best] { k } else { best });
    let scale = BINS as f32 * (1.0 - 1e-6) / sides[axis];
    if !(scale.is_finite() && scale > 0.0) {
        return half;
    }
    let bin = |item: &Item| (((item.middle(axis) - middles.low[axis]) * scale) as usize).min(BINS - 1);
    let mut boxes = [EMPTY; BINS];
    let mut counts = [0usize; BINS];
    for item in items.iter() {
        let at = bin(item);
        boxes[at] = boxes[at].union(item.bounds);
        counts[at] += 1;
    }
    let mut right = [0.0; BINS];
    let (mut b, mut n) = (EMPTY, 0);
    for at in (1..BINS).rev() {
        (b, n) = (b.union(boxes[at]), n + counts[at]);
        right[at] = b.half_area() * n as f32;
    }
    let (mut b, mut n) = (EMPTY, 0);
    let mut best = (f32::INFINITY, 0);
    for at in 1..BINS {
        (b, n) = (b.union(boxes[at - 1]), n + counts[at - 1]);
        let cost = b.half_area() * n as f32 + right[at];
        if n > 0 && n < items.len() && cost < best.0 {
            best = (cost, at);
        }
    }
    if best.1 == 0 {
        return halve(items);
    }
    let mut split = 0;
    for at in 0..items.len() {
        if bin(&items[at]) < best.1 {
            items.swap(at, split);
            split += 1;
        }
    }
    split
}

/// Halves along the longest side of the centres' box.
fn halve(items: &mut [Item]) -> usize {
    let half = items.len() / 2;
    let middles = items.iter().fold(EMPTY, |b, item| b.with([0, 1, 2].map(|k| item.middle(k))));
    let side = |k: usize| middles.high[k] - middles.low[k];
    let axis = (0..3).fold(0, |best, k| if side(k) > side(best) { k } else { best });
    items.select_nth_unstable_by(half, |a, b| a.middle(axis).total_cmp(&b.middle(axis)));
    half
}
