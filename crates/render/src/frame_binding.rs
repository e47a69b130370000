//! Group 0: the camera of a band of a picture, and the lights.

use bytemuck::Zeroable;
use glam::{DVec3, Vec4};

use crate::heights::bind;
use crate::uniforms::{FrameInfo, LightInfo};
use crate::{Camera, Device, Light, RenderError, Request, Scene, tally};

/// Group 0, written anew for each view and band.
pub(crate) struct FrameBinding {
    info: wgpu::Buffer,
    lights: wgpu::Buffer,
    pub group: wgpu::BindGroup,
}

impl FrameBinding {
    /// Room for the lights of a scene.
    pub fn new(device: &Device, scene: &Scene<'_>) -> Result<Self, RenderError> {
        let filled = wgpu::BufferUsages::COPY_DST;
        let uniform = filled | wgpu::BufferUsages::UNIFORM;
        let info = device.buffer("frame", size_of::<FrameInfo>() as u64, uniform)?;
        let size = scene.lights.len().max(1) * size_of::<LightInfo>();
        let lights = device.buffer("lights", size as u64, filled | wgpu::BufferUsages::STORAGE)?;
        let group = device.guard("binding the frame", || {
            Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame"),
                layout: &device.layouts.frame,
                entries: &[bind(0, info.as_entire_binding()), bind(1, lights.as_entire_binding())],
            }))
        })?;
        Ok(Self { info, lights, group })
    }

    /// Places the lights for a view from `eye`.
    pub fn write_lights(&self, device: &Device, scene: &Scene<'_>, eye: DVec3) {
        let lights = light_infos(scene, eye);
        let bytes: &[u8] = bytemuck::cast_slice(&lights);
        tally::uploaded(bytes.len() as u64);
        device.queue.write_buffer(&self.lights, 0, bytes);
    }

    /// Sets the camera for the band of rows that begins at `first_row`.
    pub fn write(
        &self,
        device: &Device,
        scene: &Scene<'_>,
        request: &Request,
        camera: &Camera,
        first_row: u32,
        rows: u32,
    ) {
        let [r, g, b] = scene.ambient;
        let size = [request.width, request.height];
        let directions = camera.pixel_directions(size, first_row);
        let [corner, pixel_right, pixel_down] = directions.map(|direction| direction.extend(0.0).as_vec4());
        let info = FrameInfo {
            clip_from_relative: camera.clip_from_relative(size, first_row, rows).as_mat4(),
            corner,
            pixel_right,
            pixel_down,
            forward: camera.forward().extend(camera.near()).as_vec4(),
            ambient: Vec4::new(r, g, b, 0.0),
            light_count: scene.lights.len() as u32,
            ..FrameInfo::zeroed()
        };
        tally::uploaded(size_of::<FrameInfo>() as u64);
        device.queue.write_buffer(&self.info, 0, bytemuck::bytes_of(&info));
    }
}

/// The lights as the shaders want them; never empty, since a buffer must not be.
pub(crate) fn light_infos(scene: &Scene<'_>, eye: DVec3) -> Vec<LightInfo> {
    let mut infos: Vec<LightInfo> = scene
        .lights
        .iter()
        .map(|light| {
            let (place, color, intensity) = match *light {
                Light::Directional { direction, color, intensity } => {
                    ((-direction.as_dvec3().normalize()).extend(0.0).as_vec4(), color, intensity)
                }
                Light::Point { position, color, intensity } => {
                    ((position - eye).extend(1.0).as_vec4(), color, intensity)
                }
            };
            let [r, g, b] = color;
            LightInfo { place, color: Vec4::new(r, g, b, 0.0) * intensity }
        })
        .collect();
    if infos.is_empty() {
        infos.push(LightInfo { place: Vec4::Z, color: Vec4::ZERO });
    }
    infos
}
