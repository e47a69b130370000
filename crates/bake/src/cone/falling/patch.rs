//! How steeply the surface can rise from one of its bilinear cells to where it falls in another.

use super::TOLERANCE;

/// A rectangle of one bilinear cell: its sides in UV units, its corner heights `[h00, h10, h01, h11]`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub low: [f64; 2],
    pub high: [f64; 2],
    pub heights: [f64; 4],
}

impl Patch {
    fn corners(&self) -> [[f64; 3]; 4] {
        let ([x0, y0], [x1, y1], h) = (self.low, self.high, self.heights);
        [[x0, y0, h[0]], [x1, y0, h[1]], [x0, y1, h[2]], [x1, y1, h[3]]]
    }

    fn centre(&self) -> [f64; 2] {
        [0, 1].map(|axis| 0.5 * (self.low[axis] + self.high[axis]))
    }

    fn half(&self) -> [f64; 2] {
        [0, 1].map(|axis| 0.5 * (self.high[axis] - self.low[axis]))
    }

    /// `dh/du` above and below, `dh/dv` left and right.
    fn slopes(&self) -> [[f64; 2]; 2] {
        let [h00, h10, h01, h11] = self.heights;
        let [du, dv] = [0, 1].map(|axis| self.high[axis] - self.low[axis]);
        [[(h10 - h00) / du, (h11 - h01) / du], [(h01 - h00) / dv, (h11 - h10) / dv]]
    }

    fn quarters(&self) -> [Patch; 4] {
        let [h00, h10, h01, h11] = self.heights;
        let [x, y] = self.centre();
        let (top, bottom, left, right) =
            (0.5 * (h00 + h10), 0.5 * (h01 + h11), 0.5 * (h00 + h01), 0.5 * (h10 + h11));
        let middle = 0.5 * (top + bottom);
        [
            Patch { low: self.low, high: [x, y], heights: [h00, top, left, middle] },
            Patch { low: [x, self.low[1]], high: [self.high[0], y], heights: [top, h10, middle, right] },
            Patch { low: [self.low[0], y], high: [x, self.high[1]], heights: [left, middle, h01, bottom] },
            Patch { low: [x, y], high: self.high, heights: [middle, right, bottom, h11] },
        ]
    }
}

/// How often both patches are cut into four, and the farther one alone after that, for two cells this many cells apart
/// along each axis, 2 or more along one. The part of a cell that does not fall counts as if it did where it
/// is not cut off.
pub(super) fn cuts(offset: [i64; 2]) -> [u32; 2] {
    match offset[0].abs().max(offset[1].abs()) {
        ..4 => [2, 3],
        4..8 => [1, 3],
        8..32 => [0, 3],
        32..128 => [0, 2],
        _ => [0, 1],
    }
}

/// The least upper bound of `(h(y) - h(x)) / |y - x|` over `x` in `a` and those `y` in `b` where the surface falls along
/// `y - x`, as far as `cuts` allow no more than [`TOLERANCE`] too much; `known` if it is not above that. The
/// patches do not touch.
pub(super) fn steepest(a: &Patch, b: &Patch, cuts: [u32; 2], known: f64) -> f64 {
    if !may_fall(a, b) || !may_rise(a, b, known) {
        return known;
    }
    let bound = bound(a, b);
    if bound <= known {
        return known;
    }
    let known = known.max((1.0 + TOLERANCE) * attained(a, b));
    if bound <= known {
        return known;
    }
    match cuts {
        [0, 0] => bound,
        [0, further] => b.quarters().iter().fold(known, |known, b| steepest(a, b, [0, further - 1], known)),
        [both, further] => {
            let mut known = known;
            for a in a.quarters() {
                for b in b.quarters() {
                    known = steepest(&a, &b, [both - 1, further], known);
                }
            }
            known
        }
    }
}

/// Whether the surface of `b` may fall along some way from `a`; no means no.
fn may_fall(a: &Patch, b: &Patch) -> bool {
    let slopes = b.slopes();
    let least = |axis: usize| {
        let (from, to) = (b.low[axis] - a.high[axis], b.high[axis] - a.low[axis]);
        let [g0, g1] = slopes[axis];
        (g0 * from).min(g0 * to).min((g1 * from).min(g1 * to))
    };
    least(0) + least(1) < 0.0
}

/// The steepest rise from a corner of `a` to one of `b` at which `b` falls, 0 without any.
fn attained(a: &Patch, b: &Patch) -> f64 {
    let ([above, below], [left, right]) = {
        let [u, v] = b.slopes();
        (u, v)
    };
    let gradients = [[above, left], [above, right], [below, left], [below, right]];
    let mut most = 0.0_f64;
    for ([x1, y1, high], [gu, gv]) in b.corners().into_iter().zip(gradients) {
        for [x0, y0, low] in a.corners() {
            let (u, v) = (x1 - x0, y1 - y0);
            if gu * u + gv * v < 0.0 {
                most = most.max((high - low) / (u * u + v * v).sqrt());
            }
        }
    }
    most
}

