//! The parts of several solids one after the other in common buffers.

use std::sync::{Arc, Weak};

use bytemuck::Pod;
use heightfield::HeightField;

use super::Solid;
use crate::heights::height_info;
use crate::uniforms::{MeshVertex, ShellNode, ShellPrism, SolidInfo};
use crate::{Device, RenderError};

/// Bindings 1 to 7 of group 3, `shaders_wgsl/bindings/solids.wgsl`.
#[derive(Clone)]
pub(super) struct Common {
    of: Vec<Weak<Solid>>,
    pub buffers: [wgpu::Buffer; 7],
}

/// Slices that follow each other in one buffer, and where they begin.
struct Run<'a, T> {
    slices: Vec<&'a [T]>,
    length: usize,
}

impl<'a, T: Pod> Run<'a, T> {
    fn new() -> Self {
        Self { slices: Vec::new(), length: 0 }
    }

    /// Appends a slice, once however often it comes; gives its first number.
    fn add(&mut self, slice: &'a [T]) -> u32 {
        let mut at = 0;
        for known in &self.slices {
            if std::ptr::eq(*known, slice) && !slice.is_empty() {
                return at as u32;
            }
            at += known.len();
        }
        self.slices.push(slice);
        self.length += slice.len();
        at as u32
    }

    fn upload(self, device: &Device, label: &'static str) -> Result<wgpu::Buffer, RenderError> {
        // A binding must hold at least one element.
        let size = (self.length.max(1) * size_of::<T>()) as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let buffer = device.buffer(label, size, usage)?;
        device.guard("uploading meshes and shells", || {
            let mut offset = 0;
            for slice in &self.slices {
                device.queue.write_buffer(&buffer, offset, bytemuck::cast_slice(slice));
                offset += size_of_val(*slice) as u64;
            }
            Ok(())
        })?;
        Ok(buffer)
    }
}

impl Common {
    /// Whether all that is in the buffers still exists.
    pub fn is_alive(&self) -> bool {
        self.of.iter().all(|solid| solid.strong_count() > 0)
    }

    /// Whether these are the buffers of those solids.
    pub fn holds(&self, solids: &[(Arc<Solid>, &HeightField)]) -> bool {
        let same = |(kept, (solid, _)): (&Weak<Solid>, &(Arc<Solid>, &HeightField))| {
            std::ptr::eq(kept.as_ptr(), Arc::as_ptr(solid))
        };
        self.of.len() == solids.len() && self.of.iter().zip(solids).all(same)
    }

    /// Uploads solids with their heights.
    pub fn new(device: &Device, solids: &[(Arc<Solid>, &HeightField)]) -> Result<Self, RenderError> {
        let mut vertices = Run::<MeshVertex>::new();
        let mut triangles = Run::<[u32; 4]>::new();
        let mut nodes = Run::<ShellNode>::new();
        let mut prisms = Run::<ShellPrism>::new();
        let mut strips = Run::<[u32; 4]>::new();
        let mut heights = Run::<f32>::new();
        let mut infos = Vec::with_capacity(solids.len());
        for (solid, field) in solids {
            let [low, high] = solid.bounds;
            let maxima = if solid.nodes.is_empty() { &[] } else { field.skip_pyramid().maxima() };
            infos.push(SolidInfo {
                heights: height_info(field, true),
                nodes: nodes.add(&solid.nodes),
                prisms: prisms.add(&solid.prisms),
                strips: strips.add(&solid.strips),
                vertices: vertices.add(&solid.arrays.vertices),
                triangles: triangles.add(&solid.arrays.triangles),
                corners: heights.add(field.corners()),
                pyramid: heights.add(maxima),
                endless: u32::from(!field.is_periodic()),
                period: heightfield::march::period(field.wrap()) as f32,
                radius: low.abs().max(high.abs()).max_element(),
                pad_0: 0,
                pad_1: 0,
            });
        }
        let storage = wgpu::BufferUsages::STORAGE;
        Ok(Self {
            of: solids.iter().map(|(solid, _)| Arc::downgrade(solid)).collect(),
            buffers: [
                vertices.upload(device, "mesh vertices")?,
                triangles.upload(device, "mesh triangles")?,
                nodes.upload(device, "shell nodes")?,
                prisms.upload(device, "shell prisms")?,
                strips.upload(device, "shell strips")?,
                heights.upload(device, "heights of solids")?,
                device.buffer_with("solids", bytemuck::cast_slice(&infos), storage)?,
            ],
        })
    }
}
