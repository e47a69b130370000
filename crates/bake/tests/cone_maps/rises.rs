//! The steepest rise around a texel by brute force, in `f64`: all pairs of points on a grid, and the best of
//! them moved about as long as they get steeper. Every figure is the slope between two points of the surface,
//! or of its tangent in a point, so the truth is at least that.

use heightfield::{HeightField, Wrap};

/// Pairs that are moved.
const MOVED: usize = 48;
/// So close to a border that what is lost is not seen, in texels.
const NEAR: f64 = 1e-6;
/// Directions in which the slope is looked at.
const TURNS: usize = 128;
/// Most moves of one.
const MOVES: usize = 150;
/// They are moved less far once this share is all that is gained.
const ENOUGH: f64 = 1e-8;
/// Where `x` starts from along each axis, in texels from the centre: also close to the borders of cells, where
/// the surface bends.
const STARTS: [f64; 13] =
    [-1.0, -1.0 + NEAR, -0.8, -0.5, -0.2, -NEAR, 0.0, NEAR, 0.2, 0.5, 0.8, 1.0 - NEAR, 1.0];

struct Around<'a> {
    field: &'a HeightField,
    centre: [f64; 2],
    texel: [f64; 2],
}

/// Over all `x` less than a texel away from the centre of texel `[i, j]` along both axes and all `y`: the
/// steepest rise, at least 1. `y` starts from two points a texel.
pub fn steepest(field: &HeightField, [i, j]: [usize; 2]) -> f64 {
    let (w, h) = (field.width() as f64, field.height() as f64);
    let around =
        Around { field, centre: [(i as f64 + 0.5) / w, (j as f64 + 0.5) / h], texel: [1.0 / w, 1.0 / h] };
    // In half texels: all of a clamped map, the next period of the others.
    let reach = if field.wrap() == Wrap::Mirror || field.wrap() == Wrap::Clamp { 2 } else { 1 };
    let half = |n: usize| -(reach * n as i32)..=reach * n as i32;
    let all: Vec<([f64; 2], f64)> = half(field.height())
        .flat_map(|b| half(field.width()).map(move |a| [a, b]))
        .map(|[a, b]| around.point(f64::from(a) / 2.0, f64::from(b) / 2.0))
        .map(|y| (y, around.height(y)))
        .collect();
    let (mut pairs, mut tangents) = (Vec::new(), Vec::new());
    for x in STARTS.iter().flat_map(|&b| STARTS.iter().map(move |&a| (a, b))).map(|(a, b)| around.point(a, b))
    {
        let low = around.height(x);
        let mut best = (1.0, x, x);
        for &(y, high) in all.iter().filter(|(_, high)| *high > low) {
            let (du, dv, rise) = (y[0] - x[0], y[1] - x[1], high - low);
            let square = du * du + dv * dv;
            if rise * rise > best.0 * best.0 * square && square > 1e-20 {
                best = (rise / square.sqrt(), x, y);
            }
        }
        pairs.push(best);
        // All turns steeper than those next to them: the surface bends at the borders of cells.
        let turn = |k: usize| (k % TURNS) as f64 * std::f64::consts::TAU / TURNS as f64;
        let slopes: Vec<f64> = (0..TURNS).map(|k| around.tangent(x, turn(k))).collect();
        let beside = |k: usize| slopes[(k + 1) % TURNS].max(slopes[(k + TURNS - 1) % TURNS]);
        let steepest = (0..TURNS).filter(|&k| slopes[k] > 0.0 && slopes[k] >= beside(k));
        tangents.extend(steepest.map(|k| (x, turn(k))));
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    let moved = pairs.iter().take(MOVED).map(|&(_, x, y)| around.improve_pair(x, y));
    let turned = tangents.iter().map(|&(x, turn)| around.improve_tangent(x, turn));
    moved.chain(turned).fold(1.0, f64::max)
}

impl Around<'_> {
    /// A point so many texels from the centre.
    fn point(&self, a: f64, b: f64) -> [f64; 2] {
        [self.centre[0] + a * self.texel[0], self.centre[1] + b * self.texel[1]]
    }

    fn height(&self, at: [f64; 2]) -> f64 {
        self.field.height_at(at[0], at[1])
    }

    fn slope(&self, x: [f64; 2], y: [f64; 2]) -> f64 {
        let away = (y[0] - x[0]).hypot(y[1] - x[1]);
        if away > 1e-5 * self.texel[0].min(self.texel[1]) {
            (self.height(y) - self.height(x)) / away
        } else {
            0.0
        }
    }

    /// The slope at `x` in a direction, over less than [`NEAR`].
    fn tangent(&self, x: [f64; 2], turn: f64) -> f64 {
        let away = 0.2 * NEAR * self.texel[0].min(self.texel[1]);
        (self.height([x[0] + away * turn.cos(), x[1] + away * turn.sin()]) - self.height(x)) / away
    }

    /// `x` moved by so many texels, kept around the texel.
    fn moved(&self, x: [f64; 2], by: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let far = self.texel[axis];
            (x[axis] + by[axis] * far).clamp(self.centre[axis] - far, self.centre[axis] + far)
        })
    }

    fn improve_pair(&self, mut x: [f64; 2], mut y: [f64; 2]) -> f64 {
        let mut best = self.slope(x, y);
        let mut step = 0.25;
        for _ in 0..MOVES {
            if step < 1e-7 {
                break;
            }
            let from = (best, x, y);
            for k in 0..81 {
                let by = [k % 3, k / 3 % 3, k / 9 % 3, k / 27].map(|m| f64::from(m - 1) * step);
                let near = self.moved(from.1, [by[0], by[1]]);
                let far = [from.2[0] + by[2] * self.texel[0], from.2[1] + by[3] * self.texel[1]];
                let slope = self.slope(near, far);
                if slope > best {
                    (best, x, y) = (slope, near, far);
                }
            }
            if best <= from.0 * (1.0 + ENOUGH) {
                step *= 0.5;
            }
        }
        best
    }

    fn improve_tangent(&self, mut x: [f64; 2], mut turn: f64) -> f64 {
        let mut best = self.tangent(x, turn);
        let mut step = 0.25;
        for _ in 0..MOVES {
            if step < 1e-7 {
                break;
            }
            let from = (best, x, turn);
            for k in 0..27 {
                let by = [k % 3, k / 3 % 3, k / 9].map(|m| f64::from(m - 1) * step);
                let near = self.moved(from.1, [by[0], by[1]]);
                let slope = self.tangent(near, from.2 + by[2]);
                if slope > best {
                    (best, x, turn) = (slope, near, from.2 + by[2]);
                }
            }
            if best <= from.0 * (1.0 + ENOUGH) {
                step *= 0.5;
            }
        }
        best
    }
}
