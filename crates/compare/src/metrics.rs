//! How wrong a technique is, ray by ray and in sum.
//!
//! * **uv error**: distance between reported and true hit, in texels of the height map.
//! * **depth error**: difference of heights, 0..1 (that is, over the relief's scale).
//! * **normal error**: angle between the normals at both hits, degrees, in mesh units.
//! * **miss**: the true first hit was skipped. The ray went below the surface by more than
//!   [`DIVE_DEPTH`](crate::dive::DIVE_DEPTH) and came up again before the reported hit, or nothing was
//!   reported. A hit that is merely late but in the same dive is no miss; its uv error says how late.
//! * **false hit**: reported in the air: short of the true one by more than [`FALSE_HIT_TEXELS`], where
//!   the ray was above the surface by more than [`FALSE_HIT_GAP`].
//! * **unconverged**: the search gave up.
//!
//! uv, depth and normal statistics are over rays with a reported hit; misses, gaps and the rest are
//! over all rays that truly hit. Each ray also knows the [`Region`] of the relief that its true hit lies in.

use heightfield::{HeightField, Status, Wrap};
use rayon::prelude::*;

use crate::dive::end_of_first_dive;
use crate::region::Region;
use crate::statistics::{percentile, percentile_bound, share_bound};
use crate::{CompareError, Rays, Reference, reference};

/// Height above the surface (0..1) from which a hit short of the true one is a false hit: 1 % of the
/// relief. Nearer ones are the usual imprecision of a search and show as uv error.
pub const FALSE_HIT_GAP: f64 = 0.01;

/// Texels short of the true hit from which a hit in the air is a false one: beside a steep wall a small
/// part of a texel is a large part of the relief.
pub const FALSE_HIT_TEXELS: f64 = 1.0;

/// Slack when a reported `t` is held against the end of the dive, relative to `t`: some `f32` steps.
const T_SLACK: f64 = 1.0e-6;

/// What a technique reported for a set of rays.
#[derive(Debug, Clone, Copy)]
pub struct Reported<'a> {
    /// `N * 2` hit positions, in any tile.
    pub uv: &'a [f32],
    /// Heights, 0..1.
    pub z: &'a [f32],
    /// Ray parameters; worked out from `z` where absent.
    pub t: Option<&'a [f32]>,
    /// `N * 3` unit normals in texture space, `(-dh/du, -dh/dv, 1)` normalised, as the march gives them.
    pub normal: Option<&'a [f32]>,
    /// [`Status`] as numbers; all hits where absent.
    pub status: Option<&'a [u8]>,
    /// Height reads.
    pub steps: Option<&'a [u32]>,
}

/// What became of a ray, beyond its errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The true hit was found, near or far.
    Found,
    /// The true hit was skipped, or no hit was reported.
    Missed,
    /// Reported above the surface, short of the true hit.
    FalseHit,
    /// The search gave up.
    Unconverged,
    /// A reported number is NaN or infinite.
    NotFinite,
}

/// Errors ray by ray. Where there is no reported hit the errors are NaN.
#[derive(Debug, Clone, Default)]
pub struct RayErrors {
    /// Distance in texels.
    pub uv_texels: Vec<f32>,
    /// Height difference, 0..1.
    pub depth: Vec<f32>,
    /// Angle between normals in degrees; NaN without normals.
    pub normal_deg: Vec<f32>,
    /// What became of the ray.
    pub outcome: Vec<Outcome>,
    /// Where the true hit lies.
    pub region: Vec<Region>,
    /// Height reads; 0 without.
    pub steps: Vec<u32>,
    /// By [`Region`], shadow rays tested and how many of them came out wrong, if the technique casts
    /// shadows.
    pub shadows: Option<[(usize, usize); Region::ALL.len()]>,
}

impl RayErrors {
    /// Measures what was reported against the reference. Rays that truly hit nothing are left out.
    ///
    /// # Errors
    /// [`CompareError::Length`] when an array does not fit the rays.
    pub fn measure(
        field: &HeightField,
        rays: &Rays,
        reference: &Reference,
        reported: &Reported<'_>,
    ) -> Result<Self, CompareError> {
        let n = rays.len();
        reported.check(n)?;
        let rows: Vec<_> = (0..n)
            .into_par_iter()
            .filter(|&i| reference.truths[i].hit)
            .map(|i| measure_ray(field, rays, reference, reported, i))
            .collect();
        let mut errors = Self::default();
        for (i, row) in (0..n).filter(|&i| reference.truths[i].hit).zip(rows) {
            errors.uv_texels.push(row.uv_texels as f32);
            errors.depth.push(row.depth as f32);
            errors.normal_deg.push(row.normal_deg as f32);
            errors.outcome.push(row.outcome);
            errors.region.push(reference.regions[i]);
            errors.steps.push(reported.steps.map_or(0, |steps| steps[i]));
        }
        Ok(errors)
    }

