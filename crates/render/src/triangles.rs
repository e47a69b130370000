//! A mesh as shaders read it that find out for themselves which triangle they see.

use glam::DVec3;
use mesh::Mesh;
use rayon::prelude::*;

use crate::uniforms::MeshVertex;
use crate::{Device, RenderError};

/// Bindings 1 and 2 of group 3, `shaders_wgsl/bindings/triangles.wgsl`.
#[derive(Clone)]
pub(crate) struct Triangles {
    pub vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
}

impl Triangles {
    /// Uploads a mesh whose middle is `centre`.
    pub fn new(device: &Device, mesh: &Mesh, centre: DVec3) -> Result<Self, RenderError> {
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
        let vertices: Vec<MeshVertex> = (0..mesh.positions.len()).into_par_iter().map(vertex).collect();
        let storage = wgpu::BufferUsages::STORAGE;
        Ok(Self {
            vertices: device.buffer_with("mesh vertices", bytemuck::cast_slice(&vertices), storage)?,
            indices: device.buffer_with("mesh triangles", bytemuck::cast_slice(&mesh.indices), storage)?,
        })
    }
}
