//! The judge's own surface: raw texels, its own wrapping, its own walk in `f64`.
//!
//! Nothing here comes from the crate under test: no stored cells, no pyramid, no closed-form root.

use heightfield::Wrap;

/// Cells a ray is followed through before the judge gives up on it.
const PATIENCE: u32 = 40_000;

/// A bilinear surface between texel centres.
pub struct Surface {
    pub texels: Vec<f32>,
    pub width: usize,
    pub height: usize,
    pub wrap: Wrap,
    pub highest: f64,
    lowest: f64,
}

/// What the walk sees along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Where the ray first touches the surface; infinite when it does not.
    pub touch: f64,
    /// Where it is first deeper in than the slack; infinite when it never is.
    pub deep: f64,
    /// Whether the walk came to an end.
    pub complete: bool,
}

/// `a + b s + c s^2`: how high the ray is above one cell, `s` after entering it.
#[derive(Clone, Copy)]
struct Gap {
    a: f64,
    b: f64,
    c: f64,
}

impl Gap {
    fn at(self, s: f64) -> f64 {
        self.a + s * (self.b + s * self.c)
    }

    /// The lowest point of an upward parabola, if it lies inside.
    fn lowest_inside(self, length: f64) -> Option<f64> {
        let s = -0.5 * self.b / self.c;
        (self.c > 0.0 && s > 0.0 && s < length).then_some(s)
    }

    fn least(self, length: f64) -> f64 {
        let ends = self.a.min(self.at(length));
        self.lowest_inside(length).map_or(ends, |s| ends.min(self.at(s)))
    }

    /// The first `s` with a gap of at most `level`, by bisection of the pieces between extrema.
    fn first_at_most(self, level: f64, length: f64) -> Option<f64> {
        if self.a <= level {
            return Some(0.0);
        }
        let mut above = 0.0;
        let turn = -0.5 * self.b / self.c;
        let cuts = [if turn > 0.0 && turn < length { turn } else { length }, length];
        for cut in cuts {
            if self.at(cut) > level {
                above = cut;
                continue;
            }
            let mut below = cut;
            for _ in 0..200 {
                let middle = 0.5 * (above + below);
                if middle <= above || middle >= below {
                    break;
                }
                if self.at(middle) <= level { below = middle } else { above = middle }
            }
            return Some(below);
        }
        None
    }
}

impl Surface {
    pub fn new(texels: Vec<f32>, width: usize, height: usize, wrap: Wrap) -> Self {
        let highest = texels.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let lowest = texels.iter().copied().fold(f32::INFINITY, f32::min);
        Self { texels, width, height, wrap, highest: f64::from(highest), lowest: f64::from(lowest) }
    }

    fn wrapped(&self, i: i64, n: usize) -> usize {
        let n = n as i64;
        (match self.wrap {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Clamp => i.max(0).min(n - 1),
            Wrap::Mirror => {
                let back = i.rem_euclid(2 * n);
                back.min(2 * n - 1 - back)
            }
        }) as usize
    }

    /// The origin with whole periods taken off, which is exact but for the last bit.
    fn near(&self, origin: [f64; 3]) -> [f64; 3] {
        let period = match self.wrap {
            Wrap::Repeat => 1.0,
            Wrap::Mirror => 2.0,
            Wrap::Clamp => return origin,
        };
        let reduce = |u: f64| u - (u / period).floor() * period;
        [reduce(origin[0]), reduce(origin[1]), origin[2]]
    }

    /// Bilinear height at a position in texels, 0 at the centre of texel 0.
    fn height_at(&self, x: f64, y: f64) -> f64 {
        let (i, j) = (x.floor(), y.floor());
        let (fx, fy) = (x - i, y - j);
        let [x0, x1] = [0, 1].map(|k| self.wrapped(i as i64 + k, self.width));
        let [y0, y1] = [0, 1].map(|k| self.wrapped(j as i64 + k, self.height));
        let texel = |i: usize, j: usize| f64::from(self.texels[j * self.width + i]);
        let top = texel(x0, y0) * (1.0 - fx) + texel(x1, y0) * fx;
        let bottom = texel(x0, y1) * (1.0 - fx) + texel(x1, y1) * fx;
        top * (1.0 - fy) + bottom * fy
    }

    /// How high the ray is above the surface at `t`.
    pub fn gap_at(&self, origin: [f64; 3], direction: [f64; 3], t: f64) -> f64 {
        let [u, v, z] = self.near(origin);
        let x = (u + t * direction[0]) * self.width as f64 - 0.5;
        let y = (v + t * direction[1]) * self.height as f64 - 0.5;
        z + t * direction[2] - self.height_at(x, y)
    }

    /// A point of the surface: the height under `(u, v)`.
    pub fn point(&self, u: f64, v: f64) -> f64 {
        let [u, v, _] = self.near([u, v, 0.0]);
        self.height_at(u * self.width as f64 - 0.5, v * self.height as f64 - 0.5)
    }

