//! The normal of the surface that a search found. Twin of `shaders_wgsl/surface/displaced.wgsl`.
//!
//! Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978, before the approximation.

use glam::{DVec3, Vec2};
use heightfield::HeightField;

use super::{SurfaceFrame, baked_slope, perturb_exact};

/// The shading normal at `uv` and `height` (0..1), from `slopes` as `bake::slopes` gives them; `bend`:
/// `dN/du` and `dN/dv`, per tile.
pub fn displaced(
    field: &HeightField,
    slopes: &[[f32; 2]],
    surface: &SurfaceFrame,
    bend: [DVec3; 2],
    uv: Vec2,
    height: f32,
) -> DVec3 {
    let extent = field.extent();
    let rise = extent.scale * (height - extent.base);
    perturb_exact(surface, bend, baked_slope(field, slopes, uv), f64::from(rise))
}
