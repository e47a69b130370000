//! Height fields on the device: group 1 of every search.

use std::sync::Arc;

use bake::Progress;
use bytemuck::Zeroable;
use heightfield::technique::Reads;
use heightfield::{BakedMap, ConeMap, HeightField};

use crate::bounds::Bounds;
use crate::texture::{MipLevel, sampler, upload};
use crate::uniforms::{DistanceInfo, HeightInfo, wrap_code};
use crate::uploads::{Ground, Kind, Resource};
use crate::{Device, RenderError, tally};

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
        bounds_depth: Bounds::depth_of(field),
        ..HeightInfo::zeroed()
    };
    if with_pyramid {
        let pyramid = field.skip_pyramid();
        info.highest = pyramid.at(0, 0, 0);
        info.deepest = pyramid.deepest();
        info.lags = pyramid.lags();
        info.offset_bits = pyramid.offset_bits();
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
        let make = || self.make_field_group(field, reads).map(Resource::Group);
        let (resource, _) = self.keep(field, Kind::Field(reads), make)?;
        match resource {
            Resource::Group(group) => Ok(group),
            _ => Err(RenderError::Device {
                during: "looking up a height field",
                message: "something else was kept in its place".to_owned(),
            }),
        }
    }

    /// What rays can meet over a field, uploaded once a field; `None`: one node that says nothing.
    pub(crate) fn ground(&self, field: Option<&Arc<HeightField>>) -> Result<Ground, RenderError> {
        let upload = |nodes: &[u32]| {
            self.buffer_with("bounds", bytemuck::cast_slice(nodes), wgpu::BufferUsages::STORAGE)
        };
        let Some(field) = field else {
            let nodes = upload(&Bounds::UNKNOWN)?;
            return Ok(Ground { nodes, span: [0.0, 1.0] });
        };
        let make = || {
            let bounds = Bounds::of(field);
            let nodes = upload(bounds.nodes())?;
            Ok(Resource::Ground(Ground { nodes, span: bounds.span() }))
        };
        match self.keep(field, Kind::Bounds, make)?.0 {
            Resource::Ground(ground) => Ok(ground),
            _ => Err(RenderError::Device {
                during: "looking up bounds",
                message: "something else was kept in their place".to_owned(),
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
        let layout = match reads {
            Reads::Heights => &self.layouts.heights,
            Reads::Pyramid => &self.layouts.pyramid,
            Reads::Cone | Reads::ConeTexel | Reads::RelaxedCone | Reads::RelaxedConeTexel => {
                bake::provide_for(field, reads, Progress::none())?;
                // Empty cones first, relaxed ones behind them.
                let mut values = Vec::new();
                for &map in reads.baked() {
                    if let BakedMap::Cone(kind) = map {
                        values.extend_from_slice(field.cone_map(kind).map_or(&[][..], ConeMap::values));
                    }
                }
                return self.cells_group(field, &info, bytemuck::cast_slice(&values));
            }
            Reads::Distance => {
                bake::provide_for(field, reads, Progress::none())?;
                return self.cells_group(field, &info, &distances(field));
            }
        };
        let level = MipLevel {
            size: [field.width(), field.height()],
            bytes: bytemuck::cast_slice(&field.texels()).to_vec(),
        };
        let view = upload(self, "heights", wgpu::TextureFormat::R32Float, &[level], false)?;
        let filtered = reads == Reads::Heights && !self.manual_bilinear;
        let sampler = sampler(self, field.wrap(), filtered);
        let mut entries = vec![
            bind(0, wgpu::BindingResource::TextureView(&view)),
            bind(1, wgpu::BindingResource::Sampler(&sampler)),
            bind(2, info.as_entire_binding()),
        ];
        let maxima = if reads == Reads::Pyramid {
            let maxima = bytemuck::cast_slice(field.skip_pyramid().maxima());
            Some(self.buffer_with("skip pyramid", maxima, wgpu::BufferUsages::STORAGE)?)
        } else {
            None
        };
        entries.extend(maxima.iter().map(|buffer| bind(3, buffer.as_entire_binding())));
        self.guard("binding a height field", || {
            Ok(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("heights"),
                layout,
                entries: &entries,
            }))
        })
    }

    /// Group 1 of searches that walk from cell to cell: corners, what goes with the cells, and the info.
    fn cells_group(
        &self,
        field: &HeightField,
        info: &wgpu::Buffer,
        values: &[u8],
    ) -> Result<wgpu::BindGroup, RenderError> {
        let storage = wgpu::BufferUsages::STORAGE;
        let corners = self.buffer_with("corners", bytemuck::cast_slice(field.corners()), storage)?;
        let values = self.buffer_with("cells", values, storage)?;
        self.guard("binding a height field", || {
            Ok(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("cells"),
                layout: &self.layouts.cells,
                entries: &[
                    bind(0, corners.as_entire_binding()),
                    bind(1, values.as_entire_binding()),
                    bind(2, info.as_entire_binding()),
                ],
            }))
        })
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
        tally::uploaded(bytes.len() as u64);
        Ok(buffer)
    }
}

/// The distance map of a field that has one, as `shaders_wgsl/bindings/distance.wgsl` wants it.
fn distances(field: &HeightField) -> Vec<u8> {
    let Some(map) = field.distance_map() else { return Vec::new() };
    let info = DistanceInfo {
        metric: map.metric().to_array(),
        unit: map.unit(),
        size: map.size().map(|side| side as u32),
        pad_0: 0,
    };
    let mut bytes = bytemuck::bytes_of(&info).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(map.codes()));
    // Two codes make a word.
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// A bind group entry.
pub(crate) fn bind(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}
