//! A mesh as shaders read it that find out for themselves which triangle they see.

use std::collections::HashMap;
use std::ops::Range;

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
    /// Of triangles that are cut, the numbers of their pieces, which follow all triangles.
    pub pieces: HashMap<u32, Range<u32>>,
}

/// A sheet's number with a bit for each edge beyond which it goes on.
pub(crate) fn beyond(sheet: u32, goes_on: [bool; 3]) -> u32 {
    let number = sheet & ((1 << GOES_ON) - 1);
    (0..3).fold(number, |sum, edge| sum | u32::from(goes_on[edge]) << (GOES_ON + edge))
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
            [a, b, c, beyond(sheets.of[face], sheets.goes_on[face])]
        };
        let triangles = (0..mesh.indices.len()).map(triangle).collect();
        let mut arrays = Self { vertices, triangles, pieces: HashMap::new() };
        arrays.cut(&sheets.goes_on);
        arrays
    }
}
