//! All solids of a scene, where they stand, and a tree over them.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DMat4, DVec3, Vec3};
use heightfield::HeightField;
use mesh::Mesh;

use super::common::Common;
use super::tree::{Bounds, tree};
use super::{Solid, WIDER};
use crate::device::lock;
use crate::heights::bind;
use crate::layouts::BesideDraw;
use crate::prepare::place_group;
use crate::uniforms::{InstanceInfo, ShellNode};
use crate::{Device, RenderError, Scene, tally};

/// Bindings 1 to 9 of group 3, `shaders_wgsl/bindings/solids.wgsl`.
pub(crate) struct SceneSolids {
    instances: wgpu::Buffer,
    top: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// The solid of each draw of the scene.
    of_draw: Vec<u32>,
    /// Corners of the box around each solid, object space.
    bounds: Vec<[Vec3; 2]>,
}

impl SceneSolids {
    /// Builds what is not yet built, and uploads what is not yet on the device. `middles`: of the mesh of each draw;
    /// `places`: of the draws in a view; `traced`: whether rays will go through the solids.
    pub fn new(
        device: &Device,
        scene: &Scene<'_>,
        middles: &[DVec3],
        places: &wgpu::Buffer,
        traced: bool,
    ) -> Result<Self, RenderError> {
        let mut solids = Vec::new();
        let mut numbers = HashMap::new();
        let mut of_draw = Vec::with_capacity(scene.draws.len());
        for (draw, middle) in scene.draws.iter().zip(middles) {
            let field = &*draw.material.field;
            let made_of = (std::ptr::from_ref::<Mesh>(&draw.mesh), std::ptr::from_ref(field));
            let number = match numbers.get(&(made_of, draw.triangles.clone())) {
                Some(&number) => number,
                None => {
                    solids.push((device.solid(draw, *middle, traced)?, field));
                    numbers.insert((made_of, draw.triangles.clone()), solids.len() - 1);
                    solids.len() - 1
                }
            };
            of_draw.push(number as u32);
        }
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let draws = scene.draws.len().max(1);
        let instances = device.buffer("instances", (draws * size_of::<InstanceInfo>()) as u64, usage)?;
        let top = device.buffer("scene nodes", (2 * draws * size_of::<ShellNode>()) as u64, usage)?;
        let common = device.common(&solids)?;
        let buffers = common.buffers.iter().chain([&instances, &top]);
        let entries = buffers.zip(1..).map(|(buffer, binding)| bind(binding, buffer.as_entire_binding()));
        let group = place_group(device, places, BesideDraw::Solids, entries.collect())?;
        let bounds = solids.iter().map(|(solid, _)| solid.bounds).collect();
        Ok(Self { instances, top, group, of_draw, bounds })
    }

    /// Group 3 of programs that trace rays through shells.
    pub fn group(&self) -> wgpu::BindGroup {
        self.group.clone()
    }

    /// The number of a draw's solid.
    pub fn of_draw(&self, draw: usize) -> u32 {
        self.of_draw[draw]
    }

    /// Corners of the box around a solid, object space.
    pub fn bounds(&self, solid: u32) -> [Vec3; 2] {
        self.bounds[solid as usize]
    }

    /// Places all draws for a view. `relative_from_object`: for each of them, from the centred mesh to camera-relative
    /// world space. Gives each draw's number among the instances.
    pub fn place(&self, device: &Device, relative_from_object: &[DMat4]) -> Result<Vec<u32>, RenderError> {
        let around: Vec<Bounds> = (self.of_draw.iter().zip(relative_from_object))
            .map(|(&solid, place)| around(self.bounds(solid), place))
            .collect();
        let (nodes, order) = tree(&around);
        let mut numbers = vec![0; order.len()];
        let instances: Vec<InstanceInfo> = (order.iter().zip(0..))
            .map(|(&draw, number)| {
                let draw = draw as usize;
                numbers[draw] = number;
                instance(self.of_draw[draw], &relative_from_object[draw])
            })
            .collect();
        let (instances, nodes) = (bytemuck::cast_slice(&instances), bytemuck::cast_slice(&nodes));
        tally::uploaded((instances.len() + nodes.len()) as u64);
        device.guard("placing solids", || {
            device.queue.write_buffer(&self.instances, 0, instances);
            device.queue.write_buffer(&self.top, 0, nodes);
            Ok(())
        })?;
        Ok(numbers)
    }
}

/// The box around an instance, relative to the camera.
fn around(bounds: [Vec3; 2], relative_from_object: &DMat4) -> Bounds {
    let [low, high] = bounds.map(|corner| corner.as_dvec3());
    let corners = (0..8).map(|bits| {
        let side = |axis: usize| if bits >> axis & 1 == 0 { low[axis] } else { high[axis] };
        relative_from_object.transform_point3(DVec3::new(side(0), side(1), side(2))).as_vec3()
    });
    let exact = corners.fold(Bounds::NONE, Bounds::with);
    let far = exact.low.abs().max(exact.high.abs()).max_element();
    let wider = Vec3::splat(far * WIDER + f32::MIN_POSITIVE);
    Bounds { low: exact.low - wider, high: exact.high + wider }
}

fn instance(solid: u32, relative_from_object: &DMat4) -> InstanceInfo {
    let object_from_relative = relative_from_object.inverse();
    InstanceInfo {
        relative_from_object: relative_from_object.as_mat4(),
        object_from_relative: object_from_relative.as_mat4(),
        eye: object_from_relative.w_axis.as_vec4(),
        solid,
        pad_0: 0,
        pad_1: 0,
        pad_2: 0,
    }
}

impl Device {
    /// The common buffers of some solids; those of the last picture, if it had the same.
    fn common(&self, solids: &[(Arc<Solid>, &HeightField)]) -> Result<Common, RenderError> {
        if let Some(common) = lock(&self.solids).common.as_ref().filter(|common| common.holds(solids)) {
            return Ok(common.clone());
        }
        let common = Common::new(self, solids)?;
        lock(&self.solids).common = Some(common.clone());
        Ok(common)
    }
}
