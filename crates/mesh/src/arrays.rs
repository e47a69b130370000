//! Plain arrays on their way to becoming a mesh, and the checks they must pass.

use std::io::Read;
use std::path::Path;

use glam::{Vec2, Vec3, Vec4};

use crate::error::MeshError;
use crate::limits::check_elements;

/// Unfinished mesh data.
#[derive(Debug, Clone, Default)]
pub struct Arrays {
    /// Positions, mesh units.
    pub positions: Vec<Vec3>,
    /// Normals of any length, when given.
    pub normals: Option<Vec<Vec3>>,
    /// Texture coordinates, `v` down.
    pub uvs: Vec<Vec2>,
    /// Tangents as in glTF, when given.
    pub tangents: Option<Vec<Vec4>>,
    /// Triangles.
    pub indices: Vec<[u32; 3]>,
}

/// Returns the arrays when they make a mesh.
///
/// # Errors
/// [`MeshError::Arrays`] for an empty mesh, mismatched lengths, an index out of range, NaN or
/// infinity; [`MeshError::TooLarge`].
pub fn checked(arrays: Arrays) -> Result<Arrays, MeshError> {
    let vertices = arrays.positions.len();
    check_elements("vertices", vertices)?;
    check_elements("triangles", arrays.indices.len())?;
    if vertices == 0 || arrays.indices.is_empty() {
        return Err(MeshError::arrays(format!(
            "mesh has {vertices} vertices and {} triangles; at least 3 and 1 needed",
            arrays.indices.len()
        )));
    }
    same_length("uvs", arrays.uvs.len(), vertices)?;
    finite("position", arrays.positions.iter().map(|p| p.is_finite()))?;
    finite("uv", arrays.uvs.iter().map(|p| p.is_finite()))?;
    if let Some(normals) = &arrays.normals {
        same_length("normals", normals.len(), vertices)?;
        finite("normal", normals.iter().map(|p| p.is_finite()))?;
    }
    if let Some(tangents) = &arrays.tangents {
        same_length("tangents", tangents.len(), vertices)?;
        finite("tangent", tangents.iter().map(|p| p.is_finite()))?;
    }
    for (triangle, corners) in arrays.indices.iter().enumerate() {
        if let Some(index) = corners.iter().find(|&&i| i as usize >= vertices) {
            return Err(MeshError::arrays(format!(
                "triangle {triangle} uses vertex {index}, but there are {vertices} vertices"
            )));
        }
    }
    Ok(arrays)
}

fn same_length(what: &str, got: usize, vertices: usize) -> Result<(), MeshError> {
    if got != vertices {
        return Err(MeshError::arrays(format!("{got} {what} for {vertices} positions; one each needed")));
    }
    Ok(())
}

fn finite(what: &str, mut flags: impl Iterator<Item = bool>) -> Result<(), MeshError> {
    match flags.position(|finite| !finite) {
        Some(vertex) => Err(MeshError::arrays(format!("{what} of vertex {vertex} is NaN or infinite"))),
        None => Ok(()),
    }
}

/// Reads a whole regular file of at most `limit` bytes.
///
/// Pipes and devices are refused: they may never end.
pub(crate) fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>, MeshError> {
    let fail = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::NotFound => MeshError::NotFound { path: path.to_owned() },
        _ => MeshError::Read { path: path.to_owned(), source },
    };
    let info = std::fs::metadata(path).map_err(fail)?;
    if !info.is_file() {
        return Err(fail(std::io::Error::other("not a regular file")));
    }
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(fail)?;
    file.take(limit + 1).read_to_end(&mut bytes).map_err(fail)?;
    if bytes.len() as u64 > limit {
        return Err(MeshError::TooLarge {
            what: format!("bytes in {}", path.display()),
            got: info.len(),
            limit,
        });
    }
    Ok(bytes)
}