    /// Follows a ray cell by cell, no farther than `reach`. `lift` is added to its height, `slack` is how
    /// deep "deep" is.
    pub fn look(&self, origin: [f64; 3], direction: [f64; 3], lift: f64, slack: f64, reach: f64) -> Seen {
        let [u, v, z] = self.near(origin);
        let z = z + lift;
        let (x, y) = (u * self.width as f64 - 0.5, v * self.height as f64 - 0.5);
        let (dx, dy, dz) =
            (direction[0] * self.width as f64, direction[1] * self.height as f64, direction[2]);
        let mut seen = Seen { touch: f64::INFINITY, deep: f64::INFINITY, complete: true };
        let mut t = 0.0;
        if z > self.highest + slack {
            if dz >= 0.0 {
                return seen;
            }
            t = (self.highest + slack - z) / dz;
        }
        let mut columns = Line::new(x, dx, t, self.width, self.wrap);
        let mut rows = Line::new(y, dy, t, self.height, self.wrap);
        let [mut x0, mut x1] = [0, 1].map(|k| self.wrapped(columns.cell + k, self.width));
        let [mut y0, mut y1] = [0, 1].map(|k| self.wrapped(rows.cell + k, self.height));
        for _ in 0..PATIENCE {
            let (exit_x, exit_y) = (columns.exit(), rows.exit());
            let mut end = exit_x.min(exit_y).max(t);
            let last = end.is_infinite();
            if last {
                // Straight up or down, or over the endless rim of a clamped map.
                let bottom = if dz < 0.0 { self.lowest - 2.0 * slack } else { self.highest + 1.0 };
                end = if dz == 0.0 { t + 1.0 } else { ((bottom - z) / dz).max(t) };
            }
            let texel = |i: usize, j: usize| f64::from(self.texels[j * self.width + i]);
            let (h00, h10, h01, h11) = (texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1));
            let peak = h00.max(h10).max(h01.max(h11));
            if z + dz * if dz < 0.0 { end } else { t } <= peak + slack {
                let (fx, fy) = (columns.inside(t), rows.inside(t));
                let (ax, ay, twist) = (h10 - h00, h01 - h00, h11 - h10 - h01 + h00);
                let still = |along: f64, d: f64| if along == 0.0 && twist == 0.0 { 0.0 } else { d };
                let (cx, cy) = (still(ax, dx), still(ay, dy));
                let gap = Gap {
                    a: z + dz * t - (h00 + fx * ax + fy * (ay + fx * twist)),
                    b: dz - (ax + fy * twist) * cx - (ay + fx * twist) * cy,
                    c: -twist * cx * cy,
                };
                let length = end - t;
                let least = gap.least(length);
                if least <= 0.0 && seen.touch.is_infinite() {
                    seen.touch = t + gap.first_at_most(0.0, length).unwrap_or(length);
                }
                if least <= -slack {
                    seen.deep = t + gap.first_at_most(-slack, length).unwrap_or(length);
                    return seen;
                }
            }
            t = end;
            if last || t > reach || (dz > 0.0 && z + dz * t > self.highest + slack) {
                return seen;
            }
            if exit_x <= exit_y {
                columns.step();
                [x0, x1] = [0, 1].map(|k| self.wrapped(columns.cell + k, self.width));
            } else {
                rows.step();
                [y0, y1] = [0, 1].map(|k| self.wrapped(rows.cell + k, self.height));
            }
        }
        seen.complete = false;
        seen
    }

    /// How fast a ray that starts on the surface rises above it, along its own way out.
    pub fn rise(&self, origin: [f64; 3], direction: [f64; 3]) -> f64 {
        let [u, v, _] = self.near(origin);
        let (x, y) = (u * self.width as f64 - 0.5, v * self.height as f64 - 0.5);
        let (dx, dy) = (direction[0] * self.width as f64, direction[1] * self.height as f64);
        let step = 1e-6 / dx.abs().max(dy.abs()).max(1e-300);
        direction[2] - (self.height_at(x + step * dx, y + step * dy) - self.height_at(x, y)) / step
    }
}

/// One axis of the walk. Planes are whole numbers; times are taken from the start of the ray.
struct Line {
    start: f64,
    speed: f64,
    cell: i64,
    /// First and last cell of a clamped map, which go on for ever.
    rims: Option<(i64, i64)>,
}

impl Line {
    fn new(start: f64, speed: f64, t: f64, texels: usize, wrap: Wrap) -> Self {
        let cell = (start + t * speed).floor();
        let rims = (wrap == Wrap::Clamp).then_some((-1, texels as i64 - 1));
        let cell = rims.map_or(cell, |(first, last)| cell.max(first as f64).min(last as f64));
        Self { start, speed, cell: cell as i64, rims }
    }

    fn exit(&self) -> f64 {
        let (low, high) = (self.cell as f64, (self.cell + 1) as f64);
        if self.speed > 0.0 && self.rims.is_none_or(|(_, last)| self.cell < last) {
            (high - self.start) / self.speed
        } else if self.speed < 0.0 && self.rims.is_none_or(|(first, _)| self.cell > first) {
            (low - self.start) / self.speed
        } else {
            f64::INFINITY
        }
    }

    fn inside(&self, t: f64) -> f64 {
        (self.start + t * self.speed - self.cell as f64).clamp(0.0, 1.0)
    }

    fn step(&mut self) {
        self.cell += if self.speed > 0.0 { 1 } else { -1 };
    }
}
