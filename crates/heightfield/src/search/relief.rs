//! Relief mapping: equal layers until the ray is below the surface, then bisection *inside the bracket*
//! of the last sample above and the first below.
//!
//! Fabio Policarpo, Manuel Oliveira and Joao Comba, Real-Time Relief Mapping on Arbitrary Polygonal
//! Surfaces, I3D 2005. Bisecting half of the whole ray, as some published shaders do, loses the bracket.

use super::layers::{Layers, any_below, first_below};
use crate::lanes::Lanes;
use crate::wide::{Findings, Heights, Segments, WideSearch};

technique! {
    /// Parameters of [`search`](WideSearch::search) as described above.
    Relief = "relief", reads Heights, casts_shadows true,
    summary "equal layers, then bisection inside the bracket",
    source "Policarpo, Oliveira and Comba 2005",
    parameters { linear: 32 in 1..=4096, "Equal layers between lid and floor."; refine: 8 in 0..=32, "Halvings of the bracket."; }
}

impl WideSearch for Relief {
    #[inline(always)]
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L> {
        let bracket = first_below(heights, rays, Layers::uniform(self.linear));
        let (mut above, mut below) = (bracket.above, bracket.below);
        let half = L::splat(0.5);
        for _ in 0..self.refine {
            let middle = half * (above + below);
            let under = L::le(rays.gap_at(heights, middle), L::splat(0.0));
            below = L::select(under, middle, below);
            above = L::select(under, above, middle);
        }
        let refined = L::splat_int(self.refine as i32);
        let steps = L::select_int(bracket.found, bracket.steps + refined, bracket.steps);
        Findings { tau: half * (above + below), hit: bracket.found, steps }
    }

    #[inline(always)]
    fn occluded<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> L::M {
        any_below(heights, rays, Layers::uniform(self.linear))
    }
}
