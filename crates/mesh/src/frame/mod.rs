//! Tangent frames: arrays in, arrays out.
//!
//! A frame method says which tangent each *corner* of each triangle has. Corners of one vertex that
//! agree stay one vertex; where they differ (mirrored charts, creases in UV) the vertex is split.

mod alone;
mod averaged;
mod axis;
pub mod convention;
mod degenerate;
mod derivative;
mod dietrich;
mod edge;
mod join;
mod metric;
mod mikktspace;
mod split;
mod uv_gradient;
pub(crate) mod weld;

use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use crate::error::MeshError;
pub use alone::{quads_of_triangles, tangents_of_arrays, triangles_of_quads};
pub use dietrich::{FaceFrame, face_frame};
pub use join::Split;
pub use metric::{Derivatives, derivatives, normal_derivatives};

/// What a file of this folder says of its method.
#[derive(Debug)]
struct FrameInfo {
    name: &'static str,
    summary: &'static str,
    guarantee: &'static str,
    source: &'static str,
    /// Whether corners of one vertex that agree stay one vertex.
    shares: bool,
    /// A tangent for each corner of each triangle; `None` where there is none to be had.
    corners: fn(Surface<'_>) -> Vec<Option<Vec4>>,
}

/// Every method: a new one is a file and a line here.
static METHODS: [FrameMethod; 8] = [
    FrameMethod::MIKKTSPACE,
    FrameMethod(&dietrich::INFO),
    FrameMethod(&edge::INFO),
    FrameMethod(&axis::INFO),
    FrameMethod(&averaged::INFO),
    FrameMethod(&split::INFO),
    FrameMethod(&uv_gradient::INFO),
    FrameMethod(&derivative::INFO),
];

/// How tangents are found; named in the registry of this module.
#[derive(Clone, Copy)]
pub struct FrameMethod(&'static FrameInfo);

impl FrameMethod {
    /// The standard of glTF, Blender and Unreal.
    pub const MIKKTSPACE: Self = Self(&mikktspace::INFO);

    /// Every method, the standard first.
    pub fn all() -> &'static [Self] {
        &METHODS
    }

    /// The name used in Python, such as `"mikktspace"`.
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// What it does, in one line.
    pub fn summary(self) -> &'static str {
        self.0.summary
    }

    /// What can be relied on, and what cannot.
    pub fn guarantee(self) -> &'static str {
        self.0.guarantee
    }

    /// The work it comes from.
    pub fn source(self) -> &'static str {
        self.0.source
    }

    /// The method of that name.
    ///
    /// # Errors
    /// [`MeshError::UnknownMethod`] lists the names.
    pub fn named(name: &str) -> Result<Self, MeshError> {
        METHODS.iter().copied().find(|m| m.name() == name).ok_or_else(|| MeshError::UnknownMethod {
            name: name.to_owned(),
            known: METHODS.map(Self::name).join(", "),
        })
    }
}

impl PartialEq for FrameMethod {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for FrameMethod {}

impl std::fmt::Debug for FrameMethod {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "FrameMethod({:?})", self.name())
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
        let corners = degenerate::fill(self, (method.0.corners)(self), &mut warnings);
        join::join(self, &corners, method.0.shares, warnings)
    }

    /// Corners of all triangles: `prepare(face)` answers for the vertices of a face, each given with
    /// its normal.
    fn each_corner<F>(self, prepare: impl Fn(usize) -> F + Sync) -> Vec<Option<Vec4>>
    where
        F: Fn(usize, DVec3) -> Option<Vec4>,
    {
        let mut corners = vec![None; 3 * self.indices.len()];
        corners.par_chunks_exact_mut(3).with_min_len(1024).enumerate().for_each(|(face, row)| {
            let answer = prepare(face);
            for (slot, &vertex) in row.iter_mut().zip(&self.indices[face]) {
                *slot = answer(vertex as usize, self.normals[vertex as usize].as_dvec3());
            }
        });
        corners
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
