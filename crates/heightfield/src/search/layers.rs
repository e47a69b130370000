//! Walking a segment in equal layers; shared by every search that starts with linear steps.
//! The twin of `shaders_wgsl/lib/layers.wgsl`.

use crate::lanes::Lanes;
use crate::wide::{Heights, Segments};

/// The two samples between which each segment first goes below the surface.
#[derive(Clone, Copy)]
pub struct Brackets<L: Lanes> {
    /// Whether any sample lay below the surface.
    pub found: L::M,
    /// Last position above the surface.
    pub above: L::F,
    /// First position on or below it.
    pub below: L::F,
    /// Ray height minus surface height at `above`, positive.
    pub gap_above: L::F,
    /// The same at `below`, not positive.
    pub gap_below: L::F,
    /// Height reads.
    pub steps: L::I,
}

/// How many layers each segment is cut into.
#[derive(Clone, Copy)]
pub struct Layers<L: Lanes> {
    count: L::F,
    most: u32,
    uniform: bool,
}

impl<L: Lanes> Layers<L> {
    /// As many for all.
    #[inline(always)]
    pub fn uniform(count: u32) -> Self {
        Self { count: L::splat(count as f32), most: count, uniform: true }
    }

    /// Whole numbers, one a lane.
    #[inline(always)]
    fn varying(count: L::F) -> Self {
        Self { count, most: L::largest(count) as u32, uniform: false }
    }

    /// For views at `cos_theta`: `most` at grazing angles, `least` head-on, changing linearly.
    #[inline(always)]
    pub fn linear(least: u32, most: u32, cos_theta: L::F) -> Self {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let (least, most) = (L::splat(least as f32), L::splat(most as f32));
        let count = most + (least - most) * L::max(L::min(cos_theta, one), zero);
        Self::varying(L::max(ceiling::<L>(count), one))
    }

    /// The same, changing by equal factors: `most * (least / most)^cos_theta`.
    #[inline(always)]
    pub fn exponential(least: u32, most: u32, cos_theta: L::F) -> Self {
        let (least, most) = (least as f32, most as f32);
        let mut factor = [0.0_f32; 16];
        L::store(cos_theta, &mut factor);
        for factor in &mut factor[..L::WIDTH] {
            *factor = (least / most).powf(factor.clamp(0.0, 1.0));
        }
        let count = L::splat(most) * L::load(&factor);
        Self::varying(L::max(ceiling::<L>(count), L::splat(1.0)))
    }

    /// The end of layer `i`, counted from 1, along the segment.
    #[inline(always)]
    fn end(&self, i: u32) -> L::F {
        if self.uniform { L::splat(i as f32 / self.most as f32) } else { L::splat(i as f32) / self.count }
    }
}

#[inline(always)]
fn ceiling<L: Lanes>(x: L::F) -> L::F {
    let zero = L::splat(0.0);
    zero - L::floor(zero - x)
}

/// Samples each segment at the end of each of its layers until one lies on or below the surface. The
/// start is not sampled: on the lid nothing is above it. The end of a segment that goes down is the
/// floor, which counts as below whatever the rounding.
#[inline(always)]
pub fn first_below<L: Lanes>(heights: &Heights<'_, L>, rays: &Segments<L>, layers: Layers<L>) -> Brackets<L> {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let down = L::lt(rays.delta[2], zero);
    let mut walking = L::first(L::WIDTH);
    let mut bracket = Brackets {
        found: L::first(0),
        above: zero,
        below: one,
        gap_above: zero,
        gap_below: zero,
        steps: L::splat_int(0),
    };
    for i in 1..=layers.most {
        let tau = layers.end(i);
        let gap = rays.gap_at(heights, tau);
        let last = L::le(layers.count, L::splat(i as f32));
        let below = walking & (L::le(gap, zero) | (last & down));
        bracket.steps = L::select_int(walking, L::splat_int(i as i32), bracket.steps);
        bracket.found = bracket.found | below;
        bracket.below = L::select(below, tau, bracket.below);
        bracket.gap_below = L::select(below, L::min(gap, zero), bracket.gap_below);
        walking = walking & !below;
        bracket.above = L::select(walking, tau, bracket.above);
        bracket.gap_above = L::select(walking, gap, bracket.gap_above);
        walking = walking & !last;
        if !L::any(walking) {
            break;
        }
    }
    // Who is below at the end of the first layer has nothing above but the start.
    let first = bracket.found & L::le(bracket.above, zero);
    if L::any(first) {
        let gap = L::max(rays.gap_at(heights, zero), zero);
        bracket.gap_above = L::select(first, gap, bracket.gap_above);
    }
    bracket
}

/// Whether any sample of a segment that leaves the surface lies strictly below it.
///
/// Starts below the surface are [`lifted`].
#[inline(always)]
pub fn any_below<L: Lanes>(heights: &Heights<'_, L>, rays: &Segments<L>, layers: Layers<L>) -> L::M {
    let zero = L::splat(0.0);
    let rays = lifted(heights, rays);
    let mut blocked = L::first(0);
    for i in 1..=layers.most {
        let counts = L::le(L::splat(i as f32), layers.count);
        blocked = blocked | (counts & L::lt(rays.gap_at(heights, layers.end(i)), zero));
        if !L::any(!blocked & L::first(L::WIDTH)) {
            break;
        }
    }
    blocked
}

/// The segments, starts below the surface lifted onto it: searches return hits up to a layer too deep, or what rounding
/// takes, and from there a surface would shadow itself.
#[inline(always)]
pub fn lifted<L: Lanes>(heights: &Heights<'_, L>, rays: &Segments<L>) -> Segments<L> {
    let mut rays = *rays;
    let lift = L::max(heights.sample(rays.start[0], rays.start[1]) - rays.start[2], L::splat(0.0));
    rays.start[2] = rays.start[2] + lift;
    rays.delta[2] = rays.delta[2] - lift;
    rays
}

/// Where the chord between the two samples of a bracket reaches zero.
#[inline(always)]
pub fn secant<L: Lanes>(above: L::F, below: L::F, gap_above: L::F, gap_below: L::F) -> L::F {
    let drop = gap_above - gap_below;
    let chord = above + (below - above) * (gap_above / drop);
    L::select(L::lt(L::splat(0.0), drop), chord, below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Portable;

    #[test]
    fn layers_follow_the_view_angle() {
        type One = Portable<1>;
        let linear = |cos_theta| Layers::<One>::linear(8, 64, One::splat(cos_theta)).most;
        assert_eq!((linear(1.0), linear(0.0), linear(0.5)), (8, 64, 36));
        let exponential = |cos_theta| Layers::<One>::exponential(8, 32, One::splat(cos_theta)).most;
        assert_eq!((exponential(1.0), exponential(0.0), exponential(0.5)), (8, 32, 16));
    }
}
