//! The steepest rise between a point and a straight edge or a bilinear cell, in closed form.
//!
//! Positions are relative to the point, in UV units; heights are rises over the point. A rise that is not
//! steeper than what is known already is not worked out.

/// The steepest rise from the origin to the inside of a straight edge, or `best` if that is not less.
///
/// The edge runs along an axis from `from` to `from + length` at distance `apart` from the origin, and its
/// ends rise by `rises`. With `a + g t` for the rise at `t`, the quotient `(a + g t) / sqrt(apart^2 + t^2)` is
/// greatest at `t = g apart^2 / a`, where it is `sqrt((a / apart)^2 + g^2)`.
#[inline(always)]
pub(super) fn to_edge(rises: [f64; 2], from: f64, length: f64, apart: f64, best: f64) -> f64 {
    let slope = (rises[1] - rises[0]) / length;
    let foot = rises[0] - slope * from;
    let square = apart * apart;
    if foot > 0.0 && foot * foot > (best * best - slope * slope) * square {
        let at = slope * square;
        if at > from * foot && at < (from + length) * foot {
            return best.max((foot * foot / square + slope * slope).sqrt());
        }
    }
    best
}

/// The steepest rise from the origin to a cell, or `best` if that is not less: to its corners, to its edges
/// and to its inside. The cell lies in one quadrant, from `low` to `low + side`; `[h00, h10, h01, h11]` are the
/// rises of its corners.
#[inline(always)]
pub(super) fn to_cell(rises: [f64; 4], low: [f64; 2], side: [f64; 2], mut best: f64) -> f64 {
    let [h00, h10, h01, h11] = rises;
    let ([u0, v0], [u1, v1]) = (low, [low[0] + side[0], low[1] + side[1]]);
    for (rise, u, v) in [(h00, u0, v0), (h10, u1, v0), (h01, u0, v1), (h11, u1, v1)] {
        let square = u * u + v * v;
        if rise > 0.0 && rise * rise > best * best * square {
            best = rise / square.sqrt();
        }
    }
    best = to_edge([h00, h10], u0, side[0], v0, best);
    best = to_edge([h01, h11], u0, side[0], v1, best);
    best = to_edge([h00, h01], v0, side[1], u0, best);
    best = to_edge([h10, h11], v0, side[1], u1, best);
    to_inside(rises, low, side, best)
}

/// The steepest rise to the inside of a cell, as [`to_cell`].
///
/// With `e + a u + b v + k u v` for the rise, the way from the origin in a fixed direction is steepest where
/// `k u v = e`, and rises less elsewhere if `e < 0`: the rest is a search along that hyperbola.
fn to_inside([h00, h10, h01, h11]: [f64; 4], low: [f64; 2], side: [f64; 2], best: f64) -> f64 {
    let twist = ((h11 - h10) - (h01 - h00)) / (side[0] * side[1]);
    if twist == 0.0 {
        return best;
    }
    let a = (h10 - h00) / side[0] - twist * low[1];
    let b = (h01 - h00) / side[1] - twist * low[0];
    let e = h00 - a * low[0] - b * low[1] - twist * low[0] * low[1];
    if e >= 0.0 {
        return best;
    }
    // Mirrored to where u and v are positive; the near side may be 0, without a sign.
    let mirror = |axis: usize| {
        let (from, to) = (low[axis], low[axis] + side[axis]);
        if to <= 0.0 { (-1.0, 0.0 - to, 0.0 - from) } else { (1.0, from, to) }
    };
    let ((sign_u, u0, u1), (sign_v, v0, v1)) = (mirror(0), mirror(1));
    let product = e / (twist * sign_u * sign_v);
    if product <= u0 * v0 || product >= u1 * v1 {
        return best;
    }
    let root = product.sqrt();
    let curve = Hyperbola { a: sign_u * a, b: sign_v * b, c: -2.0 * e / root };
    let (from, to) = ((u0 / root).max(root / v1), (u1 / root).min(root / v0));
    curve.peak(from, to).map_or(best, |w| best.max(curve.slope(w)))
}

/// Points `(u, v) = r (w, 1 / w)` with the rise `r (a w + b / w - c)`, `c > 0`.
struct Hyperbola {
    a: f64,
    b: f64,
    c: f64,
}

impl Hyperbola {
    fn slope(&self, w: f64) -> f64 {
        (self.a * w + self.b / w - self.c) / w.hypot(w.recip())
    }

    /// Has the sign of the derivative of [`Self::slope`].
    fn growth(&self, w: f64) -> f64 {
        (self.c * w - 2.0 * self.b) * w * w * w + 2.0 * self.a * w - self.c
    }

    /// The derivative of [`Self::growth`].
    fn bend(&self, w: f64) -> f64 {
        (4.0 * self.c * w - 6.0 * self.b) * w * w + 2.0 * self.a
    }

