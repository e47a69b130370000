//! A mesh as shaders read it that find out for themselves which triangle they see.

use glam::DVec3;
use mesh::Mesh;
use rayon::prelude::*;

use crate::uniforms::MeshVertex;

/// Twin of `GOES_ON` in `shaders_wgsl/bindings/solids.wgsl`. Numbers of vertices stay below: so many would take 48 GB.
const GOES_ON: usize = 29;

/// What a mesh adds to bindings 1 and 2 of group 3, `shaders_wgsl/bindings/solids.wgsl`.
pub(crate) struct MeshArrays {
    pub vertices: Vec<MeshVertex>,
    /// Corners of each triangle; the number of its sheet, and from [`GOES_ON`] on a bit for each edge beyond which the
    /// sheet goes on.
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
        let sheets = mesh::sheets(mesh);
        let triangle = |face: usize| {
            let [a, b, c] = mesh.indices[face];
            let edges = (0..3).map(|edge| u32::from(sheets.goes_on[face][edge]) << (GOES_ON + edge));
            [a, b, c, edges.fold(sheets.of[face], |sum, bit| sum | bit)]
        };
        Self { vertices, triangles: (0..mesh.indices.len()).map(triangle).collect() }
    }
}
