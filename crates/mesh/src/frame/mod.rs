//! Tangent frames: arrays in, arrays out.
//!
//! A frame method says which tangent each *corner* of each triangle has. Corners of one vertex that
//! agree stay one vertex; where they differ (mirrored charts, creases in UV) the vertex is split.

pub mod convention;
mod degenerate;
mod derivative;
mod dietrich;
mod join;
mod mikktspace;

use glam::{Vec2, Vec3};

use crate::error::MeshError;
pub use derivative::{Derivatives, derivatives};
pub use dietrich::{FaceFrame, face_frame};
pub use join::Split;

/// How tangents are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FrameMethod {
    /// The standard of glTF, Blender and Unreal (Mikkelsen 2008), run on unindexed corners. On
    /// triangles; only while an OBJ is read does it see the file's quads.
    MikkTSpace,
    /// One frame per triangle from the plane through `(x, u, v)`, and so for y and z; `dP/du` made
    /// perpendicular to the vertex normal (Dietrich, Game Programming Gems, 2000). Nothing is
    /// averaged.
    Dietrich,
}

impl FrameMethod {
    /// Every method.
    pub const ALL: [Self; 2] = [Self::MikkTSpace, Self::Dietrich];

    /// The name used in Python: `"mikktspace"`, `"dietrich"`.
    pub fn name(self) -> &'static str {
        match self {
            Self::MikkTSpace => "mikktspace",
            Self::Dietrich => "dietrich",
        }
    }

    /// The method of that name.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] when there is none.
    pub fn named(name: &str) -> Result<Self, MeshError> {
        Self::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| MeshError::Parameter {
            name: "tangent method",
            value: format!("{name:?}"),
            expected: "\"mikktspace\" or \"dietrich\" expected",
        })
    }
}

/// The arrays a frame is computed from; unit normals, `v` down, indices in range.
#[derive(Clone, Copy)]
pub(crate) struct Surface<'a> {
    pub positions: &'a [Vec3],
    pub normals: &'a [Vec3],
    pub uvs: &'a [Vec2],
    pub indices: &'a [[u32; 3]],
    /// Ascending: triangles `abc` that the next one, `acd`, makes a quad.
    pub quads: &'a [u32],
}

impl Surface<'_> {
    /// A tangent for each vertex, splitting where those of its corners differ.
    pub(crate) fn tangents(self, method: FrameMethod) -> Result<Split, MeshError> {
        let mut warnings = Vec::new();
        let corners = match method {
            FrameMethod::MikkTSpace => mikktspace::corners(self, &mut warnings),
            FrameMethod::Dietrich => dietrich::corners(self),
        };
        let corners = degenerate::fill(self, corners, &mut warnings);
        join::join(self.positions.len(), self.normals, self.indices, &corners, warnings)
    }
}

/// Tangents for plain arrays: one position, unit normal and UV (`v` down) a vertex.
///
/// The result has at least as many vertices: see [`Split`].
///
/// # Errors
/// [`MeshError::Arrays`] for mismatched lengths, an index out of range, NaN or infinity;
/// [`MeshError::TooLarge`] when splitting would make too many vertices.
pub fn tangents(
    method: FrameMethod,
    positions: &[Vec3],
    normals: &[Vec3],
    uvs: &[Vec2],
    indices: &[[u32; 3]],
) -> Result<Split, MeshError> {
    let vertices = positions.len();
    if normals.len() != vertices || uvs.len() != vertices {
        return Err(MeshError::arrays(format!(
            "{vertices} positions, {} normals and {} uvs; one each needed",
            normals.len(),
            uvs.len()
        )));
    }
    if indices.iter().flatten().any(|&i| i as usize >= vertices) {
        return Err(MeshError::arrays(format!("a triangle uses a vertex beyond the last, {vertices} - 1")));
    }
    let finite = |i: usize| positions[i].is_finite() && normals[i].is_finite() && uvs[i].is_finite();
    if let Some(vertex) = (0..vertices).find(|&i| !finite(i)) {
        return Err(MeshError::arrays(format!("vertex {vertex} is NaN or infinite")));
    }
    Surface { positions, normals, uvs, indices, quads: &[] }.tangents(method)
}
