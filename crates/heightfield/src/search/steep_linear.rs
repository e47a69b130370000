//! Steep parallax mapping with angle-adaptive layers: the number of layers goes from `min_steps` head-on
//! to `max_steps` at grazing angles, linearly in the cosine of the view angle.
//!
//! Morgan McGuire and Max McGuire, Steep Parallax Mapping, I3D 2005; Natalya Tatarchuk, Dynamic
//! Parallax Occlusion Mapping with Approximate Soft Shadows, I3D 2006 (layers by angle).

use super::layers::{Layers, any_below, first_below};
use crate::lanes::Lanes;
use crate::wide::{Findings, Heights, Segments, WideSearch};

technique! {
    /// Parameters of [`search`](WideSearch::search) as described above.
    SteepLinear = "steep_linear", reads Heights, casts_shadows true,
    summary "layers adapted to the view angle (linear)",
    source "McGuire and McGuire 2005; Tatarchuk 2006",
    parameters { min_steps: 8 in 1..=4096, "Layers for a view along the normal."; max_steps: 64 in 1..=4096, "Layers for a grazing view."; }
}

impl WideSearch for SteepLinear {
    #[inline(always)]
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L> {
        let bracket =
            first_below(heights, rays, Layers::linear(self.min_steps, self.max_steps, rays.cos_theta));
        Findings { tau: bracket.below, hit: bracket.found, steps: bracket.steps }
    }

    #[inline(always)]
    fn occluded<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> L::M {
        any_below(heights, rays, Layers::linear(self.min_steps, self.max_steps, rays.cos_theta))
    }
}
