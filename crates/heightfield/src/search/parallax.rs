//! Parallax mapping: one height read where the ray meets the mesh surface (`z = base`), then the ray is
//! moved to that height. No search: wrong wherever the height changes along the offset.
//!
//! Tomomichi Kaneko et al., Detailed Shape Representation with Parallax Mapping, ICAT 2001.

use glam::Vec3;

use super::Search;
use crate::{Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    Parallax = "parallax", reads Heights, casts_shadows false,
    summary "one step: the height under the mesh surface",
    source "Kaneko et al. 2001",
    parameters {}
}

impl Search for Parallax {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> Found {
        let dz = delta.z;
        if dz >= 0.0 {
            return Found::left(0);
        }
        let base = field.extent().base;
        let surface = start + delta * ((base - start.z) / dz);
        let height = field.sample(surface.x, surface.y);
        Found::hit(((height - start.z) / dz).max(0.0), 1)
    }

    #[inline(always)]
    fn occluded(&self, _field: &HeightField, _start: Vec3, _delta: Vec3, _cos_theta: f32) -> bool {
        false
    }
}
