//! Steep parallax mapping: a fixed number of equal layers, the first sample below the surface is the
//! hit. Misses features thinner than a layer and shows the layers as steps.
//!
//! Morgan McGuire and Max McGuire, Steep Parallax Mapping, I3D 2005.

use glam::Vec3;

use super::Search;
use super::layers::{any_below, first_below};
use crate::{Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    Steep = "steep", reads Heights, casts_shadows true,
    summary "equal layers, first sample below the surface",
    source "McGuire and McGuire 2005",
    parameters { steps: 32 in 1..=4096, "Equal layers between lid and floor."; }
}

impl Search for Steep {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> Found {
        let bracket = first_below(field, start, delta, self.steps);
        if bracket.found { Found::hit(bracket.below, bracket.steps) } else { Found::left(bracket.steps) }
    }

    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> bool {
        any_below(field, start, delta, self.steps)
    }
}
