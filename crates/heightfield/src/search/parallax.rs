//! Parallax mapping: one height read where the ray meets the mesh surface (`z = base`), then the ray is
//! moved to that height. No search: wrong wherever the height changes along the offset.
//!
//! Tomomichi Kaneko et al., Detailed Shape Representation with Parallax Mapping, ICAT 2001.

use crate::lanes::Lanes;
use crate::wide::{Findings, Heights, Segments, WideSearch};

technique! {
    /// Parameters of [`search`](WideSearch::search) as described above.
    Parallax = "parallax", reads Heights, casts_shadows false,
    summary "one step: the height under the mesh surface",
    source "Kaneko et al. 2001",
    parameters {}
}

impl WideSearch for Parallax {
    #[inline(always)]
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L> {
        let (zero, dz) = (L::splat(0.0), rays.delta[2]);
        let base = L::splat(heights.field.extent().base);
        // Where the ray passes the mesh surface.
        let tau = (base - rays.start[2]) / dz;
        let height = heights.sample(rays.start[0] + rays.delta[0] * tau, rays.start[1] + rays.delta[1] * tau);
        let tau = (height - rays.start[2]) / dz;
        let hit = L::lt(dz, zero);
        let steps = L::select_int(hit, L::splat_int(1), L::splat_int(0));
        Findings { tau: L::max(tau, zero), hit, steps }
    }

    #[inline(always)]
    fn occluded<L: Lanes>(&self, _heights: &Heights<'_, L>, _rays: &Segments<L>) -> L::M {
        L::first(0)
    }
}
