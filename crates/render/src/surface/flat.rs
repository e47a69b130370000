//! The mesh's own normal. Twin of `shaders_wgsl/surface/flat.wgsl`.

use glam::DVec3;

use super::SurfaceFrame;

/// The shading normal of the bare mesh.
pub fn flat(surface: &SurfaceFrame) -> DVec3 {
    surface.normal
}
