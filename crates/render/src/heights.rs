//! Height fields on the device: group 1 of every search.

use std::sync::Arc;

use bytemuck::Zeroable;
use heightfield::HeightField;
use heightfield::technique::Reads;

use crate::texture::{MipLevel, sampler, upload};
use crate::uniforms::{HeightInfo, MAX_LEVELS, wrap_code};
use crate::uploads::{Kind, Resource};
use crate::{Device, RenderError};

/// What the shaders need to know about a field. The pyramid's part is filled in when `with_pyramid`.
pub fn height_info(field: &HeightField, with_pyramid: bool) -> HeightInfo {
    let extent = field.extent();
    let mut info = HeightInfo {
        size: [field.width() as f32, field.height() as f32],
        base: extent.base,
        scale: extent.scale,
        tile_size: extent.tile_size,
        wrap: wrap_code(field.wrap()),
        cells: field.cells().map(|side| side as u32),
        first_texel: field.first_texel() as i32,
        ..HeightInfo::zeroed()
    };
    if with_pyramid {
        let pyramid = field.pyramid();
        info.highest = pyramid.highest();
        info.level_count = pyramid.levels().len().min(MAX_LEVELS) as u32;
        for (out, level) in info.levels.iter_mut().zip(pyramid.levels()) {
            *out = [level.nodes[0] as u32, level.nodes[1] as u32, level.offset as u32, 0];
        }
    }
    info
}

impl Device {
    /// Group 1 for a field as a search reads it, uploaded once a field.
    pub(crate) fn field_group(
        &self,
        field: &Arc<HeightField>,
        reads: Reads,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let kind = match reads {
            Reads::Heights => Kind::Heights,
            Reads::Pyramid => Kind::Pyramid,
        };
        let (resource, _) =
            self.keep(field, kind, || self.make_field_group(field, reads).map(Resource::Group))?;
        match resource {
            Resource::Group(group) => Ok(group),
            Resource::View(_) => Err(RenderError::Device {
                during: "looking up a height field",
                message: "a texture was kept in its place".to_owned(),
            }),
        }
    }

    /// Group 1 for a field, not kept.
    pub(crate) fn make_field_group(
        &self,
        field: &HeightField,
        reads: Reads,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let info = self.buffer_with(
            "height info",
            bytemuck::bytes_of(&height_info(field, reads == Reads::Pyramid)),
            wgpu::BufferUsages::UNIFORM,
        )?;
        match reads {
            Reads::Heights => {
                let level = MipLevel {
                    size: [field.width(), field.height()],
                    bytes: bytemuck::cast_slice(&field.texels()).to_vec(),
                };
                let view = upload(self, "heights", wgpu::TextureFormat::R32Float, &[level], false)?;
                let sampler = sampler(self, field.wrap(), !self.manual_bilinear);
                self.guard("binding a height field", || {
                    Ok(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                        label: Some("heights"),
                        layout: &self.layouts.heights,
                        entries: &[
                            bind(0, wgpu::BindingResource::TextureView(&view)),
                            bind(1, wgpu::BindingResource::Sampler(&sampler)),
                            bind(2, info.as_entire_binding()),
                        ],
                    }))
                })
            }
            Reads::Pyramid => {
                let storage = wgpu::BufferUsages::STORAGE;
                let corners = self.buffer_with("corners", bytemuck::cast_slice(field.corners()), storage)?;
                let maxima = bytemuck::cast_slice(field.pyramid().maxima());
                let pyramid = self.buffer_with("pyramid", maxima, storage)?;
                self.guard("binding a height field", || {
                    Ok(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                        label: Some("pyramid"),
                        layout: &self.layouts.pyramid,
                        entries: &[
                            bind(0, corners.as_entire_binding()),
                            bind(1, pyramid.as_entire_binding()),
                            bind(2, info.as_entire_binding()),
                        ],
                    }))
                })
            }
        }
    }

    /// A new buffer.
    pub(crate) fn buffer(
        &self,
        label: &'static str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, RenderError> {
        let limits = self.device.limits();
        let limit = if usage.contains(wgpu::BufferUsages::STORAGE) {
            limits.max_buffer_size.min(limits.max_storage_buffer_binding_size)
        } else {
            limits.max_buffer_size
        };
        Self::check("buffer, in bytes,", size, limit)?;
        self.guard("making a buffer", || {
            Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size.max(4).next_multiple_of(4),
                usage,
                mapped_at_creation: false,
            }))
        })
    }

    /// A new buffer that holds `bytes`.
    pub(crate) fn buffer_with(
        &self,
        label: &'static str,
        bytes: &[u8],
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, RenderError> {
        let buffer = self.buffer(label, bytes.len() as u64, usage | wgpu::BufferUsages::COPY_DST)?;
        self.guard("uploading a buffer", || {
            self.queue.write_buffer(&buffer, 0, bytes);
            Ok(())
        })?;
        Ok(buffer)
    }
}

/// A bind group entry.
pub(crate) fn bind(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}
