//! Relief mapping: equal layers until the ray is below the surface, then bisection *inside the bracket*
//! of the last sample above and the first below.
//!
//! Fabio Policarpo, Manuel Oliveira and Joao Comba, Real-Time Relief Mapping on Arbitrary Polygonal
//! Surfaces, I3D 2005. Bisecting half of the whole ray, as some published shaders do, loses the bracket.

use glam::Vec3;

use super::Search;
use super::layers::{any_below, first_below, gap_at};
use crate::{Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    Relief = "relief", reads Heights, casts_shadows true,
    summary "equal layers, then bisection inside the bracket",
    source "Policarpo, Oliveira and Comba 2005",
    parameters { linear: 32 in 1..=4096, "Equal layers between lid and floor."; refine: 8 in 0..=32, "Halvings of the bracket."; }
}

impl Search for Relief {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> Found {
        let bracket = first_below(field, start, delta, self.linear);
        if !bracket.found {
            return Found::left(bracket.steps);
        }
        let mut above = bracket.above;
        let mut below = bracket.below;
        for _ in 0..self.refine {
            let middle = 0.5 * (above + below);
            if gap_at(field, start, delta, middle) <= 0.0 {
                below = middle;
            } else {
                above = middle;
            }
        }
        Found::hit(0.5 * (above + below), bracket.steps + self.refine)
    }

    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> bool {
        any_below(field, start, delta, self.linear)
    }
}