/// Whether the surface may rise from some `x` in `a` to some `y` in `b` with more than `slope`; no means no.
///
/// For any vector `p` not longer than `slope`, `slope |y - x| >= p . (y - x)`. With that in its place,
/// `h(y) - h(x) - p . (y - x)` is bilinear in `x` and in `y`, so its maximum lies at corners: where it is not
/// above zero at any pair of corners, no pair of points rises that much. Vectors tried are: one that
/// is the mean gradient across the way from `a` to `b`, which takes the common tilt of the surface away, and as long as
/// it may be along it; one that leads along the way; one between them; and one that takes the gradient at `y` off.
fn may_rise(a: &Patch, b: &Patch, slope: f64) -> bool {
    let (from, to, half) = (a.centre(), b.centre(), [a.half(), b.half()]);
    let centre = [to[0] - from[0], to[1] - from[1]];
    let length = centre[0].hypot(centre[1]);
    let way = [centre[0] / length, centre[1] / length];
    let mean = |patch: &Patch| patch.slopes().map(|[one, other]| 0.5 * (one + other));
    let (of_a, of_b) = (mean(a), mean(b));
    let tilt = [0.5 * (of_a[0] + of_b[0]), 0.5 * (of_a[1] + of_b[1])];
    let along = tilt[0] * way[0] + tilt[1] * way[1];
    let square = tilt[0] * tilt[0] + tilt[1] * tilt[1];
    let spare = slope * slope + along * along - square;
    let slopes_of_b = b.slopes();
    let (a, b) = (a.heights, b.heights);
    let rises = |p: [f64; 2]| {
        let (x, y) = (p[0] * half[0][0], p[1] * half[0][1]);
        let below = (a[0] + x + y).min(a[1] - x + y).min((a[2] + x - y).min(a[3] - x - y));
        let (x, y) = (p[0] * half[1][0], p[1] * half[1][1]);
        let above = (b[0] + x + y).max(b[1] - x + y).max((b[2] + x - y).max(b[3] - x - y));
        above - (p[0] * centre[0] + p[1] * centre[1]) > below
    };
    if spare > 0.0 {
        let more = spare.sqrt() - along;
        if !rises([tilt[0] + more * way[0], tilt[1] + more * way[1]]) {
            return false;
        }
        // Where the surface itself is steeper, but across the way: half way between both.
        let steep = square.sqrt();
        let middle = [tilt[0] + steep * way[0], tilt[1] + steep * way[1]];
        let length = middle[0].hypot(middle[1]);
        if length > 0.0 && !rises([middle[0] * slope / length, middle[1] * slope / length]) {
            return false;
        }
    }
    // Only where the surface falls at `y` does the rise count, and there what its gradient says of the way may be taken
    // off: less than nothing, but for what the gradient may differ by within `b`.
    let [u, v] = slopes_of_b;
    let straight = slope - 0.5 * (u[1] - u[0]).hypot(v[1] - v[0]);
    if straight > 0.0 && !rises([of_b[0] + straight * way[0], of_b[1] + straight * way[1]]) {
        return false;
    }
    rises([slope * way[0], slope * way[1]])
}

/// An upper bound of `(h(y) - h(x)) / |y - x|` over `x` in `a` and `y` in `b`.
///
/// With a unit vector `n` from centre to centre for `p / slope` in [`may_rise`], the greatest quotient
/// over the sixteen pairs of corners bounds all pairs of points; what is given away shrinks with the
/// square of size over distance. The highest corner and the distance alone give another bound.
fn bound(a: &Patch, b: &Patch) -> f64 {
    let (from, to) = (a.centre(), b.centre());
    let offset = [to[0] - from[0], to[1] - from[1]];
    let length = offset[0].hypot(offset[1]);
    let mut quotient = 0.0_f64;
    for p in a.corners() {
        for q in b.corners() {
            let rise = q[2] - p[2];
            if rise > 0.0 {
                let run = ((q[0] - p[0]) * offset[0] + (q[1] - p[1]) * offset[1]) / length;
                quotient = quotient.max(if run > 0.0 { rise / run } else { f64::INFINITY });
            }
        }
    }
    let highest = b.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = a.heights.iter().copied().fold(f64::INFINITY, f64::min);
    let gap = [0, 1].map(|axis| (b.low[axis] - a.high[axis]).max(a.low[axis] - b.high[axis]).max(0.0));
    quotient.min((highest - lowest).max(0.0) / gap[0].hypot(gap[1]))
}
