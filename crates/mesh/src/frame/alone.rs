//! Tangents for arrays that never become a mesh.

use glam::Vec3;

use super::{FrameMethod, Split, Surface, weld};
use crate::arrays::{Arrays, checked};
use crate::error::MeshError;

impl Split {
    /// One vertex for those that are equal in position, normal, UV and tangent, and none that no
    /// triangle uses. `source` still names given vertices, each new vertex the first it stands for.
    ///
    /// `arrays`: as the split was made from, with normals.
    fn welded(mut self, arrays: &Arrays, normals: &[Vec3]) -> Self {
        let first = weld::first_equal(self.source.len(), |i| {
            let at = self.source[i] as usize;
            let (p, n) = (arrays.positions[at] + 0.0, normals[at] + 0.0);
            let (uv, t) = (arrays.uvs[at] + 0.0, self.tangents[i] + 0.0);
            [p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y, t.x, t.y, t.z, t.w].map(f32::to_bits)
        });
        let mut place: Vec<Option<u32>> = vec![None; first.len()];
        let (mut source, mut tangents) = (Vec::new(), Vec::new());
        for vertex in self.indices.as_flattened_mut() {
            let from = first[*vertex as usize] as usize;
            *vertex = *place[from].get_or_insert_with(|| {
                source.push(self.source[from]);
                tangents.push(self.tangents[from]);
                source.len() as u32 - 1
            });
        }
        Self { source, tangents, ..self }
    }
}

/// Tangents for plain arrays; missing normals are made as [`Mesh::from_arrays`](crate::Mesh) makes them.
///
/// `quads`: ascending, the triangles `abc` that the next one, `acd`, makes a quad: see
/// [`triangles_of_quads`]. `weld`: one vertex for equal ones, see [`Split::welded`]; otherwise the
/// first vertices of the result are the given ones, and copies follow.
///
/// # Errors
/// [`MeshError::Arrays`] for arrays that make no mesh; [`MeshError::TooLarge`].
pub fn tangents_of_arrays(
    method: FrameMethod,
    arrays: Arrays,
    quads: &[u32],
    weld: bool,
) -> Result<Split, MeshError> {
    let arrays = checked(arrays)?;
    let mut warnings = Vec::new();
    let normals = crate::normals::complete(&arrays, &mut warnings);
    let Arrays { positions, uvs, indices, .. } = &arrays;
    let mut split = Surface { positions, normals: &normals, uvs, indices, quads }.tangents(method)?;
    if weld {
        split = split.welded(&arrays, &normals);
    }
    warnings.append(&mut split.warnings);
    Ok(Split { warnings, ..split })
}

/// Two triangles for each quad, `abc` and `acd`, and which of them begin a quad.
pub fn triangles_of_quads(quads: &[[u32; 4]]) -> (Vec<[u32; 3]>, Vec<u32>) {
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    (triangles, (0..quads.len() as u32).map(|quad| 2 * quad).collect())
}

/// The quads again, from triangles in the order of [`triangles_of_quads`].
pub fn quads_of_triangles(triangles: &[[u32; 3]]) -> Vec<[u32; 4]> {
    triangles.as_chunks::<2>().0.iter().map(|&[[a, b, c], [_, _, d]]| [a, b, c, d]).collect()
}
