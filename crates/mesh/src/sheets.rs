//! Which triangles are parts of one sheet of surface.

use glam::Vec3;

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

/// For each triangle the number of its sheet: triangles are of one sheet where they share vertices, or vertices that
/// are alike in position, UV and normal, and so are those that are joined by others. Displaced, a sheet has no steps;
/// seams that go all around and hard edges part it from others. A number is that of a vertex of the sheet.
pub fn sheets(mesh: &Mesh) -> Vec<u32> {
    // Adding zero turns -0 into 0.
    let mut joined = first_equal(mesh.positions.len(), |at| {
        let [x, y, z] = (mesh.positions[at] + Vec3::ZERO).to_array();
        let [u, v] = (mesh.uvs[at] + glam::Vec2::ZERO).to_array();
        let [nx, ny, nz] = (mesh.normals[at] + Vec3::ZERO).to_array();
        [x, y, z, u, v, nx, ny, nz].map(f32::to_bits)
    });
    for &[a, b, c] in &mesh.indices {
        let first = root(&mut joined, a);
        for other in [b, c] {
            let other = root(&mut joined, other);
            joined[other as usize] = first;
        }
    }
    mesh.indices.iter().map(|triangle| root(&mut joined, triangle[0])).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use glam::Vec2;

    use super::*;

    fn count(mesh: &Mesh) -> usize {
        sheets(mesh).into_iter().collect::<HashSet<_>>().len()
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
