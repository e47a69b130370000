//! What is said about a bake when it is done.

use super::band::{Job, Tally};
use super::options::DetailReport;

/// Share of missed rays above which the caller is told.
const MISSES: f64 = 1e-3;
/// Share of samples claimed by several charts above which the caller is told.
const OVERLAPS: f64 = 1e-4;

fn percent(part: f64) -> String {
    format!("{:.*} %", if part < 0.01 { 2 } else { 1 }, part * 100.0)
}

/// The report of a bake.
pub(super) fn report(job: &Job<'_>, tally: &Tally) -> DetailReport {
    let Tally { met, texels, rays, missed, averted, empty, overlapping } = *tally;
    let (front, rear) = (job.ground.front, job.ground.rear);
    let mut warnings = Vec::new();
    let layout = &job.layout;
    if layout.degenerate > 0 {
        warnings.push(format!("{} triangles have UVs without area and get no texels", layout.degenerate));
    }
    if layout.wrapped > 0 {
        warnings.push(format!(
            "{} triangles reach beyond UV 0..1; they are moved in where no other chart lies",
            layout.wrapped
        ));
    }
    if layout.endless > 0 {
        warnings.push(format!(
            "{} triangles reach over more than 64 tiles of the texture; they are left out",
            layout.endless
        ));
    }
    if rays == 0 {
        warnings.push("no chart covers a texel; the maps hold nothing".to_owned());
    }
    let of_rays = |part: u64| part as f64 / rays.max(1) as f64;
    if of_rays(overlapping) > OVERLAPS {
        warnings.push(format!(
            "charts overlap on {} of the samples; there the first triangle is baked",
            percent(of_rays(overlapping))
        ));
    }
    let lost = missed - averted;
    if of_rays(lost) > MISSES {
        warnings.push(format!(
            "{} of the rays met nothing between {front:.6} above the plain mesh and {rear:.6} below it; \
             {empty} texels show the plain surface. Larger front or rear distances, or a cage, may help",
            percent(of_rays(lost))
        ));
    }
    if of_rays(averted) > MISSES {
        warnings.push(format!(
            "{} of the rays met only triangles seen from behind: the detailed mesh is inside out, or rays \
             start below its surface",
            percent(of_rays(averted))
        ));
    }
    DetailReport {
        front,
        rear,
        met: (met.0 <= met.1).then_some(met),
        texels,
        rays,
        missed,
        averted,
        empty,
        overlapping,
        warnings,
    }
}
