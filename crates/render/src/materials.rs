//! Group 2: a material with the maps that a program reads of it, baked and uploaded when they are first needed.

use glam::Vec4;

use crate::heights::bind;
use crate::layouts::MaterialMaps;
use crate::request::Program;
use crate::texture;
use crate::uniforms::{HorizonInfo, MaterialInfo, wrap_code};
use crate::uploads::{Kind, Resource};
use crate::{Device, HorizonShadows, Material, RenderError, Stats};

/// All that makes one group different from another: materials that look alike share theirs.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct MaterialKey {
    owners: [usize; 3],
    numbers: [u32; 6],
    maps: MaterialMaps,
    eight_bits: bool,
    horizon: bool,
}

fn address<T>(owner: Option<&std::sync::Arc<T>>) -> usize {
    owner.map_or(0, |owner| std::sync::Arc::as_ptr(owner) as usize)
}

impl MaterialKey {
    pub fn new(material: &Material, program: Program) -> Self {
        let [r, g, b, a] = material.albedo_factor;
        Self {
            owners: [
                address(Some(&material.field)),
                address(material.albedo.as_ref()),
                address(material.normal.as_ref()),
            ],
            numbers: [r, g, b, a, material.specular, material.shininess].map(f32::to_bits),
            maps: program.maps,
            eight_bits: program.surface == "dot3",
            horizon: program.horizon,
        }
    }
}

/// Makes the group.
pub(crate) fn material_group(
    device: &Device,
    material: &Material,
    program: Program,
    horizon: Option<HorizonShadows>,
    stats: &mut Stats,
) -> Result<wgpu::BindGroup, RenderError> {
    let field = &material.field;
    let extent = field.extent();
    let info = MaterialInfo {
        albedo_factor: Vec4::from(material.albedo_factor),
        map_width: field.width() as f32,
        map_height: field.height() as f32,
        scale: extent.scale,
        base: extent.base,
        specular: material.specular,
        shininess: material.shininess,
        period: heightfield::march::period(field.wrap()) as f32,
        wrap: wrap_code(field.wrap()),
    };
    let info = device.buffer_with("material", bytemuck::bytes_of(&info), wgpu::BufferUsages::UNIFORM)?;
    let albedo = match &material.albedo {
        Some(image) => {
            view(device.keep(image, Kind::Albedo, || {
                let levels = texture::albedo(image);
                texture::upload(device, "albedo", wgpu::TextureFormat::Rgba8UnormSrgb, &levels, false)
                    .map(Resource::View)
            })?)?
            .0
        }
        None => device.keep_white(|| {
            texture::upload(device, "white", wgpu::TextureFormat::Rgba8UnormSrgb, &texture::white(), false)
        })?,
    };
    let sampler = texture::sampler(device, field.wrap(), true);
    let map = if program.maps == MaterialMaps::None {
        None
    } else {
        Some(surface_map(device, material, program, stats)?)
    };
    let cube =
        if program.maps == MaterialMaps::MapAndCube {
            let levels = texture::normalization_cube();
            Some(device.keep_cube(|| {
                texture::upload(device, "cube", wgpu::TextureFormat::Rgba8Unorm, &levels, true)
            })?)
        } else {
            None
        };
    let cube_sampler = texture::sampler(device, heightfield::Wrap::Clamp, true);

    let mut entries = vec![
        bind(0, info.as_entire_binding()),
        bind(1, wgpu::BindingResource::TextureView(&albedo)),
        bind(2, wgpu::BindingResource::Sampler(&sampler)),
    ];
    if let Some(map) = &map {
        entries.push(bind(3, wgpu::BindingResource::TextureView(map)));
        entries.push(bind(4, wgpu::BindingResource::Sampler(&sampler)));
    }
    if let Some(cube) = &cube {
        entries.push(bind(5, wgpu::BindingResource::TextureView(cube)));
        entries.push(bind(6, wgpu::BindingResource::Sampler(&cube_sampler)));
    }
    let horizon = horizon.filter(|_| program.horizon);
    let horizon = horizon.map(|horizon| HorizonBinding::new(device, material, horizon, stats)).transpose()?;
    if let Some(horizon) = &horizon {
        entries.push(bind(7, wgpu::BindingResource::TextureView(&horizon.map)));
        entries.push(bind(8, wgpu::BindingResource::Sampler(&sampler)));
        entries.push(bind(9, horizon.info.as_entire_binding()));
    }
    device.guard("binding a material", || {
        Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("material"),
            layout: device.layouts.material(program.maps, program.horizon),
            entries: &entries,
        }))
    })
}

/// What shading/shadow_horizon binds.
struct HorizonBinding {
    map: wgpu::TextureView,
    info: wgpu::Buffer,
}

impl HorizonBinding {
    fn new(
        device: &Device,
        material: &Material,
        horizon: HorizonShadows,
        stats: &mut Stats,
    ) -> Result<Self, RenderError> {
        let field = &material.field;
        let HorizonShadows { azimuths, softness } = horizon;
        let (map, made) = view(device.keep(field, Kind::Horizon(azimuths), || {
            texture::horizon(device, field, azimuths).map(Resource::View)
        })?)?;
        stats.maps_baked += u32::from(made);
        let info = HorizonInfo { tile_size: field.extent().tile_size, softness: softness.max(0.0), azimuths };
        let info = device.buffer_with("horizon", bytemuck::bytes_of(&info), wgpu::BufferUsages::UNIFORM)?;
        Ok(Self { map, info })
    }
}

/// The map at binding 3, baked if the device does not have it.
fn surface_map(
    device: &Device,
    material: &Material,
    program: Program,
    stats: &mut Stats,
) -> Result<wgpu::TextureView, RenderError> {
    let field = &material.field;
    let eight_bits = program.surface == "dot3";
    let upload = |label, format, levels: &[texture::MipLevel]| {
        texture::upload(device, label, format, levels, false).map(Resource::View)
    };
    let (view, made) = view(match (&material.normal, eight_bits) {
        (Some(image), false) => device.keep(image, Kind::OwnNormals, || {
            upload("normals", wgpu::TextureFormat::Rgba16Float, &texture::own(image))
        })?,
        (Some(image), true) => device.keep(image, Kind::OwnNormals8Bit, || {
            upload("normals", wgpu::TextureFormat::Rgba8Unorm, &texture::own_8_bit(image))
        })?,
        (None, false) => device.keep(field, Kind::Slopes, || {
            upload("slopes", wgpu::TextureFormat::Rgba16Float, &texture::slopes(field)?)
        })?,
        (None, true) => device.keep(field, Kind::Baked8Bit, || {
            upload("normals", wgpu::TextureFormat::Rgba8Unorm, &texture::baked_8_bit(field)?)
        })?,
    })?;
    stats.maps_baked += u32::from(made && material.normal.is_none());
    Ok(view)
}

fn view((resource, made): (Resource, bool)) -> Result<(wgpu::TextureView, bool), RenderError> {
    match resource {
        Resource::View(view) => Ok((view, made)),
        _ => Err(RenderError::Device {
            during: "looking up a map",
            message: "something else was kept in its place".to_owned(),
        }),
    }
}
