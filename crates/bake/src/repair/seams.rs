//! Does a map tile? The step across its edge against the steps inside.
//!
//! For each axis [`seam`] compares the mean step between the last and the first texel with the mean
//! step between neighbours everywhere (`ratio`) and beside the seam (`local`), and the mean bend
//! (second difference) of the two texels at the seam with those inside (`bend_ratio`). A seam on a
//! feature, such as a mortar joint at the edge, steps more than the mean but no more than its
//! neighbours or than other joints do; a seam in flat surroundings may step little and still be seen.

use heightfield::HeightField;
use rayon::prelude::*;

/// A step beyond twice those around it does not tile.
const LIMIT: f64 = 2.0;
/// Seams and creases are in the highest hundredth of all lines.
const RANK: f64 = 0.99;

/// What the edge of a map looks like when it repeats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// As any place inside.
    Tiles,
    /// Heights meet, slopes do not.
    Crease,
    /// A step in height.
    Seam,
}

impl Verdict {
    /// `"tiles"`, `"crease"` or `"seam"`.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Tiles => "tiles",
            Verdict::Crease => "crease",
            Verdict::Seam => "seam",
        }
    }
}

/// The edge across one axis. Steps and bends are means of absolute differences in height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seam {
    /// Step from the last texel to the first.
    pub step: f64,
    /// Step between neighbours inside.
    pub inner_step: f64,
    /// `step / inner_step`; 0 for a map without steps.
    pub ratio: f64,
    /// `step` over the mean step on both sides of the seam.
    pub local: f64,
    /// Share of the lines between texels inside that step less than the seam.
    pub rank: f64,
    /// Bend of the two texels at the seam.
    pub bend: f64,
    /// Bend of the texels inside.
    pub inner_bend: f64,
    /// `bend / inner_bend`; 0 for a map without bends.
    pub bend_ratio: f64,
    /// Share of the lines of texels inside that bend less than those at the seam.
    pub bend_rank: f64,
    /// The row (for the seam in x) or column with the largest step, and that step.
    pub worst: (usize, f64),
    /// What follows.
    pub verdict: Verdict,
}

/// A quotient in which nothing over nothing is nothing.
fn over(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

fn mean(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { values.iter().sum::<f64>() / values.len() as f64 }
}

fn rank(values: &[f64], of: f64) -> f64 {
    let below = values.iter().filter(|&&value| value < of).count();
    if values.is_empty() { 0.0 } else { below as f64 / values.len() as f64 }
}

/// The seam in x (axis 0: last column to first) or y (axis 1: last row to first) of the map's texels,
/// whatever its wrap.
pub fn seam(field: &HeightField, axis: usize) -> Seam {
    let (width, height) = (field.width(), field.height());
    let texels = field.texels();
    // `line` counts along the axis, `at` along the seam.
    let (lines, along) = if axis == 0 { (width, height) } else { (height, width) };
    let texel = |line: usize, at: usize| {
        f64::from(if axis == 0 { texels[at * width + line] } else { texels[line * width + at] })
    };
    let line_mean = |f: &(dyn Fn(usize) -> f64 + Sync)| (0..along).map(f).sum::<f64>() / along as f64;
    let step = |from: usize, to: usize| line_mean(&|at| (texel(to, at) - texel(from, at)).abs());
    let bend = |a: usize, b: usize, c: usize| {
        line_mean(&|at| (texel(a, at) - 2.0 * texel(b, at) + texel(c, at)).abs())
    };
    let steps: Vec<f64> = (1..lines).into_par_iter().map(|line| step(line - 1, line)).collect();
    let bends: Vec<f64> = (2..lines).into_par_iter().map(|line| bend(line - 2, line - 1, line)).collect();
    let last = lines - 1;
    let (seam_step, inner_step) = (step(last, 0), mean(&steps));
    let beside = steps.first().zip(steps.last()).map_or(0.0, |(a, b)| 0.5 * (a + b));
    let second = last.min(1);
    let seam_bend = 0.5 * (bend(last, 0, second) + bend(last - second, last, 0));
    let inner_bend = mean(&bends);
    let worst = (0..along)
        .map(|at| (at, (texel(0, at) - texel(last, at)).abs()))
        .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
        .unwrap_or((0, 0.0));
    let mut seam = Seam {
        step: seam_step,
        inner_step,
        ratio: over(seam_step, inner_step),
        local: over(seam_step, beside),
        rank: rank(&steps, seam_step),
        bend: seam_bend,
        inner_bend,
        bend_ratio: over(seam_bend, inner_bend),
        bend_rank: rank(&bends, seam_bend),
        worst,
        verdict: Verdict::Tiles,
    };
    // Fewer than four lines say nothing about what is usual.
    if lines >= 4 {
        seam.verdict = if seam.local > LIMIT && seam.ratio.max(seam.bend_ratio) > LIMIT {
            if seam.rank.max(seam.bend_rank) >= RANK { Verdict::Seam } else { Verdict::Tiles }
        } else if seam.bend_ratio > LIMIT && seam.bend_rank >= RANK {
            Verdict::Crease
        } else {
            Verdict::Tiles
        };
    }
    seam
}
