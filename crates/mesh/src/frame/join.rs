//! From one tangent a corner back to one tangent a vertex.

use glam::Vec4;
use hashbrown::HashMap;

use super::{Surface, convention};
use crate::error::MeshError;
use crate::limits::check_elements;

/// Tangents a vertex, and how the vertices came about.
///
/// Vertices are only ever split, never merged: the first `n` vertices are the given ones in their
/// order, copies for further tangents follow. To carry any other attribute over, take
/// `attribute[source[i]]` for each new vertex `i`.
#[derive(Debug, Clone, PartialEq)]
pub struct Split {
    /// For each new vertex, the given vertex it is or copies.
    pub source: Vec<u32>,
    /// Triangles over the new vertices, in the given order.
    pub indices: Vec<[u32; 3]>,
    /// glTF tangents of the new vertices.
    pub tangents: Vec<Vec4>,
    /// What had to be replaced.
    pub warnings: Vec<String>,
}

/// Joins corners of one vertex that have the same tangent, bit for bit; unless `shares`, none.
pub(super) fn join(
    surface: Surface<'_>,
    corners: &[Vec4],
    shares: bool,
    warnings: Vec<String>,
) -> Result<Split, MeshError> {
    let vertices = surface.positions.len();
    let mut first: Vec<Option<Vec4>> = vec![None; vertices];
    let mut extra: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    let mut source: Vec<u32> = (0..vertices as u32).collect();
    let mut copies: Vec<Vec4> = Vec::new();
    let mut joined = Vec::with_capacity(surface.indices.len());
    for (triangle, tangents) in surface.indices.iter().zip(corners.chunks_exact(3)) {
        let mut row = [0; 3];
        for ((slot, &vertex), &tangent) in row.iter_mut().zip(triangle).zip(tangents) {
            let fresh = first[vertex as usize].is_none();
            let known = *first[vertex as usize].get_or_insert(tangent);
            let mut copy = || {
                source.push(vertex);
                copies.push(tangent);
                source.len() as u32 - 1
            };
            *slot = if fresh || shares && known == tangent {
                vertex
            } else if shares {
                *extra.entry((vertex, tangent.to_array().map(f32::to_bits))).or_insert_with(copy)
            } else {
                copy()
            };
        }
        joined.push(row);
    }
    check_elements("vertices after splitting for tangents", source.len())?;
    let mut tangents: Vec<Vec4> = first
        .into_iter()
        .zip(surface.normals)
        .map(|(tangent, &normal)| tangent.unwrap_or_else(|| convention::any_tangent(normal)))
        .collect();
    tangents.append(&mut copies);
    Ok(Split { source, indices: joined, tangents, warnings })
}