    /// Where the slope has a maximum between `from` and `to`.
    ///
    /// It falls at first and rises at last, so it has one at most: where `growth` turns negative. That is
    /// between the maximum and the minimum of `growth`, if it has them, and those lie to the left and to
    /// the right of `b / c`, where its bend is least.
    fn peak(&self, mut from: f64, mut to: f64) -> Option<f64> {
        if self.a <= 0.0 || self.b <= 0.0 || from >= to {
            return None;
        }
        let middle = self.b / self.c;
        if self.growth(from) <= 0.0 {
            let end = middle.min(to);
            if from >= end || self.bend(from) <= 0.0 || self.bend(end) >= 0.0 {
                return None;
            }
            from = halve(from, end, |w| self.bend(w));
        }
        if self.growth(to) >= 0.0 {
            let start = middle.max(from);
            if start >= to || self.bend(start) >= 0.0 || self.bend(to) <= 0.0 {
                return None;
            }
            to = halve(start, to, |w| -self.bend(w));
        }
        if self.growth(from) <= 0.0 || self.growth(to) >= 0.0 {
            return None;
        }
        let mut w = 0.5 * (from + to);
        for _ in 0..ROUNDS {
            let growth = self.growth(w);
            if growth > 0.0 {
                from = w
            } else {
                to = w
            }
            let next = w - growth / self.bend(w);
            let next = if next > from && next < to { next } else { 0.5 * (from + to) };
            if (next - w).abs() <= CLOSE * w {
                return Some(next);
            }
            w = next;
        }
        Some(w)
    }
}

/// Most steps to a root.
const ROUNDS: u32 = 60;
/// Relative error of a maximum's place; that of its value is the square of it.
const CLOSE: f64 = 1e-7;

/// Where `f`, positive at `from` and negative at `to`, is zero.
fn halve(mut from: f64, mut to: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..ROUNDS {
        let middle = 0.5 * (from + to);
        if f(middle) > 0.0 { from = middle } else { to = middle }
    }
    0.5 * (from + to)
}

#[cfg(test)]
mod tests {
    use super::{to_cell, to_edge};

    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn cells_are_as_steep_as_the_steepest_of_many_samples() {
        let mut state = 1;
        let mut inside = 0;
        for _ in 0..3000 {
            let mut cell = || (random(&mut state) * 5.0).floor() - 2.0;
            let side = [1.0, 0.7];
            let low = [cell(), cell() * side[1]];
            // A surface that touches a line from the origin inside the cell, more or less bent there.
            let [u, v] = [0, 1].map(|axis: usize| low[axis] + side[axis] * random(&mut state));
            let slope = 0.5 + random(&mut state);
            let twist = -2.0 * random(&mut state) * slope * u * v / (u * u + v * v).powf(1.5);
            let (away, u_v) = (u.hypot(v), u * v);
            let (a, b) = (slope * u / away - twist * v, slope * v / away - twist * u);
            let height = |u: f64, v: f64| twist * u_v + a * u + b * v + twist * u * v;
            let rises = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
                .map(|(x, y)| height(low[0] + x * side[0], low[1] + y * side[1]));
            let steps = 60;
            let mut sampled = 0.0_f64;
            let mut border = 0.0_f64;
            for j in 0..=steps {
                for i in 0..=steps {
                    let (x, y) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    let away = (low[0] + x * side[0]).hypot(low[1] + y * side[1]);
                    let top = rises[0] + x * (rises[1] - rises[0]);
                    let rise = top + y * (rises[2] + x * (rises[3] - rises[2]) - top);
                    if away > 1e-9 {
                        sampled = sampled.max(rise / away);
                        if [i, j].iter().any(|k| [0, steps].contains(k)) {
                            border = border.max(rise / away);
                        }
                    }
                }
            }
            let touches = low[0] * (low[0] + side[0]) <= 0.0 && low[1] * (low[1] + side[1]) <= 0.0;
            let found = to_cell(rises, low, side, 0.0);
            if !touches {
                assert!(found >= sampled - 1e-12, "{found} {sampled}");
                assert!(found <= sampled + 2e-3, "{found} {sampled} {rises:?} {low:?}");
                inside += u32::from(sampled > border + 1e-4);
            }
        }
        assert!(inside > 1000, "{inside}");
    }

    #[test]
    fn what_is_known_already_stays() {
        assert_eq!(to_edge([1.0, 1.0], -0.5, 1.0, 2.0, 0.0), 0.5);
        assert_eq!(to_edge([1.0, 1.0], -0.5, 1.0, 2.0, 0.6), 0.6);
        assert_eq!(to_edge([1.0, 1.0], 0.5, 1.0, 2.0, 0.0), 0.0);
    }
}
