//! How far a ray stays under the surface after it first met it: what tells a skipped feature from
//! an imprecise hit.

use heightfield::HeightField;

/// A ray must go this far below the surface (heights in 0..1) for its dive to count. Shallower ones
/// are grazing touches that `f32` cannot tell from a near pass.
pub const DIVE_DEPTH: f64 = 1.0e-4;

/// Ray parameter at which the ray comes out of its first dive deeper than [`DIVE_DEPTH`] after
/// `t_hit`; infinite when it stays below until `t_stop` or `z = 0`.
///
/// A search that reports a hit beyond this point jumped over everything in between. The walk goes
/// cell by cell in `f64`, for any texture-space direction that goes down; along a straight line the
/// bilinear patch of a cell is a quadratic, fixed by its values at the ends and the middle.
pub fn end_of_first_dive(
    field: &HeightField,
    origin: [f64; 3],
    direction: [f64; 3],
    t_hit: f64,
    t_stop: f64,
) -> f64 {
    let [_, _, dz] = direction;
    if !t_hit.is_finite() || dz >= 0.0 {
        return f64::INFINITY;
    }
    let t_stop = t_stop.min(-origin[2] / dz);
    let x = Axis::new(origin[0], direction[0], field.width());
    let y = Axis::new(origin[1], direction[1], field.height());
    let mut t = t_hit;
    let mut deep = false;
    while t < t_stop {
        let end = x.next_line(t).min(y.next_line(t)).min(t_stop);
        let middle = 0.5 * (t + end);
        let patch = Patch::new(field, x.at(middle).floor(), y.at(middle).floor());
        let gap = |t: f64| dz.mul_add(t, origin[2]) - patch.height(x.at(t), y.at(t));
        let (a, b, c) = (gap(t), gap(middle), gap(end));
        // gap(t + s (end - t)) = a + s (p + s q), s in 0..1.
        let q = 2.0 * (a - 2.0 * b + c);
        let p = c - a - q;
        let lowest = if q > 0.0 { (-p / (2.0 * q)).clamp(0.0, 1.0) } else { f64::from(u8::from(c < a)) };
        let s_deep = if deep { Some(0.0) } else { first_below(a, p, q, lowest) };
        if let Some(from) = s_deep {
            deep = true;
            if let Some(s) = first_above(a, p, q, from) {
                return s.mul_add(end - t, t);
            }
        }
        t = end;
    }
    f64::INFINITY
}

/// Where in 0..1 the gap is at its lowest, provided that is deeper than [`DIVE_DEPTH`].
fn first_below(a: f64, p: f64, q: f64, lowest: f64) -> Option<f64> {
    (a + lowest * (p + lowest * q) < -DIVE_DEPTH).then_some(lowest)
}

/// First `s` in `from..1` where `a + p s + q s^2` rises above zero.
fn first_above(a: f64, p: f64, q: f64, from: f64) -> Option<f64> {
    if a + from * (p + from * q) > 0.0 {
        return Some(from);
    }
    let discriminant = p.mul_add(p, -4.0 * q * a);
    if discriminant < 0.0 {
        return None;
    }
    let w = -0.5 * (p + discriminant.sqrt().copysign(p));
    let mut roots = [if q == 0.0 { f64::NAN } else { w / q }, if w == 0.0 { f64::NAN } else { a / w }];
    roots.sort_by(f64::total_cmp);
    roots.into_iter().find(|&s| s >= from && s <= 1.0 && 2.0f64.mul_add(q * s, p) > 0.0)
}

/// The ray along one texture axis, in texels with texel centres at whole numbers.
struct Axis {
    start: f64,
    rate: f64,
}

impl Axis {
    fn new(origin: f64, direction: f64, texels: usize) -> Self {
        let n = texels as f64;
        Self { start: origin.mul_add(n, -0.5), rate: direction * n }
    }

    fn at(&self, t: f64) -> f64 {
        self.rate.mul_add(t, self.start)
    }

    /// The first `t` past this one at which the ray crosses a cell border; infinite without motion.
    fn next_line(&self, t: f64) -> f64 {
        if self.rate == 0.0 {
            return f64::INFINITY;
        }
        let step = self.rate.signum();
        let here = self.at(t);
        let mut line = if step > 0.0 { here.floor() + 1.0 } else { here.ceil() - 1.0 };
        // Rounding may put the line at or before `t`; the next one makes progress.
        for _ in 0..4 {
            let next = (line - self.start) / self.rate;
            if next > t {
                return next;
            }
            line += step;
        }
        f64::INFINITY
    }
}

/// One cell of the surface.
struct Patch {
    corner: [f64; 2],
    heights: [f64; 4],
}

