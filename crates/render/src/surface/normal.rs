//! The normal from slopes baked at the texels. Twin of `shaders_wgsl/surface/normal.wgsl`.
//!
//! Source: Cohen, Olano, Manocha, "Appearance-Preserving Simplification", SIGGRAPH 1998.

use glam::{DVec3, Vec2};
use heightfield::HeightField;

use super::{SurfaceFrame, baked_slope, perturb_general};

/// The shading normal at `uv`, from `slopes` as `bake::slopes` gives them.
pub fn normal(field: &HeightField, slopes: &[[f32; 2]], surface: &SurfaceFrame, uv: Vec2) -> DVec3 {
    perturb_general(surface, baked_slope(field, slopes, uv))
}
