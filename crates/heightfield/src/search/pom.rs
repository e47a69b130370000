//! Parallax occlusion mapping: equal layers, then one secant step inside the bracket.
//!
//! Natalya Tatarchuk, Dynamic Parallax Occlusion Mapping with Approximate Soft Shadows, I3D 2006.

use glam::Vec3;

use super::Search;
use super::layers::{any_below, first_below, secant};
use crate::{Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    Pom = "pom", reads Heights, casts_shadows true,
    summary "equal layers, then one secant step",
    source "Tatarchuk 2006",
    parameters { steps: 32 in 1..=4096, "Equal layers between lid and floor."; }
}

impl Search for Pom {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> Found {
        let bracket = first_below(field, start, delta, self.steps);
        if !bracket.found {
            return Found::left(bracket.steps);
        }
        let tau = secant(bracket.above, bracket.below, bracket.gap_above, bracket.gap_below);
        Found::hit(tau, bracket.steps)
    }

    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> bool {
        any_below(field, start, delta, self.steps)
    }
}
