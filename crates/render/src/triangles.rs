//! A mesh as shaders read it that find out for themselves which triangle they see.

use glam::DVec3;
use mesh::Mesh;
use rayon::prelude::*;

use crate::uniforms::MeshVertex;

/// What a mesh adds to bindings 1 and 2 of group 3, `shaders_wgsl/bindings/solids.wgsl`.
pub(crate) struct MeshArrays {
    pub vertices: Vec<MeshVertex>,
    /// Corners of each triangle, and the number of its sheet.
    pub triangles: Vec<[u32; 4]>,
}

impl MeshArrays {
    /// Of a mesh whose middle is `centre`.
    pub fn new(mesh: &Mesh, centre: DVec3) -> Self {
        let [dndu, dndv] = mesh.normal_derivatives();
        let vertex = |at: usize| {
            let (uv, tangent) = (mesh.uvs[at], mesh.tangents[at]);
            MeshVertex {
                place: (mesh.positions[at].as_dvec3() - centre).as_vec3().extend(uv.x),
                up: mesh.normals[at].extend(uv.y),
                dpdu: mesh.dpdu[at].extend(tangent.x),
                dpdv: mesh.dpdv[at].extend(tangent.y),
                dndu: dndu[at].extend(tangent.z),
                dndv: dndv[at].extend(tangent.w),
            }
        };
        let vertices = (0..mesh.positions.len()).into_par_iter().map(vertex).collect();
        let numbered = mesh.indices.iter().zip(mesh::sheets(mesh));
        Self { vertices, triangles: numbered.map(|(&[a, b, c], sheet)| [a, b, c, sheet]).collect() }
    }
}
