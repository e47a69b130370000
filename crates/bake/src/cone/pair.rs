//! How steeply the surface can rise between two of its bilinear cells.

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

/// Whether the surface may rise from some `x` in `a` to some `y` in `b` with more than `slope`; no means no.
///
/// For any vector `p` not longer than `slope`, `slope |y - x| >= p . (y - x)`. With that in its place,
/// `h(y) - h(x) - p . (y - x)` is bilinear in `x` and in `y`, so its maximum lies at corners: where it is not
/// above zero at any pair of corners, no pair of points rises that much. Three such vectors are tried: one that
/// is the mean gradient across the way from `a` to `b`, which takes the common tilt of the surface away, and as long as
/// it may be along it; one that leads along the way; and one between them.
///
/// `centre`: of `b` from that of `a`; `half`: sides of each, halved; heights as in [`Patch`].
#[inline]
pub(super) fn may_rise<T: Real>(a: [T; 4], b: [T; 4], centre: [T; 2], half: [[T; 2]; 2], slope: T) -> bool {
    let zero = T::from(0.0);
    let ends = |h: [T; 4]| (h[0].min(h[1]).min(h[2].min(h[3])), h[0].max(h[1]).max(h[2].max(h[3])));
    if ends(b).1 <= ends(a).0 {
        return false;
    }
    let quarter = T::from(0.25);
    let length = (centre[0] * centre[0] + centre[1] * centre[1]).sqrt();
    let way = [centre[0] / length, centre[1] / length];
    let mean = |h: [T; 4], half: [T; 2]| {
        if half[0] > zero {
            let (x, y) = ((h[1] - h[0]) + (h[3] - h[2]), (h[2] - h[0]) + (h[3] - h[1]));
            [x * quarter / half[0], y * quarter / half[1]]
        } else {
            [zero; 2]
        }
    };
    let (of_a, of_b) = (mean(a, half[0]), mean(b, half[1]));
    let one_half = T::from(0.5);
    let tilt = [(of_a[0] + of_b[0]) * one_half, (of_a[1] + of_b[1]) * one_half];
    let along = tilt[0] * way[0] + tilt[1] * way[1];
    let square = tilt[0] * tilt[0] + tilt[1] * tilt[1];
    let spare = slope * slope + along * along - square;
    let base = a[0];
    let (a, b) = (a.map(|h| h - base), b.map(|h| h - base));
    let rises = |p: [T; 2]| {
        let (x, y) = (p[0] * half[0][0], p[1] * half[0][1]);
        let below = (a[0] + x + y).min(a[1] - x + y).min((a[2] + x - y).min(a[3] - x - y));
        let (x, y) = (p[0] * half[1][0], p[1] * half[1][1]);
        let above = (b[0] + x + y).max(b[1] - x + y).max((b[2] + x - y).max(b[3] - x - y));
        above - (p[0] * centre[0] + p[1] * centre[1]) > below
    };
    let onward = [slope * way[0], slope * way[1]];
    if spare > zero {
        let more = spare.sqrt() - along;
        if !rises([tilt[0] + more * way[0], tilt[1] + more * way[1]]) {
            return false;
        }
        // Where the surface itself is steeper, but across the way: half way between both.
        let steep = square.sqrt();
        let middle = [tilt[0] + steep * way[0], tilt[1] + steep * way[1]];
        let length = (middle[0] * middle[0] + middle[1] * middle[1]).sqrt();
        if length > zero && !rises([middle[0] * slope / length, middle[1] * slope / length]) {
            return false;
        }
    }
    rises(onward)
}

/// `f32` and `f64`.
pub(super) trait Real:
    Copy
    + PartialOrd
    + From<f32>
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Div<Output = Self>
{
    fn sqrt(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
}

macro_rules! real {
    ($($float:ty)*) => { $(
        impl Real for $float {
            #[inline]
            fn sqrt(self) -> Self {
                <$float>::sqrt(self)
            }
            #[inline]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
        }
    )* };
}

real! { f32 f64 }

/// An upper bound of `(h(y) - h(x)) / |y - x|` over `x` in `a` and `y` in `b`, which do not touch, or anything
/// not above `enough` when there is no steeper rise.
///
/// With a unit vector `n` from centre to centre for `p / slope` in [`may_rise`], the greatest quotient
/// over the sixteen pairs of corners bounds all pairs of points; what is given away shrinks with the
/// square of size over distance. Each of `depth` rounds cuts both patches into four. The highest corner and
/// the distance alone give another bound.
pub(super) fn steepest(a: &Patch, b: &Patch, depth: u32, enough: f64) -> f64 {
    let (from, to) = (a.centre(), b.centre());
    let offset = [to[0] - from[0], to[1] - from[1]];
    let half = |patch: &Patch| [0, 1].map(|axis| 0.5 * (patch.high[axis] - patch.low[axis]));
    if !may_rise(a.heights, b.heights, offset, [half(a), half(b)], enough) {
        return 0.0;
    }
    let highest = b.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = a.heights.iter().copied().fold(f64::INFINITY, f64::min);
    let gap = [0, 1].map(|axis| (b.low[axis] - a.high[axis]).max(a.low[axis] - b.high[axis]).max(0.0));
    let distance = (gap[0] * gap[0] + gap[1] * gap[1]).sqrt();
    let bound = (highest - lowest).max(0.0) / distance;
    if bound <= enough {
        return bound;
    }
    if depth > 0 {
        let mut parts = 0.0_f64;
        for p in a.quarters() {
            for q in b.quarters() {
                parts = parts.max(steepest(&p, &q, depth - 1, enough.max(parts)));
            }
        }
        return bound.min(parts);
    }
    let length = (offset[0] * offset[0] + offset[1] * offset[1]).sqrt();
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
    bound.min(quotient)
}

/// Rounds of cutting for two cells this many cells apart (the greater of both axes, 2 or more).
pub(super) fn depth_of(cells_apart: i64) -> u32 {
    match cells_apart {
        ..4 => 2,
        4..8 => 1,
        _ => 0,
    }
}
