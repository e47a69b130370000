//! Bisection over the whole segment without a linear phase. Finds *a* crossing, not the first: a thin
//! feature in the half that is thrown away is lost. Shipped to show that.
//!
//! Fabio Policarpo, Manuel Oliveira and Joao Comba, Real-Time Relief Mapping on Arbitrary Polygonal
//! Surfaces, I3D 2005 (its second phase alone).

use glam::Vec3;

use super::Search;
use super::layers::gap_at;
use crate::{Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    Binary = "binary", reads Heights, casts_shadows true,
    summary "bisection of the whole ray; finds some crossing, not the first",
    source "Policarpo, Oliveira and Comba 2005 (refinement alone)",
    parameters { steps: 16 in 1..=32, "Halvings of the ray."; }
}

impl Search for Binary {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> Found {
        let mut above = 0.0;
        let mut below = 1.0;
        let mut found = delta.z < 0.0;
        for _ in 0..self.steps {
            let middle = 0.5 * (above + below);
            if gap_at(field, start, delta, middle) <= 0.0 {
                below = middle;
                found = true;
            } else {
                above = middle;
            }
        }
        if found { Found::hit(below, self.steps) } else { Found::left(self.steps) }
    }

    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> bool {
        // Halving towards the surface; closer than 1/256 the surface shadows itself by rounding.
        let mut far = 1.0;
        for _ in 0..self.steps.min(8) {
            far *= 0.5;
            if gap_at(field, start, delta, far) < 0.0 {
                return true;
            }
        }
        false
    }
}