    /// The errors of some rows, by their place in the arrays; shadow counts are left out.
    pub fn select(&self, keep: impl Fn(usize) -> bool) -> Self {
        let mut part = Self::default();
        for i in (0..self.outcome.len()).filter(|&i| keep(i)) {
            part.uv_texels.push(self.uv_texels[i]);
            part.depth.push(self.depth[i]);
            part.normal_deg.push(self.normal_deg[i]);
            part.outcome.push(self.outcome[i]);
            part.region.push(self.region[i]);
            part.steps.push(self.steps[i]);
        }
        part
    }
}

impl Reported<'_> {
    fn check(&self, rays: usize) -> Result<(), CompareError> {
        let expect = |what, expected: usize, got: usize| {
            if expected == got { Ok(()) } else { Err(CompareError::Length { what, rays, expected, got }) }
        };
        expect("uv", 2 * rays, self.uv.len())?;
        expect("z", rays, self.z.len())?;
        expect("t", rays, self.t.map_or(rays, <[f32]>::len))?;
        expect("normal", 3 * rays, self.normal.map_or(3 * rays, <[f32]>::len))?;
        expect("status", rays, self.status.map_or(rays, <[u8]>::len))?;
        expect("steps", rays, self.steps.map_or(rays, <[u32]>::len))
    }
}

struct RayRow {
    uv_texels: f64,
    depth: f64,
    normal_deg: f64,
    outcome: Outcome,
}

impl RayRow {
    fn without_hit(outcome: Outcome) -> Self {
        Self { uv_texels: f64::NAN, depth: f64::NAN, normal_deg: f64::NAN, outcome }
    }
}

fn measure_ray(
    field: &HeightField,
    rays: &Rays,
    reference: &Reference,
    reported: &Reported<'_>,
    i: usize,
) -> RayRow {
    let truth = &reference.truths[i];
    let status = reported.status.map_or(Status::Hit as u8, |status| status[i]);
    if status == Status::Unconverged as u8 {
        return RayRow::without_hit(Outcome::Unconverged);
    }
    if status != Status::Hit as u8 {
        return RayRow::without_hit(Outcome::Missed);
    }
    let z = f64::from(reported.z[i]);
    let origin = rays.origin(i);
    let direction = rays.direction(i);
    let t = reported.t.map_or((z - origin[2]) / direction[2], |t| f64::from(t[i]));
    let uv = [f64::from(reported.uv[2 * i]), f64::from(reported.uv[2 * i + 1])];
    let normal = reported.normal.map(|n| [n[3 * i], n[3 * i + 1], n[3 * i + 2]].map(f64::from));
    let finite = [t, z, uv[0], uv[1]].into_iter().chain(normal.into_iter().flatten()).all(f64::is_finite);
    if !finite {
        return RayRow::without_hit(Outcome::NotFinite);
    }
    let at = rays.at(i, t);
    let size = [field.width() as f64, field.height() as f64];
    let off: [f64; 2] = std::array::from_fn(|axis| {
        (same_tile(field.wrap(), uv[axis], at[axis]) - truth.uv[axis]) * size[axis]
    });
    let uv_texels = off[0].hypot(off[1]);
    let slack = T_SLACK * truth.t.abs().max(t.abs());
    let skipped = |t_hit| end_of_first_dive(field, origin, direction, t_hit, t) < t - slack;
    let outcome = if t > truth.t + slack && skipped(truth.t) {
        Outcome::Missed
    } else if t < truth.t
        && uv_texels > FALSE_HIT_TEXELS
        && at[2] - field.height_at(at[0], at[1]) > FALSE_HIT_GAP
    {
        Outcome::FalseHit
    } else {
        Outcome::Found
    };
    RayRow {
        uv_texels,
        depth: (z - truth.z).abs(),
        normal_deg: normal.map_or(f64::NAN, |[x, y, z]| {
            angle_deg(reference::normal(field.extent(), [-x / z, -y / z]), truth.normal)
        }),
        outcome,
    }
}

/// Moves a position by whole periods of the map next to `near`.
fn same_tile(wrap: Wrap, position: f64, near: f64) -> f64 {
    let period = match wrap {
        Wrap::Repeat => 1.0,
        Wrap::Mirror => 2.0,
        Wrap::Clamp => return position,
    };
    position + ((near - position) / period).round() * period
}

/// Angle between two directions, exact for small angles too (Kahan 2006).
fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (glam::DVec3::from(a).normalize_or_zero(), glam::DVec3::from(b).normalize_or_zero());
    (2.0 * (a - b).length().atan2((a + b).length())).to_degrees()
}