impl Patch {
    fn new(field: &HeightField, i: f64, j: f64) -> Self {
        let (column, row) = (i as i64, j as i64);
        let texel = |x: i64, y: i64| f64::from(field.texel(column.saturating_add(x), row.saturating_add(y)));
        Self { corner: [i, j], heights: [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)] }
    }

    fn height(&self, x: f64, y: f64) -> f64 {
        let (x, y) = (x - self.corner[0], y - self.corner[1]);
        let [h00, h10, h01, h11] = self.heights;
        let top = h00 + (h10 - h00) * x;
        top + (h01 + (h11 - h01) * x - top) * y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heightfield::Wrap;

    /// A ridge along `v`: height 0 but for one column of height 1.
    fn ridge() -> HeightField {
        let mut texels = vec![0.0_f32; 16 * 16];
        for row in texels.chunks_mut(16) {
            row[8] = 1.0;
        }
        HeightField::new(&texels, 16, 16, Wrap::Repeat).unwrap()
    }

    #[test]
    fn a_ray_through_a_ridge_comes_out_behind_it() {
        let field = ridge();
        // Meets the ridge's face at z = 0.5 (7.5 texels from the left centre), then leaves at about 8.5.
        let rate = 0.02;
        let origin = [7.0 / 16.0, 0.4, 0.5 + rate];
        let direction = [1.0 / 16.0, 0.0, -rate];
        let t_hit = 1.0 / (1.0 + rate) * (0.5 + rate);
        let t = end_of_first_dive(&field, origin, direction, t_hit, f64::INFINITY);
        let (x, z) = (6.5 + t, origin[2] + direction[2] * t);
        assert!((9.0 - x - z).abs() < 1e-9, "x {x}, z {z}");
        let stopped = end_of_first_dive(&field, origin, direction, t_hit, t - 0.01);
        assert_eq!(stopped, f64::INFINITY, "not out by then");
    }

    #[test]
    fn a_ray_that_stays_below_never_comes_out() {
        let field = HeightField::new(&[0.5; 16], 4, 4, Wrap::Repeat).unwrap();
        let end = |direction: [f64; 3], t_hit: f64| {
            end_of_first_dive(&field, [0.2, 0.3, 1.0], direction, t_hit, f64::INFINITY)
        };
        assert_eq!(end([0.4, -0.3, -1.0], 0.5), f64::INFINITY);
        assert_eq!(end([0.0, 0.0, -1.0], 0.5), f64::INFINITY);
        assert_eq!(end([0.4, 0.0, -1.0], f64::INFINITY), f64::INFINITY);
    }

    #[test]
    fn a_grazing_touch_is_no_dive() {
        let field = ridge();
        // Touches the ridge's top less deep than the limit; the next ridge, a tile on, is met deeper.
        let origin = [7.5 / 16.0, 0.4, 1.0 - 0.25 * DIVE_DEPTH];
        let direction = [1.0 / 16.0, 0.0, -0.1 * DIVE_DEPTH];
        let t_touch = 1.0 - 0.5 * DIVE_DEPTH;
        let t = end_of_first_dive(&field, origin, direction, t_touch, f64::INFINITY);
        assert!((t - 17.0).abs() < 0.01, "{t}");
    }

    #[test]
    fn agrees_with_dense_samples() {
        let side = 32;
        let texels: Vec<f32> = (0..side * side)
            .map(|i| ((i * 7919) % 1009) as f32 / 1009.0 * if i % 3 == 0 { 1.0 } else { 0.3 })
            .collect();
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let field = HeightField::new(&texels, side, side, wrap).unwrap();
            let mut random = crate::rays::Random::new(11, 1);
            for _ in 0..300 {
                let origin = [random.unit(), random.unit(), 1.0];
                let direction = [random.unit() - 0.5, random.unit() - 0.5, -1.0];
                let gap = |t: f64| {
                    let at = |k: usize| direction[k].mul_add(t, origin[k]);
                    at(2) - field.height_at(at(0), at(1))
                };
                let n = 40_000;
                let sample = |k: usize| k as f64 / n as f64;
                let Some(first) = (0..n).find(|&k| gap(sample(k)) < 0.0) else { continue };
                let mut deepest = 0.0_f64;
                let out = (first..n).find(|&k| {
                    let g = gap(sample(k));
                    deepest = deepest.min(g);
                    g > 0.0 && deepest < -DIVE_DEPTH
                });
                let t = end_of_first_dive(&field, origin, direction, sample(first), f64::INFINITY);
                match out {
                    Some(k) => assert!((t - sample(k)).abs() < 2.0 / n as f64, "{t} against {}", sample(k)),
                    // Samples can jump over a gap that the walk sees.
                    None => assert!(t.is_infinite() || gap(t).abs() < 1e-9, "{t}"),
                }
            }
        }
    }
}
