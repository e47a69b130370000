//! As bump, the axes from derivatives along the screen. Twin of `shaders_wgsl/surface/bump_derivative.wgsl`.
//!
//! Source: Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", 2010.

use glam::{DVec2, DVec3, Vec2};
use heightfield::HeightField;

use super::{SurfaceFrame, central_slope, perturb_general};

/// What a fragment knows of its neighbours: changes from one pixel to the next, right and down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScreenDerivatives {
    /// Of the position, mesh units.
    pub position: [DVec3; 2],
    /// Of the texture coordinates.
    pub uv: [DVec2; 2],
}

/// The shading normal at `uv`, from heights read `reach` (in uv, at least a texel) away.
pub fn bump_derivative(
    field: &HeightField,
    normal: DVec3,
    screen: &ScreenDerivatives,
    uv: Vec2,
    reach: Vec2,
) -> DVec3 {
    let slope = central_slope(field, uv, reach);
    let [dpdu, dpdv] = screen.position;
    perturb_general(
        &SurfaceFrame { dpdu, dpdv, normal },
        DVec2::new(slope.dot(screen.uv[0]), slope.dot(screen.uv[1])),
    )
}
