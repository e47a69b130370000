//! Meshes on the device.

use glam::{DMat4, DVec3, Vec3};
use mesh::{Displaced, Mesh};
use rayon::prelude::*;

use crate::pipeline::ATTRIBUTES;
use crate::{Device, Draw, RenderError};

/// Vertex and index buffers of a mesh; only the attributes asked for.
pub(crate) struct Geometry {
    pub attributes: [Option<wgpu::Buffer>; ATTRIBUTES.len()],
    pub indices: wgpu::Buffer,
}

/// Triangles of a box whose corners are numbered by a bit for each axis.
pub(crate) const CUBOID: [[u32; 3]; 12] = [
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
];

/// The middle of a mesh. Positions are uploaded relative to it.
pub(crate) fn centre(mesh: &Mesh) -> DVec3 {
    let (low, high) = bounds(&mesh.positions);
    (low.as_dvec3() + high.as_dvec3()) * 0.5
}

fn bounds(positions: &[Vec3]) -> (Vec3, Vec3) {
    let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = positions
        .par_iter()
        .fold(|| empty, |(low, high), p| (low.min(*p), high.max(*p)))
        .reduce(|| empty, |a, b| (a.0.min(b.0), a.1.max(b.1)));
    if low.is_finite() { (low, high) } else { (Vec3::ZERO, Vec3::ZERO) }
}

/// Middle and radius of a ball around a draw in camera-relative world space, relief included.
pub(crate) fn ball(draw: &Draw<'_>, relative_from_object: DMat4) -> (DVec3, f64) {
    let (low, high) = bounds(&draw.mesh.positions);
    let relief = f64::from(draw.material.field.extent().scale);
    let half = (high.as_dvec3() - low.as_dvec3()) * 0.5 + DVec3::splat(relief);
    let stretch = [relative_from_object.x_axis, relative_from_object.y_axis, relative_from_object.z_axis]
        .map(|axis| axis.truncate().length_squared());
    // The Frobenius norm is never less than the longest stretch.
    (relative_from_object.w_axis.truncate(), half.length() * stretch.iter().sum::<f64>().sqrt())
}

impl Geometry {
    /// Uploads a mesh whose middle is `centre`, with the attributes at the given shader locations.
    pub fn new(
        device: &Device,
        mesh: &Mesh,
        centre: DVec3,
        locations: &[usize],
    ) -> Result<Self, RenderError> {
        let mut geometry = Self {
            attributes: Default::default(),
            indices: device.buffer_with(
                "indices",
                bytemuck::cast_slice(&mesh.indices),
                wgpu::BufferUsages::INDEX,
            )?,
        };
        let bend = if locations.contains(&6) { mesh.normal_derivatives() } else { Default::default() };
        for &location in locations {
            let centred: Vec<Vec3>;
            let bytes: &[u8] = match location {
                0 => {
                    centred = mesh.positions.par_iter().map(|p| (p.as_dvec3() - centre).as_vec3()).collect();
                    bytemuck::cast_slice(&centred)
                }
                1 => bytemuck::cast_slice(&mesh.normals),
                2 => bytemuck::cast_slice(&mesh.uvs),
                3 => bytemuck::cast_slice(&mesh.dpdu),
                4 => bytemuck::cast_slice(&mesh.dpdv),
                5 => bytemuck::cast_slice(&mesh.tangents),
                6 => bytemuck::cast_slice(&bend[0]),
                _ => bytemuck::cast_slice(&bend[1]),
            };
            let label = ATTRIBUTES[location].0;
            geometry.attributes[location] =
                Some(device.buffer_with(label, bytes, wgpu::BufferUsages::VERTEX)?);
        }
        Ok(geometry)
    }

    /// Uploads a box, wound to be seen from outside.
    pub fn cuboid(device: &Device, low: Vec3, high: Vec3) -> Result<Self, RenderError> {
        let corner =
            |bits: u32| Vec3::from([0, 1, 2].map(|axis| [low, high][(bits >> axis & 1) as usize][axis]));
        let corners: [Vec3; 8] = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
        let bytes = bytemuck::cast_slice(&corners);
        let mut geometry = Self {
            attributes: Default::default(),
            indices: device.buffer_with("box", bytemuck::cast_slice(&CUBOID), wgpu::BufferUsages::INDEX)?,
        };
        geometry.attributes[0] =
            Some(device.buffer_with("box corners", bytes, wgpu::BufferUsages::VERTEX)?);
        Ok(geometry)
    }

    /// Uploads micro-polygons.
    pub fn micro(device: &Device, displaced: &Displaced) -> Result<Self, RenderError> {
        let vertex = wgpu::BufferUsages::VERTEX;
        let mut geometry = Self {
            attributes: Default::default(),
            indices: device.buffer_with(
                "micro-triangles",
                bytemuck::cast_slice(&displaced.indices),
                wgpu::BufferUsages::INDEX,
            )?,
        };
        for (location, bytes) in [
            (0, bytemuck::cast_slice(&displaced.positions)),
            (8, bytemuck::cast_slice(&displaced.faces)),
            (9, bytemuck::cast_slice(&displaced.weights)),
        ] {
            geometry.attributes[location] =
                Some(device.buffer_with(ATTRIBUTES[location].0, bytes, vertex)?);
        }
        Ok(geometry)
    }
}