/// Errors in sum. Rates are shares of the rays, 0..1; statistics are 0 when no ray has a hit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Metrics {
    /// Rays that truly hit.
    pub rays: usize,
    /// Median hit distance in texels.
    pub uv_error_median_texels: f64,
    /// 99th percentile.
    pub uv_error_p99_texels: f64,
    /// What the 99th percentile of all rays of this kind does not exceed, with 95 % confidence; `None` for
    /// too few rays to tell.
    pub uv_error_p99_bound_texels: Option<f64>,
    /// Largest.
    pub uv_error_max_texels: f64,
    /// Share of rays more than a texel off; rays without a hit count as such.
    pub share_above_1_texel: f64,
    /// 99th percentile of the height difference, 0..1.
    pub depth_error_p99: f64,
    /// Largest height difference.
    pub depth_error_max: f64,
    /// Median angle between normals, degrees; `None` without normals.
    pub normal_error_median_deg: Option<f64>,
    /// 99th percentile.
    pub normal_error_p99_deg: Option<f64>,
    /// Share of rays whose true hit was skipped.
    pub miss_rate: f64,
    /// Share reported above the surface, short of the true hit.
    pub false_hit_rate: f64,
    /// Share of rays on which the search gave up.
    pub unconverged_rate: f64,
    /// Rays with a NaN or an infinity in their hit.
    pub nan_count: usize,
    /// Share of shadow rays with the wrong answer; `None` when the technique casts none.
    pub shadow_error_rate: Option<f64>,
    /// Mean height reads of a ray.
    pub steps_mean: f64,
}

impl Metrics {
    /// Sums up one or several sets of rays as if they were one.
    pub fn of(parts: &[&RayErrors]) -> Self {
        Self::over(parts, None)
    }

    /// The same for the rays that truly hit in one region.
    pub fn of_region(parts: &[&RayErrors], region: Region) -> Self {
        Self::over(parts, Some(region))
    }

    fn over(parts: &[&RayErrors], wanted: Option<Region>) -> Self {
        let counts = |part: &RayErrors, i: usize| wanted.is_none_or(|wanted| part.region[i] == wanted);
        let all = |pick: fn(&RayErrors) -> &Vec<f32>| -> Vec<f32> {
            parts
                .iter()
                .flat_map(|&part| pick(part).iter().enumerate().filter(move |(i, _)| counts(part, *i)))
                .map(|(_, &x)| x)
                .filter(|x| !x.is_nan())
                .collect()
        };
        let mut outcomes = [0_usize; 5];
        let mut steps = 0_u64;
        for part in parts {
            for i in (0..part.outcome.len()).filter(|&i| counts(part, i)) {
                outcomes[part.outcome[i] as usize] += 1;
                steps += u64::from(part.steps[i]);
            }
        }
        let rays: usize = outcomes.iter().sum();
        let share = |n: usize| if rays == 0 { 0.0 } else { n as f64 / rays as f64 };
        let rate = |which: Outcome| share(outcomes[which as usize]);
        let mut uv = all(|part| &part.uv_texels);
        let mut depth = all(|part| &part.depth);
        let mut angle = all(|part| &part.normal_deg);
        let above = uv.iter().filter(|&&e| e > 1.0).count() + rays - uv.len();
        let regions = wanted.map_or(0..Region::ALL.len(), |region| region as usize..region as usize + 1);
        let shadows: Option<(usize, usize)> = parts.iter().try_fold((0, 0), |sum, part| {
            let tested = part.shadows.as_ref()?;
            Some(tested[regions.clone()].iter().fold(sum, |(n, wrong), (m, w)| (n + m, wrong + w)))
        });
        Self {
            rays,
            uv_error_median_texels: percentile(&mut uv, 0.5),
            uv_error_p99_texels: percentile(&mut uv, 0.99),
            uv_error_p99_bound_texels: percentile_bound(&mut uv, 0.99),
            uv_error_max_texels: percentile(&mut uv, 1.0),
            share_above_1_texel: share(above),
            depth_error_p99: percentile(&mut depth, 0.99),
            depth_error_max: percentile(&mut depth, 1.0),
            normal_error_median_deg: (!angle.is_empty()).then(|| percentile(&mut angle, 0.5)),
            normal_error_p99_deg: (!angle.is_empty()).then(|| percentile(&mut angle, 0.99)),
            miss_rate: rate(Outcome::Missed),
            false_hit_rate: rate(Outcome::FalseHit),
            unconverged_rate: rate(Outcome::Unconverged),
            nan_count: outcomes[Outcome::NotFinite as usize],
            shadow_error_rate: shadows.map(|(n, wrong)| if n == 0 { 0.0 } else { wrong as f64 / n as f64 }),
            steps_mean: if rays == 0 { 0.0 } else { steps as f64 / rays as f64 },
        }
    }

    /// Share of rays that have no right hit at all: missed, in the air, given up or not finite.
    pub fn failure_rate(&self) -> f64 {
        let nan = if self.rays == 0 { 0.0 } else { self.nan_count as f64 / self.rays as f64 };
        self.miss_rate + self.false_hit_rate + self.unconverged_rate + nan
    }

    /// What the failure rate of all rays of this kind does not exceed, with 95 % confidence.
    pub fn failure_rate_bound(&self) -> f64 {
        share_bound(self.failure_rate(), self.rays)
    }
}
