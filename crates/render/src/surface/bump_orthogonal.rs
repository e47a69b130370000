//! As bump, as if the axes of the mapping were orthogonal. Twin of `shaders_wgsl/surface/bump_orthogonal.wgsl`.
//!
//! Source: Kilgard, "A Practical and Robust Bump-mapping Technique for Today's GPUs", GDC 2000.

use glam::{DVec3, Vec2};
use heightfield::HeightField;

use super::{SurfaceFrame, central_slope, perturb_orthogonal};

/// The shading normal at `uv`, from heights read `reach` (in uv, at least a texel) away.
pub fn bump_orthogonal(field: &HeightField, surface: &SurfaceFrame, uv: Vec2, reach: Vec2) -> DVec3 {
    perturb_orthogonal(surface, central_slope(field, uv, reach))
}
