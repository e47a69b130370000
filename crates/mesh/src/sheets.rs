//! Which triangles are parts of one sheet of surface, and where it has borders.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::Mesh;
use crate::frame::weld::first_equal;

/// The one that stands for all that have been joined with `at`.
fn root(joined: &mut [u32], mut at: u32) -> u32 {
    while joined[at as usize] != at {
        joined[at as usize] = joined[joined[at as usize] as usize];
        at = joined[at as usize];
    }
    at
}

/// The sheets of a mesh. Triangles are of one sheet where they share vertices, or vertices that are alike in position,
/// UV and normal, and so are those that are joined by others. Displaced, a sheet is torn only along its borders: seams,
/// hard edges, and where the mesh ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sheets {
    /// For each triangle the number of its sheet: that of one of the sheet's vertices.
    pub of: Vec<u32>,
    /// For each triangle whether the sheet goes on beyond the edges that begin at its corners.
    pub goes_on: Vec<[bool; 3]>,
}

/// Finds the sheets of a mesh.
pub fn sheets(mesh: &Mesh) -> Sheets {
    // Adding zero turns -0 into 0.
    let mut joined = first_equal(mesh.positions.len(), |at| {
        let [x, y, z] = (mesh.positions[at] + Vec3::ZERO).to_array();
        let [u, v] = (mesh.uvs[at] + Vec2::ZERO).to_array();
        let [nx, ny, nz] = (mesh.normals[at] + Vec3::ZERO).to_array();
        [x, y, z, u, v, nx, ny, nz].map(f32::to_bits)
    });
    let goes_on = goes_on(&mesh.indices, &joined);
    for &[a, b, c] in &mesh.indices {
        let first = root(&mut joined, a);
        for other in [b, c] {
            let other = root(&mut joined, other);
            joined[other as usize] = first;
        }
    }
    Sheets { of: mesh.indices.iter().map(|triangle| root(&mut joined, triangle[0])).collect(), goes_on }
}

/// For each edge of each triangle whether another triangle has it too. `like`: for each vertex the first that is alike.
fn goes_on(indices: &[[u32; 3]], like: &[u32]) -> Vec<[bool; 3]> {
    let edge = |face: usize, corner: usize| {
        let triangle = indices[face];
        let ends = [triangle[corner], triangle[(corner + 1) % 3]].map(|end| like[end as usize]);
        ([ends[0].min(ends[1]), ends[0].max(ends[1])], face as u32, corner as u8)
    };
    let faces = 0..indices.len();
    let mut edges: Vec<_> =
        faces.into_par_iter().flat_map_iter(|face| (0..3).map(move |corner| edge(face, corner))).collect();
    edges.par_sort_unstable();
    let mut goes_on = vec![[false; 3]; indices.len()];
    for run in edges.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
        for &(_, face, corner) in run {
            goes_on[face as usize][usize::from(corner)] = true;
        }
    }
    goes_on
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    fn count(mesh: &Mesh) -> usize {
        sheets(mesh).of.into_iter().collect::<HashSet<_>>().len()
    }

    fn borders(mesh: &Mesh) -> usize {
        sheets(mesh).goes_on.iter().flatten().filter(|goes_on| !**goes_on).count()
    }

    #[test]
    fn borders_are_counted_from_both_sides() {
        assert_eq!(borders(&Mesh::quad(1.0).unwrap()), 4);
        assert_eq!(borders(&Mesh::cube(1.0).unwrap()), 24);
        // A seam around, and another across: both sides of each.
        let torus = Mesh::torus(1.0, 0.3, 16, 8).unwrap();
        assert_eq!(borders(&torus), 2 * (16 + 8));
    }

    #[test]
    fn hard_edges_part_sheets_and_open_seams_do_not() {
        assert_eq!(count(&Mesh::quad(1.0).unwrap()), 1);
        assert_eq!(count(&Mesh::cube(1.0).unwrap()), 6);
        assert_eq!(count(&Mesh::sphere(1.0, 16).unwrap()), 1);
        assert_eq!(count(&Mesh::torus(1.0, 0.3, 16, 8).unwrap()), 1);
    }

    #[test]
    fn vertices_need_not_be_shared_to_be_one() {
        let quad = Mesh::quad(1.0).unwrap();
        let alone = |spoil: fn(&mut Mesh)| {
            let mut mesh = quad.clone();
            let order: Vec<usize> = mesh.indices.iter().flatten().map(|&at| at as usize).collect();
            mesh.positions = order.iter().map(|&at| quad.positions[at]).collect();
            mesh.uvs = order.iter().map(|&at| quad.uvs[at]).collect();
            mesh.normals = order.iter().map(|&at| quad.normals[at]).collect();
            mesh.indices = vec![[0, 1, 2], [3, 4, 5]];
            spoil(&mut mesh);
            count(&mesh)
        };
        assert_eq!(alone(|_| ()), 1);
        assert_eq!(alone(|mesh| mesh.uvs[3..].iter_mut().for_each(|uv| *uv += Vec2::X)), 2);
        assert_eq!(alone(|mesh| mesh.normals[3..].fill(Vec3::X)), 2);
        assert_eq!(alone(|mesh| mesh.positions[3..].iter_mut().for_each(|p| p.z += 1.0)), 2);
    }
}
