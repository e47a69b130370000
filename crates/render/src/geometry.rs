//! Meshes on the device.

use glam::{DVec3, Vec3};
use mesh::{Displaced, Mesh};
use rayon::prelude::*;

use crate::pipeline::ATTRIBUTES;
use crate::walls::{Wall, walls};
use crate::{Device, RenderError};

/// Vertex buffers with their shader locations, in the order in which pipelines take them.
#[derive(Clone, Default)]
pub(crate) struct Attributes(pub Vec<(usize, wgpu::Buffer)>);

/// What is drawn in one call: vertices, and triangles between them.
#[derive(Clone)]
pub(crate) struct Geometry {
    pub attributes: Attributes,
    pub indices: wgpu::Buffer,
}

/// In the number of a triangle: a strip along one of its edges. Twin of `shaders_wgsl/entry/displaced.wgsl`.
const ON_STRIP: u32 = 1 << 31;

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

/// Room that a mesh takes: its middle, to which positions are uploaded relative, and half its diagonal.
#[derive(Debug, Clone)]
pub(crate) struct Room {
    pub middle: DVec3,
    pub radius: f64,
    /// Faces that may hide things.
    pub walls: Vec<Wall>,
}

impl Room {
    pub fn of(mesh: &Mesh) -> Self {
        let (low, high) = bounds(&mesh.positions);
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        Self { middle: (low + high) * 0.5, radius: (high - low).length() * 0.5, walls: walls(mesh) }
    }
}

fn bounds(positions: &[Vec3]) -> (Vec3, Vec3) {
    let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = positions
        .par_iter()
        .fold(|| empty, |(low, high), p| (low.min(*p), high.max(*p)))
        .reduce(|| empty, |a, b| (a.0.min(b.0), a.1.max(b.1)));
    if low.is_finite() { (low, high) } else { (Vec3::ZERO, Vec3::ZERO) }
}

impl Attributes {
    /// Uploads the attributes of a mesh, whose middle is `centre`, at the given shader locations.
    pub fn new(
        device: &Device,
        mesh: &Mesh,
        centre: DVec3,
        locations: &[usize],
    ) -> Result<Self, RenderError> {
        let mut attributes = Self::default();
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
            attributes.add(device, location, bytes)?;
        }
        Ok(attributes)
    }

    fn add(&mut self, device: &Device, location: usize, bytes: &[u8]) -> Result<(), RenderError> {
        let label = ATTRIBUTES[location].0;
        self.0.push((location, device.buffer_with(label, bytes, wgpu::BufferUsages::VERTEX)?));
        Ok(())
    }
}

impl Geometry {
    /// Uploads a box, wound to be seen from outside.
    pub fn cuboid(device: &Device, low: Vec3, high: Vec3) -> Result<Self, RenderError> {
        let corner =
            |bits: u32| Vec3::from([0, 1, 2].map(|axis| [low, high][(bits >> axis & 1) as usize][axis]));
        let corners: [Vec3; 8] = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
        let bytes = bytemuck::cast_slice(&corners);
        let mut attributes = Attributes::default();
        attributes.add(device, 0, bytes)?;
        let indices = device.buffer_with("box", bytemuck::cast_slice(&CUBOID), wgpu::BufferUsages::INDEX)?;
        Ok(Self { attributes, indices })
    }

    /// Uploads micro-polygons.
    pub fn micro(device: &Device, displaced: &Displaced) -> Result<Self, RenderError> {
        let mut attributes = Attributes::default();
        attributes.add(device, 0, bytemuck::cast_slice(&displaced.positions))?;
        let mut faces = displaced.faces.clone();
        faces[displaced.first_strip..].iter_mut().for_each(|face| *face |= ON_STRIP);
        attributes.add(device, 8, bytemuck::cast_slice(&faces))?;
        attributes.add(device, 9, bytemuck::cast_slice(&displaced.weights))?;
        let bytes = bytemuck::cast_slice(&displaced.indices);
        let indices = device.buffer_with("micro-triangles", bytes, wgpu::BufferUsages::INDEX)?;
        Ok(Self { attributes, indices })
    }
}
