//! A cube.

use glam::DVec3;

use super::check_length;
use crate::error::MeshError;
use crate::mesh::Mesh;

/// Outward normal and the direction that is up on the image, face by face.
const FACES: [(DVec3, DVec3); 6] = [
    (DVec3::Z, DVec3::Y),
    (DVec3::X, DVec3::Y),
    (DVec3::NEG_Z, DVec3::Y),
    (DVec3::NEG_X, DVec3::Y),
    (DVec3::Y, DVec3::NEG_Z),
    (DVec3::NEG_Y, DVec3::Z),
];

impl Mesh {
    /// A cube of side `size` centred on the origin. Each face shows the whole image, unmirrored from
    /// outside and upright: up is +Y on the four sides, -Z on top, +Z below, so that turning the
    /// cube from front to top or bottom keeps it upright.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] unless the size is positive and finite.
    pub fn cube(size: f32) -> Result<Self, MeshError> {
        let size = check_length("size", size)?;
        let mut mesh = Self::default();
        for (normal, up) in FACES {
            mesh.push_rectangle(normal * (size / 2.0), up.cross(normal) * size, up * -size);
        }
        Ok(mesh.named("cube"))
    }
}
