//! Interval mapping: equal layers, then secant steps that always keep the crossing between the last
//! position above and the last below (regula falsi).
//!
//! Eric Risser, Musawir Shah and Sumanta Pattanaik, Interval Mapping, University of Central Florida,
//! 2005; Faster Relief Mapping Using the Secant Method, Journal of Graphics Tools 12(3), 2007.

use super::layers::{Layers, any_below, first_below, secant};
use crate::lanes::Lanes;
use crate::wide::{Findings, Heights, Segments, WideSearch};

technique! {
    /// Parameters of [`search`](WideSearch::search) as described above.
    Interval = "interval", reads Heights, casts_shadows true,
    summary "equal layers, then regula falsi inside the bracket",
    source "Risser, Shah and Pattanaik 2007",
    parameters { linear: 24 in 1..=4096, "Equal layers between lid and floor."; refine: 4 in 0..=32, "Secant steps inside the bracket."; }
}

impl WideSearch for Interval {
    #[inline(always)]
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L> {
        let bracket = first_below(heights, rays, Layers::uniform(self.linear));
        let (mut above, mut below) = (bracket.above, bracket.below);
        let (mut gap_above, mut gap_below) = (bracket.gap_above, bracket.gap_below);
        for _ in 0..self.refine {
            let tau = secant::<L>(above, below, gap_above, gap_below);
            let gap = rays.gap_at(heights, tau);
            let under = L::le(gap, L::splat(0.0));
            below = L::select(under, tau, below);
            gap_below = L::select(under, gap, gap_below);
            above = L::select(under, above, tau);
            gap_above = L::select(under, gap_above, gap);
        }
        let refined = L::splat_int(self.refine as i32);
        let steps = L::select_int(bracket.found, bracket.steps + refined, bracket.steps);
        Findings { tau: secant::<L>(above, below, gap_above, gap_below), hit: bracket.found, steps }
    }

    #[inline(always)]
    fn occluded<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> L::M {
        any_below(heights, rays, Layers::uniform(self.linear))
    }
}
