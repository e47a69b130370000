//! A rectangle.

use glam::DVec3;

use super::check_length;
use crate::error::MeshError;
use crate::mesh::Mesh;

impl Mesh {
    /// A square of side `size` in the plane z = 0, centred on the origin, facing +Z, the image
    /// upright: `u` along +X, `v` along -Y.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] unless the size is positive and finite.
    pub fn quad(size: f32) -> Result<Self, MeshError> {
        Self::rectangle(size, size)
    }

    /// As [`Mesh::quad`], `width` along X and `height` along Y.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] unless both sides are positive and finite.
    pub fn rectangle(width: f32, height: f32) -> Result<Self, MeshError> {
        let (width, height) = (check_length("width", width)?, check_length("height", height)?);
        let mut mesh = Self::default();
        mesh.push_rectangle(DVec3::ZERO, DVec3::X * width, DVec3::NEG_Y * height);
        Ok(mesh.named("quad"))
    }
}
