//! The normal of the displaced surface. Twin of `shaders_wgsl/surface/bump_exact.wgsl`.
//!
//! Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978, before the approximation.

use glam::{DVec3, Vec2};
use heightfield::HeightField;

use super::{SurfaceFrame, central_slope, perturb_exact};

/// The shading normal at `uv`, from heights read `reach` (in uv, at least a texel) away; `bend`: `dN/du`
/// and `dN/dv`, per tile.
pub fn bump_exact(
    field: &HeightField,
    surface: &SurfaceFrame,
    bend: [DVec3; 2],
    uv: Vec2,
    reach: Vec2,
) -> DVec3 {
    let extent = field.extent();
    let rise = extent.scale * (field.sample(uv.x, uv.y) - extent.base);
    perturb_exact(surface, bend, central_slope(field, uv, reach), f64::from(rise))
}
