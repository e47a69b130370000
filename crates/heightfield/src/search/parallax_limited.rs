//! Parallax mapping with offset limiting: the offset is not divided by the cosine of the view angle, so
//! it never exceeds the height. Flattens the relief at grazing angles.
//!
//! Terry Welsh, Parallax Mapping with Offset Limiting: A Per-Pixel Approximation of Uneven Surfaces,
//! 2004.

use crate::lanes::Lanes;
use crate::wide::{Findings, Heights, Segments, WideSearch};

technique! {
    /// Parameters of [`search`](WideSearch::search) as described above.
    ParallaxLimited = "parallax_limited", reads Heights, casts_shadows false,
    summary "one step, offset limited at grazing angles",
    source "Welsh 2004",
    parameters {}
}

impl WideSearch for ParallaxLimited {
    #[inline(always)]
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L> {
        let (zero, dz) = (L::splat(0.0), rays.delta[2]);
        let base = L::splat(heights.field.extent().base);
        // Where the ray passes the mesh surface.
        let tau = (base - rays.start[2]) / dz;
        let height = heights.sample(rays.start[0] + rays.delta[0] * tau, rays.start[1] + rays.delta[1] * tau);
        let level = base + (height - base) * rays.cos_theta;
        let tau = (level - rays.start[2]) / dz;
        let hit = L::lt(dz, zero);
        let steps = L::select_int(hit, L::splat_int(1), L::splat_int(0));
        Findings { tau: L::max(tau, zero), hit, steps }
    }

    #[inline(always)]
    fn occluded<L: Lanes>(&self, _heights: &Heights<'_, L>, _rays: &Segments<L>) -> L::M {
        L::first(0)
    }
}
