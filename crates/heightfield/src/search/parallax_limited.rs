//! Parallax mapping with offset limiting: the offset is not divided by the cosine of the view angle, so
//! it never exceeds the height. Flattens the relief at grazing angles.
//!
//! Terry Welsh, Parallax Mapping with Offset Limiting: A Per-Pixel Approximation of Uneven Surfaces,
//! 2004.

use glam::Vec3;

use super::Search;
use crate::{Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    ParallaxLimited = "parallax_limited", reads Heights, casts_shadows false,
    summary "one step, offset limited at grazing angles",
    source "Welsh 2004",
    parameters {}
}

impl Search for ParallaxLimited {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32) -> Found {
        let dz = delta.z;
        if dz >= 0.0 {
            return Found::left(0);
        }
        let base = field.extent().base;
        let surface = start + delta * ((base - start.z) / dz);
        let height = field.sample(surface.x, surface.y);
        let level = base + (height - base) * cos_theta;
        Found::hit(((level - start.z) / dz).max(0.0), 1)
    }

    #[inline(always)]
    fn occluded(&self, _field: &HeightField, _start: Vec3, _delta: Vec3, _cos_theta: f32) -> bool {
        false
    }
}
