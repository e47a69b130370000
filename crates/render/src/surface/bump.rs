//! The normal bent by the heights as they are read. Twin of `shaders_wgsl/surface/bump.wgsl`.
//!
//! Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.

use glam::{Vec2, Vec3};
use heightfield::HeightField;

use super::{SurfaceFrame, perturb_by_slope};

/// The shading normal at `uv`, from heights `reach` (in uv, at least a texel) to each side.
pub fn bump(field: &HeightField, surface: &SurfaceFrame, uv: Vec2, reach: Vec2) -> Vec3 {
    let rise = Vec2::new(
        field.sample(uv.x + reach.x, uv.y) - field.sample(uv.x - reach.x, uv.y),
        field.sample(uv.x, uv.y + reach.y) - field.sample(uv.x, uv.y - reach.y),
    );
    perturb_by_slope(surface, field.extent().scale * rise / (2.0 * reach))
}
