//! Steep parallax mapping: a fixed number of equal layers, the first sample below the surface is the
//! hit. Misses features thinner than a layer and shows the layers as steps.
//!
//! Morgan McGuire and Max McGuire, Steep Parallax Mapping, I3D 2005.

use super::layers::{Layers, any_below, first_below};
use crate::lanes::Lanes;
use crate::wide::{Findings, Heights, Segments, WideSearch};

technique! {
    /// Parameters of [`search`](WideSearch::search) as described above.
    Steep = "steep", reads Heights, casts_shadows true,
    summary "equal layers, first sample below the surface",
    source "McGuire and McGuire 2005",
    parameters { steps: 32 in 1..=4096, "Equal layers between lid and floor."; }
}

impl WideSearch for Steep {
    #[inline(always)]
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L> {
        let bracket = first_below(heights, rays, Layers::uniform(self.steps));
        Findings { tau: bracket.below, hit: bracket.found, steps: bracket.steps }
    }

    #[inline(always)]
    fn occluded<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> L::M {
        any_below(heights, rays, Layers::uniform(self.steps))
    }
}
