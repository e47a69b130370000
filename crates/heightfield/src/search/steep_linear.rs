//! Steep parallax mapping with angle-adaptive layers: the number of layers goes from `min_steps` head-on
//! to `max_steps` at grazing angles, linearly in the cosine of the view angle.
//!
//! Morgan McGuire and Max McGuire, Steep Parallax Mapping, I3D 2005; Natalya Tatarchuk, Dynamic
//! Parallax Occlusion Mapping with Approximate Soft Shadows, I3D 2006 (layers by angle).

use glam::Vec3;

use super::Search;
use super::layers::{any_below, first_below, linear_layers};
use crate::{Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    SteepLinear = "steep_linear", reads Heights, casts_shadows true,
    summary "layers adapted to the view angle (linear)",
    source "McGuire and McGuire 2005; Tatarchuk 2006",
    parameters { min_steps: 8 in 1..=4096, "Layers for a view along the normal."; max_steps: 64 in 1..=4096, "Layers for a grazing view."; }
}

impl Search for SteepLinear {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32) -> Found {
        let bracket =
            first_below(field, start, delta, linear_layers(self.min_steps, self.max_steps, cos_theta));
        if bracket.found { Found::hit(bracket.below, bracket.steps) } else { Found::left(bracket.steps) }
    }

    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32) -> bool {
        any_below(field, start, delta, linear_layers(self.min_steps, self.max_steps, cos_theta))
    }
}
