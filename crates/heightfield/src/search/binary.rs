//! Bisection over the whole segment without a linear phase. Finds *a* crossing, not the first: a thin
//! feature in the half that is thrown away is lost. Shipped to show that.
//!
//! Fabio Policarpo, Manuel Oliveira and Joao Comba, Real-Time Relief Mapping on Arbitrary Polygonal
//! Surfaces, I3D 2005 (its second phase alone).

use super::layers::lifted;
use crate::lanes::Lanes;
use crate::wide::{Findings, Heights, Segments, WideSearch};

technique! {
    /// Parameters of [`search`](WideSearch::search) as described above.
    Binary = "binary", reads Heights, casts_shadows true,
    summary "bisection of the whole ray; finds some crossing, not the first",
    source "Policarpo, Oliveira and Comba 2005 (refinement alone)",
    parameters { steps: 16 in 1..=32, "Halvings of the ray."; }
}

impl WideSearch for Binary {
    #[inline(always)]
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L> {
        let (zero, half) = (L::splat(0.0), L::splat(0.5));
        let (mut above, mut below) = (zero, L::splat(1.0));
        let mut hit = L::lt(rays.delta[2], zero);
        for _ in 0..self.steps {
            let middle = half * (above + below);
            let under = L::le(rays.gap_at(heights, middle), zero);
            hit = hit | under;
            below = L::select(under, middle, below);
            above = L::select(under, above, middle);
        }
        Findings { tau: below, hit, steps: L::splat_int(self.steps as i32) }
    }

    #[inline(always)]
    fn occluded<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> L::M {
        // Halving towards the surface; closer than 1/256 the surface shadows itself by rounding.
        let rays = lifted(heights, rays);
        let mut far = 1.0;
        let mut blocked = L::first(0);
        for _ in 0..self.steps.min(8) {
            far *= 0.5;
            blocked = blocked | L::lt(rays.gap_at(heights, L::splat(far)), L::splat(0.0));
        }
        blocked
    }
}
