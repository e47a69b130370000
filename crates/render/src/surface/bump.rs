//! The normal bent by the heights as they are read, in axes at any angle. Twin of `shaders_wgsl/surface/bump.wgsl`.
//!
//! Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.

use glam::{DVec3, Vec2};
use heightfield::HeightField;

use super::{SurfaceFrame, central_slope, perturb_general};

/// The shading normal at `uv`, from heights read `reach` (in uv, at least a texel) away.
pub fn bump(field: &HeightField, surface: &SurfaceFrame, uv: Vec2, reach: Vec2) -> DVec3 {
    perturb_general(surface, central_slope(field, uv, reach))
}
