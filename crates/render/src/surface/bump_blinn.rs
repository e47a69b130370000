//! As bump, by the published formula. Twin of `shaders_wgsl/surface/bump_blinn.wgsl`.
//!
//! Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.

use glam::{DVec3, Vec2};
use heightfield::HeightField;

use super::{SurfaceFrame, central_slope, perturb_blinn};

/// The shading normal at `uv`, from heights read `reach` (in uv, at least a texel) away.
pub fn bump_blinn(field: &HeightField, surface: &SurfaceFrame, uv: Vec2, reach: Vec2) -> DVec3 {
    perturb_blinn(surface, central_slope(field, uv, reach))
}
