//! The mesh's own normal. Twin of `shaders_wgsl/surface/flat.wgsl`.

use glam::Vec3;

use super::SurfaceFrame;

/// The shading normal of the bare mesh.
pub fn flat(surface: &SurfaceFrame) -> Vec3 {
    surface.normal
}
