//! An independent judge of hits: the plainest walk there is, in `f64`, cell by cell, with a wrap of its own.
//!
//! It shares no code with the searches, their pyramids or the reference in `f64`, so that a fault planted
//! in any of them shows. It is slow where rays cross many cells, and gives up on those that cross more than
//! [`MOST_CELLS`].

use heightfield::Wrap;
use rayon::prelude::*;

/// Cells that a ray is followed through, at most.
pub const MOST_CELLS: usize = 1 << 18;

/// What the judge says about one ray and the hit reported for it. Heights are 0..1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Verdict {
    /// Ray parameter of the true first hit: infinite without one, NaN when the judge gave up.
    pub t: f64,
    /// Height of the reported point above the surface; NaN when nothing was reported.
    pub gap: f64,
    /// How deep the ray was below the surface before the reported hit (or its end, without one), counting
    /// only dives that it came out of again, and those deeper than the reported point; 0 for none.
    pub skipped: f64,
    /// How fast rounding grows: sum of the magnitudes of height change along the ray, a unit of `t`, at the
    /// reported point.
    pub rate: f64,
}

/// The surface as the judge sees it.
#[derive(Debug, Clone, Copy)]
pub struct Judge<'a> {
    /// `width * height` heights, row by row.
    pub texels: &'a [f32],
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What lies beyond the edge.
    pub wrap: Wrap,
}

impl Judge<'_> {
    /// Judges rays that go down, `N * 3` numbers each, and the `t` reported for them (not finite: no hit).
    pub fn verdicts(&self, origins: &[f64], directions: &[f64], reported: &[f64]) -> Vec<Verdict> {
        (0..reported.len())
            .into_par_iter()
            .map(|i| {
                let ray = Ray {
                    origin: std::array::from_fn(|axis| origins[3 * i + axis]),
                    direction: std::array::from_fn(|axis| directions[3 * i + axis]),
                };
                self.verdict(&ray, reported[i])
            })
            .collect()
    }

    /// Judges one ray.
    fn verdict(&self, ray: &Ray, reported: f64) -> Verdict {
        let down = -ray.direction[2];
        if down <= 0.0 {
            return Verdict { t: f64::NAN, gap: f64::NAN, skipped: 0.0, rate: 0.0 };
        }
        let from = ((ray.origin[2] - 1.0) / down).max(0.0);
        let last = ray.origin[2] / down;
        let until = if reported.is_finite() { reported } else { last };
        let mut verdict = Verdict { t: f64::INFINITY, gap: f64::NAN, skipped: 0.0, rate: 0.0 };
        if reported.is_finite() {
            let (x, y) = self.position(ray, reported);
            let patch = self.patch(x.floor(), y.floor());
            verdict.gap = ray.z(reported) - patch.height(x, y);
            let [sx, sy] = patch.slopes(x, y);
            verdict.rate = down
                + (sx * ray.direction[0] * self.width as f64).abs()
                + (sy * ray.direction[1] * self.height as f64).abs();
        }
        // Deepest point of the dive that the ray is in.
        let mut dive = 0.0_f64;
        let mut t = from;
        for _ in 0..MOST_CELLS {
            if t >= last || (t >= until && verdict.t.is_finite()) {
                verdict.skipped = verdict.skipped.max(dive.min(dive + verdict.gap.min(0.0)));
                return verdict;
            }
            let end = self.next_border(ray, t).min(last);
            let middle = 0.5 * (t + end);
            let (x, y) = self.position(ray, middle);
            let patch = self.patch(x.floor(), y.floor());
            let gap = |t: f64| {
                let (x, y) = self.position(ray, t);
                ray.z(t) - patch.height(x, y)
            };
            if verdict.t.is_infinite()
                && let Some(hit) = first_root(&gap, t, end)
            {
                verdict.t = hit;
            }
            if t < until {
                let stop = end.min(until);
                let (lowest, least) = lowest_of(&gap, t, stop);
                if least < 0.0 {
                    dive = dive.max(-least);
                }
                if gap(stop) > 0.0 && stop > lowest {
                    verdict.skipped = verdict.skipped.max(dive);
                    dive = 0.0;
                }
            }
            t = end;
        }
        verdict.t = f64::NAN;
        verdict
    }

    /// Texels, with centres at whole numbers.
    fn position(&self, ray: &Ray, t: f64) -> (f64, f64) {
        let along = |axis: usize, n: usize| (ray.origin[axis] + t * ray.direction[axis]) * n as f64 - 0.5;
        (along(0, self.width), along(1, self.height))
    }

    /// The next `t` at which the ray crosses a line between cells.
    fn next_border(&self, ray: &Ray, t: f64) -> f64 {
        let (x, y) = self.position(ray, t);
        let mut next = f64::INFINITY;
        for (at, axis, n) in [(x, 0, self.width), (y, 1, self.height)] {
            let rate = ray.direction[axis] * n as f64;
            if rate == 0.0 {
                continue;
            }
            let mut line = if rate > 0.0 { at.floor() + 1.0 } else { at.ceil() - 1.0 };
            for _ in 0..4 {
                let crossing = ((line + 0.5) / n as f64 - ray.origin[axis]) / ray.direction[axis];
                if crossing > t {
                    next = next.min(crossing);
                    break;
                }
                line += rate.signum();
            }
        }
        next
    }

    fn texel(&self, i: f64, j: f64) -> f64 {
        let fold = |i: f64, n: usize| -> usize {
            let n = n as f64;
            let at = match self.wrap {
                Wrap::Repeat => i - (i / n).floor() * n,
                Wrap::Clamp => i.max(0.0).min(n - 1.0),
                Wrap::Mirror => {
                    let m = i - (i / (2.0 * n)).floor() * 2.0 * n;
                    if m < n { m } else { 2.0 * n - 1.0 - m }
                }
            };
            at as usize
        };
        f64::from(self.texels[fold(j, self.height) * self.width + fold(i, self.width)])
    }

    fn patch(&self, i: f64, j: f64) -> Patch {
        let corners =
            [self.texel(i, j), self.texel(i + 1.0, j), self.texel(i, j + 1.0), self.texel(i + 1.0, j + 1.0)];
        Patch { at: [i, j], corners }
    }
}

