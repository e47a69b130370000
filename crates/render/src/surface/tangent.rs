//! The material's own normal map in the tangent frame. Twin of `shaders_wgsl/surface/tangent.wgsl`.
//!
//! Source: glTF 2.0, "normalTexture".

use glam::{Vec3, Vec4};

use super::perturb_by_map;

/// The shading normal from a stored normal, each component `n * 0.5 + 0.5`.
pub fn tangent(normal: Vec3, tangent: Vec4, stored: Vec3) -> Vec3 {
    perturb_by_map(normal, tangent, stored * 2.0 - 1.0)
}
