//! A renderer that has never heard of relief: one program, meshes under one directional light, and the way back.

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, Mat4, Vec4};
use mesh::Mesh;
use render::{Light, Scene};
use wgpu::util::DeviceExt;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct DrawInfo {
    clip_from_object: Mat4,
    object: Mat4,
    to_light: Vec4,
    light: Vec4,
    ambient: Vec4,
    albedo: Vec4,
    specular: f32,
    shininess: f32,
    pad: [f32; 2],
}

#[derive(Clone)]
struct Buffers {
    positions: wgpu::Buffer,
    normals: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
}

/// A scene on a device of its own, seen from the scene's camera.
pub struct Bare {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    stride: u32,
    draws: Vec<Buffers>,
    color: wgpu::Texture,
    depth: wgpu::TextureView,
    readback: wgpu::Buffer,
    size: [u32; 2],
}

fn device() -> (wgpu::Device, wgpu::Queue) {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let wanted = render::device().unwrap().info().name.clone();
    let adapter = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN))
        .into_iter()
        .find(|adapter| adapter.get_info().name == wanted)
        .unwrap();
    pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor::default())).unwrap()
}

fn upload(device: &wgpu::Device, mesh: &Mesh) -> Buffers {
    let buffer = |contents, usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
    };
    Buffers {
        positions: buffer(bytemuck::cast_slice(&mesh.positions), wgpu::BufferUsages::VERTEX),
        normals: buffer(bytemuck::cast_slice(&mesh.normals), wgpu::BufferUsages::VERTEX),
        indices: buffer(bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX),
        count: 3 * mesh.indices.len() as u32,
    }
}

fn pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(include_str!("bare.wgsl").into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let format = wgpu::VertexFormat::Float32x3;
    let attributes = [0, 1].map(|at| [wgpu::VertexAttribute { format, offset: 0, shader_location: at }]);
    let vertices = attributes.each_ref().map(|attributes| {
        let step_mode = wgpu::VertexStepMode::Vertex;
        Some(wgpu::VertexBufferLayout { array_stride: 12, step_mode, attributes })
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &vertices,
        },
        primitive: wgpu::PrimitiveState { cull_mode: Some(wgpu::Face::Back), ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba8UnormSrgb.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// What the program is told of each draw, `stride` bytes apart.
fn infos(scene: &Scene<'_>, size: [u32; 2], stride: usize) -> Vec<u8> {
    let Light::Directional { direction, color, intensity } = scene.lights[0] else { unreachable!() };
    let clip = scene.camera.clip_from_relative(size, 0, size[1]);
    let [r, g, b] = scene.ambient;
    let mut bytes = Vec::new();
    for draw in &scene.draws {
        let object = DMat4::from_translation(-scene.camera.eye) * draw.world_from_object;
        let info = DrawInfo {
            clip_from_object: (clip * object).as_mat4(),
            object: object.as_mat4(),
            to_light: (-direction.normalize()).extend(0.0),
            light: Vec4::from_array([color[0], color[1], color[2], 0.0]) * intensity,
            ambient: Vec4::new(r, g, b, 0.0),
            albedo: Vec4::from(draw.material.albedo_factor),
            specular: draw.material.specular,
            shininess: draw.material.shininess,
            pad: [0.0; 2],
        };
        bytes.extend_from_slice(bytemuck::bytes_of(&info));
        bytes.resize(bytes.len().next_multiple_of(stride), 0);
    }
    bytes
}

impl Bare {
    /// Uploads a scene of one directional light, all draws of it whole meshes.
    pub fn new(scene: &Scene<'_>, [width, height]: [u32; 2]) -> Self {
        let (device, queue) = device();
        let stride = (size_of::<DrawInfo>() as u32)
            .next_multiple_of(device.limits().min_uniform_buffer_offset_alignment);
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: &infos(scene, [width, height], stride as usize),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: None,
                },
                count: None,
            }],
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer: &uniform,
                    offset: 0,
                    size: std::num::NonZeroU64::new(size_of::<DrawInfo>() as u64),
                }),
            }],
        });
        let mut meshes: HashMap<*const Mesh, Buffers> = HashMap::new();
        let draws = scene.draws.iter().map(|draw| {
            let mesh: &Mesh = &draw.mesh;
            meshes.entry(std::ptr::from_ref(mesh)).or_insert_with(|| upload(&device, mesh)).clone()
        });
        let draws = draws.collect();
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let color = texture(wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureUsages::COPY_SRC);
        let depth = texture(wgpu::TextureFormat::Depth32Float, wgpu::TextureUsages::empty());
        let readback = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * width * height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        assert_eq!(4 * width % wgpu::COPY_BYTES_PER_ROW_ALIGNMENT, 0, "rows without padding");
        Self {
            pipeline: pipeline(&device, &layout),
            depth: depth.create_view(&Default::default()),
            size: [width, height],
            device,
            queue,
            group,
            stride,
            draws,
            color,
            readback,
        }
    }

    /// Draws, and reads the picture back: 8-bit sRGB with alpha.
    pub fn render(&self) -> Vec<u8> {
        let [width, height] = self.size;
        let view = self.color.create_view(&Default::default());
        let mut encoder = self.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &self.depth,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            for (at, draw) in (0..).zip(&self.draws) {
                pass.set_bind_group(0, &self.group, &[at * self.stride]);
                pass.set_vertex_buffer(0, draw.positions.slice(..));
                pass.set_vertex_buffer(1, draw.normals.slice(..));
                pass.set_index_buffer(draw.indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..draw.count, 0, 0..1);
            }
        }
        encoder.copy_texture_to_buffer(
            self.color.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &self.readback,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * width),
                    rows_per_image: None,
                },
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.queue.submit([encoder.finish()]);
        self.readback.slice(..).map_async(wgpu::MapMode::Read, |_| ());
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let picture = self.readback.slice(..).get_mapped_range().unwrap().to_vec();
        self.readback.unmap();
        picture
    }
}
