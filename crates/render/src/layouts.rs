//! Bind group layouts, made once a device.

use wgpu::{
    BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, BufferBindingType,
    SamplerBindingType, ShaderStages, TextureSampleType, TextureViewDimension,
};

/// What a surface binds in group 2 besides the albedo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MaterialMaps {
    /// Nothing.
    None,
    /// One filtered map at bindings 3 and 4.
    Map,
    /// The map, and the normalisation cube at 5 and 6.
    MapAndCube,
}

/// All layouts.
pub struct Layouts {
    /// Group 0 of the renderer.
    pub frame: BindGroupLayout,
    /// Group 1: heights through a sampler.
    pub heights: BindGroupLayout,
    /// Group 1: heights without filtering, and the skip pyramid.
    pub pyramid: BindGroupLayout,
    /// Group 1: corners, and a buffer that goes with their cells: cone ratios or distances.
    pub cells: BindGroupLayout,
    draw: BindGroupLayout,
    draw_with_bounds: BindGroupLayout,
    draw_with_solids: BindGroupLayout,
    /// Group 0 of the march kernel.
    pub march: BindGroupLayout,
    material: [BindGroupLayout; 3],
    material_with_horizon: [BindGroupLayout; 3],
}

impl Layouts {
    /// Makes the layouts. `filterable`: whether the device filters 32-bit floats.
    pub fn new(device: &wgpu::Device, filterable: bool) -> Self {
        let make = |label: &str, entries: &[BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let seen = ShaderStages::FRAGMENT | ShaderStages::COMPUTE;
        let heights_filter =
            if filterable { SamplerBindingType::Filtering } else { SamplerBindingType::NonFiltering };
        let place = |ty| {
            let place = BindingType::Buffer { ty, has_dynamic_offset: true, min_binding_size: None };
            entry(0, ShaderStages::VERTEX_FRAGMENT, place)
        };
        let own = place(BufferBindingType::Uniform);
        let mut draw = vec![place(BufferBindingType::Storage { read_only: true })];
        draw.extend((1..=9).map(|binding| entry(binding, ShaderStages::FRAGMENT, storage(true))));
        let material = [
            entry(0, ShaderStages::FRAGMENT, uniform()),
            entry(1, ShaderStages::FRAGMENT, texture(true, TextureViewDimension::D2)),
            entry(2, ShaderStages::FRAGMENT, BindingType::Sampler(SamplerBindingType::Filtering)),
            entry(3, ShaderStages::FRAGMENT, texture(true, TextureViewDimension::D2)),
            entry(4, ShaderStages::FRAGMENT, BindingType::Sampler(SamplerBindingType::Filtering)),
            entry(5, ShaderStages::FRAGMENT, texture(true, TextureViewDimension::Cube)),
            entry(6, ShaderStages::FRAGMENT, BindingType::Sampler(SamplerBindingType::Filtering)),
        ];
        let horizon = [
            entry(7, ShaderStages::FRAGMENT, texture(true, TextureViewDimension::D2Array)),
            entry(8, ShaderStages::FRAGMENT, BindingType::Sampler(SamplerBindingType::Filtering)),
            entry(9, ShaderStages::FRAGMENT, uniform()),
        ];
        Self {
            frame: make(
                "frame",
                &[
                    entry(0, ShaderStages::VERTEX_FRAGMENT, uniform()),
                    entry(1, ShaderStages::VERTEX_FRAGMENT, storage(true)),
                ],
            ),
            heights: make(
                "heights",
                &[
                    entry(0, seen, texture(filterable, TextureViewDimension::D2)),
                    entry(1, seen, BindingType::Sampler(heights_filter)),
                    entry(2, seen, uniform()),
                ],
            ),
            pyramid: make(
                "pyramid",
                &[
                    entry(0, seen, texture(false, TextureViewDimension::D2)),
                    entry(1, seen, BindingType::Sampler(SamplerBindingType::NonFiltering)),
                    entry(2, seen, uniform()),
                    entry(3, seen, storage(true)),
                ],
            ),
            cells: make(
                "cells",
                &[entry(0, seen, storage(true)), entry(1, seen, storage(true)), entry(2, seen, uniform())],
            ),
            draw: make("draw", &[own]),
            draw_with_bounds: make(
                "draw with the bounds of its ground",
                &[own, entry(BOUNDS, ShaderStages::FRAGMENT, storage(true))],
            ),
            draw_with_solids: make("draw among solids", &draw),
            march: make(
                "march",
                &[
                    entry(0, ShaderStages::COMPUTE, storage(true)),
                    entry(1, ShaderStages::COMPUTE, storage(false)),
                ],
            ),
            material: [
                make("material", &material[..3]),
                make("material with a map", &material[..5]),
                make("material with a map and a cube", &material),
            ],
            material_with_horizon: [3, 5, 7]
                .map(|own| make("material with a horizon", &[&material[..own], &horizon].concat())),
        }
    }

    /// The layout of group 3.
    pub fn draw(&self, beside: BesideDraw) -> &BindGroupLayout {
        match beside {
            BesideDraw::Nothing => &self.draw,
            BesideDraw::Bounds => &self.draw_with_bounds,
            BesideDraw::Solids => &self.draw_with_solids,
        }
    }

    /// The layout of group 2; `horizon`: with a horizon map at bindings 7 to 9.
    pub fn material(&self, maps: MaterialMaps, horizon: bool) -> &BindGroupLayout {
        let layouts = if horizon { &self.material_with_horizon } else { &self.material };
        &layouts[match maps {
            MaterialMaps::None => 0,
            MaterialMaps::Map => 1,
            MaterialMaps::MapAndCube => 2,
        }]
    }
}

/// Binding of the bounds in group 3.
pub const BOUNDS: u32 = 10;

/// What an entry binds in group 3 besides the draw itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BesideDraw {
    /// Nothing.
    Nothing,
    /// What rays can meet, at [`BOUNDS`].
    Bounds,
    /// All meshes of the scene and the shells around them, at 1 to 9.
    Solids,
}

impl BesideDraw {
    /// Of an entry.
    pub fn of(entry: &str) -> Self {
        match entry {
            "relief" | "relief_mapped" => Self::Bounds,
            entry if shaders::traces_solids(entry) => Self::Solids,
            _ => Self::Nothing,
        }
    }
}

fn entry(binding: u32, visibility: ShaderStages, ty: BindingType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

fn uniform() -> BindingType {
    BindingType::Buffer { ty: BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None }
}

fn storage(read_only: bool) -> BindingType {
    BindingType::Buffer {
        ty: BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

fn texture(filterable: bool, view_dimension: TextureViewDimension) -> BindingType {
    BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable },
        view_dimension,
        multisampled: false,
    }
}
