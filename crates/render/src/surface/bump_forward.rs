//! As bump, from forward differences. Twin of `shaders_wgsl/surface/bump_forward.wgsl`.
//!
//! Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.

use glam::{DVec3, Vec2};
use heightfield::HeightField;

use super::{SurfaceFrame, forward_slope, perturb_general};

/// The shading normal at `uv`, from heights read `reach` (in uv, at least a texel) away.
pub fn bump_forward(field: &HeightField, surface: &SurfaceFrame, uv: Vec2, reach: Vec2) -> DVec3 {
    perturb_general(surface, forward_slope(field, uv, reach))
}
