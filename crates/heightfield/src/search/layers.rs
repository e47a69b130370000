//! Walking a segment in equal layers; shared by every search that starts with linear steps.
//! The twin of `shaders_wgsl/lib/layers.wgsl`.

use glam::Vec3;

use crate::HeightField;

/// The two samples between which the segment first goes below the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bracket {
    /// Whether any sample lay below the surface.
    pub found: bool,
    /// Last position above the surface.
    pub above: f32,
    /// First position on or below it.
    pub below: f32,
    /// Ray height minus surface height at `above`, positive.
    pub gap_above: f32,
    /// The same at `below`, not positive.
    pub gap_below: f32,
    /// Height reads.
    pub steps: u32,
}

/// Ray height minus surface height at `tau`.
#[inline(always)]
pub fn gap_at(field: &HeightField, start: Vec3, delta: Vec3, tau: f32) -> f32 {
    let p = start + delta * tau;
    p.z - field.sample(p.x, p.y)
}

/// Samples the segment at the end of each of `layers` equal layers until one lies on or below the
/// surface. The start is not sampled: on the lid nothing is above it. The end of a segment that goes
/// down is the floor, which counts as below whatever the rounding.
#[inline(always)]
pub fn first_below(field: &HeightField, start: Vec3, delta: Vec3, layers: u32) -> Bracket {
    let mut above = 0.0;
    let mut gap_above = 0.0;
    for i in 1..=layers {
        let tau = i as f32 / layers as f32;
        let gap = gap_at(field, start, delta, tau);
        if gap <= 0.0 || (i == layers && delta.z < 0.0) {
            if i == 1 {
                gap_above = gap_at(field, start, delta, 0.0).max(0.0);
            }
            return Bracket { found: true, above, below: tau, gap_above, gap_below: gap.min(0.0), steps: i };
        }
        above = tau;
        gap_above = gap;
    }
    Bracket { found: false, above, below: 1.0, gap_above, gap_below: gap_above, steps: layers }
}

/// Whether any sample of a segment that leaves the surface lies strictly below it.
///
/// A start below the surface is lifted onto it: searches that stop at a layer return hits up to a layer
/// too deep, and from there a surface would shadow itself.
#[inline(always)]
pub fn any_below(field: &HeightField, start: Vec3, delta: Vec3, layers: u32) -> bool {
    let lift = Vec3::Z * (field.sample(start.x, start.y) - start.z).max(0.0);
    let (start, delta) = (start + lift, delta - lift);
    (1..=layers).any(|i| gap_at(field, start, delta, i as f32 / layers as f32) < 0.0)
}

/// Where the chord between the two samples of a bracket reaches zero.
#[inline(always)]
pub fn secant(above: f32, below: f32, gap_above: f32, gap_below: f32) -> f32 {
    let drop = gap_above - gap_below;
    if drop > 0.0 { above + (below - above) * (gap_above / drop) } else { below }
}

/// Layers for a view at `cos_theta`: `most` at grazing angles, `least` head-on, changing linearly.
#[inline(always)]
pub fn linear_layers(least: u32, most: u32, cos_theta: f32) -> u32 {
    let (least, most) = (least as f32, most as f32);
    (most + (least - most) * cos_theta.clamp(0.0, 1.0)).ceil().max(1.0) as u32
}

/// The same, changing by equal factors: `most * (least / most)^cos_theta`.
#[inline(always)]
pub fn exponential_layers(least: u32, most: u32, cos_theta: f32) -> u32 {
    let (least, most) = (least as f32, most as f32);
    (most * (least / most).powf(cos_theta.clamp(0.0, 1.0))).ceil().max(1.0) as u32
}
