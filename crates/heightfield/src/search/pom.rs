//! Parallax occlusion mapping: equal layers, then one secant step inside the bracket.
//!
//! Natalya Tatarchuk, Dynamic Parallax Occlusion Mapping with Approximate Soft Shadows, I3D 2006.

use super::layers::{Layers, any_below, first_below, secant};
use crate::lanes::Lanes;
use crate::wide::{Findings, Heights, Segments, WideSearch};

technique! {
    /// Parameters of [`search`](WideSearch::search) as described above.
    Pom = "pom", reads Heights, casts_shadows true,
    summary "equal layers, then one secant step",
    source "Tatarchuk 2006",
    parameters { steps: 32 in 1..=4096, "Equal layers between lid and floor."; }
}

impl WideSearch for Pom {
    #[inline(always)]
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L> {
        let bracket = first_below(heights, rays, Layers::uniform(self.steps));
        let tau = secant::<L>(bracket.above, bracket.below, bracket.gap_above, bracket.gap_below);
        Findings { tau, hit: bracket.found, steps: bracket.steps }
    }

    #[inline(always)]
    fn occluded<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> L::M {
        any_below(heights, rays, Layers::uniform(self.steps))
    }
}