struct Ray {
    origin: [f64; 3],
    direction: [f64; 3],
}

impl Ray {
    fn z(&self, t: f64) -> f64 {
        self.origin[2] + t * self.direction[2]
    }
}

/// A bilinear cell.
struct Patch {
    at: [f64; 2],
    corners: [f64; 4],
}

impl Patch {
    fn height(&self, x: f64, y: f64) -> f64 {
        let (x, y) = (x - self.at[0], y - self.at[1]);
        let [a, b, c, d] = self.corners;
        (a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y
    }

    /// Height change a texel along x and y.
    fn slopes(&self, x: f64, y: f64) -> [f64; 2] {
        let (x, y) = (x - self.at[0], y - self.at[1]);
        let [a, b, c, d] = self.corners;
        [(b - a) * (1.0 - y) + (d - c) * y, (c - a) * (1.0 - x) + (d - b) * x]
    }
}

/// Where in the interval a quadratic is least, and its value there.
fn lowest_of(gap: &impl Fn(f64) -> f64, start: f64, end: f64) -> (f64, f64) {
    let (a, b, c) = (gap(start), gap(0.5 * (start + end)), gap(end));
    let bend = a - 2.0 * b + c;
    let mut best = if a <= c { (start, a) } else { (end, c) };
    if bend > 0.0 {
        let share = (0.5 + (a - c) / (4.0 * bend)).clamp(0.0, 1.0);
        let t = start + share * (end - start);
        let value = gap(t);
        if value < best.1 {
            best = (t, value);
        }
    }
    best
}

/// The first point of the interval at which a quadratic is not above zero, by bisection.
fn first_root(gap: &impl Fn(f64) -> f64, start: f64, end: f64) -> Option<f64> {
    if gap(start) <= 0.0 {
        return Some(start);
    }
    let (lowest, least) = lowest_of(gap, start, end);
    if least > 0.0 {
        return None;
    }
    let (mut above, mut below) = (start, lowest);
    for _ in 0..80 {
        let middle = 0.5 * (above + below);
        if gap(middle) > 0.0 {
            above = middle;
        } else {
            below = middle;
        }
    }
    Some(below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Random;
    use heightfield::{HeightField, oracle};

    fn noise(seed: u64) -> Vec<f32> {
        let mut random = Random::new(seed, 0);
        (0..24 * 16).map(|_| random.unit() as f32).collect()
    }

    #[test]
    fn agrees_with_the_other_reference_everywhere() {
        let texels = noise(2);
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let field = HeightField::new(&texels, 24, 16, wrap).unwrap();
            let judge = Judge { texels: &texels, width: 24, height: 16, wrap };
            let mut random = Random::new(4, 0);
            for _ in 0..2000 {
                let origin = [random.unit() * 9.0 - 4.0, random.unit() * 9.0 - 4.0, 1.0];
                let direction = [random.unit() - 0.5, random.unit() - 0.5, -random.unit() - 0.01];
                let truth = oracle::exact(&field, origin, direction).t;
                let verdict = judge.verdict(&Ray { origin, direction }, truth);
                assert!((verdict.t - truth).abs() < 1e-9, "{verdict:?} {truth}");
                assert!(verdict.gap.abs() < 1e-9 && verdict.skipped < 1e-9, "{verdict:?}");
            }
        }
    }

    #[test]
    fn early_late_and_skipping_hits_are_told_apart() {
        // A ridge of height 1 along v at column 8 of 16.
        let texels: Vec<f32> = (0..256).map(|i| if i % 16 == 8 { 1.0 } else { 0.0 }).collect();
        let judge = Judge { texels: &texels, width: 16, height: 16, wrap: Wrap::Repeat };
        // One texel along u a unit of t; meets the ridge's face half way up, and its other side.
        let ray = Ray { origin: [2.0 / 16.0, 0.3, 0.52], direction: [1.0 / 16.0, 0.0, -0.001] };
        let hit = judge.verdict(&ray, 0.0).t;
        assert!((hit - 6.0).abs() < 0.05, "{hit}");
        let of = |t: f64| judge.verdict(&ray, t);
        assert!(of(hit).gap.abs() < 1e-9 && of(hit).skipped < 1e-9);
        assert!(of(hit - 0.2).gap > 0.1 && of(hit - 0.2).skipped == 0.0);
        assert!(of(hit + 0.2).gap < -0.1 && of(hit + 0.2).skipped < 1e-9, "late, but in the same dive");
        assert!((of(hit + 3.0).skipped - 0.49).abs() < 0.02, "{:?}", of(hit + 3.0));
        assert!(of(f64::INFINITY).skipped > 0.47, "and every ridge behind it");
    }

    #[test]
    fn a_ray_of_too_many_cells_is_given_up() {
        let judge = Judge { texels: &[0.0], width: 1, height: 1, wrap: Wrap::Repeat };
        let ray = Ray { origin: [0.2, 0.3, 1.0], direction: [1e9, 0.0, -1.0] };
        assert!(judge.verdict(&ray, 0.5).t.is_nan());
        let upwards = Ray { origin: [0.2, 0.3, 0.0], direction: [0.0, 0.0, 1.0] };
        assert!(judge.verdict(&upwards, 0.5).t.is_nan());
    }
}
