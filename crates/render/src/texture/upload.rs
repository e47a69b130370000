//! Writing texels to the device.

use heightfield::Wrap;

use crate::{Device, RenderError, tally};

/// One mip level: size and bytes.
pub(crate) struct MipLevel {
    pub size: [usize; 2],
    pub bytes: Vec<u8>,
}

/// Makes a 2-D texture of the given levels, or a cube of six equal ones.
pub(crate) fn upload(
    device: &Device,
    label: &'static str,
    format: wgpu::TextureFormat,
    levels: &[MipLevel],
    cube: bool,
) -> Result<wgpu::TextureView, RenderError> {
    let [width, height] = levels.first().map_or([1, 1], |level| level.size);
    let limit = u64::from(device.device.limits().max_texture_dimension_2d);
    Device::check("side of a map, in texels,", width.max(height) as u64, limit)?;
    let (layers, mips) = if cube { (6, 1) } else { (1, levels.len() as u32) };
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: layers },
        mip_level_count: mips,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let bytes_per_texel = format.block_copy_size(None).unwrap_or(4);
    device.guard("uploading a map", || {
        let texture = device.device.create_texture(&descriptor);
        for (at, level) in levels.iter().enumerate() {
            let [width, height] = level.size.map(|side| side as u32);
            let (mip, layer) = if cube { (0, at as u32) } else { (at as u32, 0) };
            tally::uploaded(level.bytes.len() as u64);
            device.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &texture,
                    mip_level: mip,
                    origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                    aspect: wgpu::TextureAspect::All,
                },
                &level.bytes,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(width * bytes_per_texel),
                    rows_per_image: Some(height),
                },
                wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            );
        }
        let dimension = if cube { wgpu::TextureViewDimension::Cube } else { wgpu::TextureViewDimension::D2 };
        Ok(texture
            .create_view(&wgpu::TextureViewDescriptor { dimension: Some(dimension), ..Default::default() }))
    })
}

/// Most samples along the longer axis of what a pixel covers of a map. Not for devices in software: Mesa goes through
/// all texels of the ellipse that a pixel covers, which never ends where a footprint is next to infinite.
fn anisotropy(device: &Device) -> u16 {
    if device.info().kind == "software" { 1 } else { 16 }
}

/// A sampler that goes on beyond the edge as the height map does. `linear`: filtered, also between levels and, where
/// the view is flat, along what a pixel covers.
pub(crate) fn sampler(device: &Device, wrap: Wrap, linear: bool) -> wgpu::Sampler {
    let address = match wrap {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
    };
    let filter = if linear { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
    device.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("map"),
        address_mode_u: address,
        address_mode_v: address,
        address_mode_w: address,
        mag_filter: filter,
        min_filter: filter,
        anisotropy_clamp: if linear { anisotropy(device) } else { 1 },
        mipmap_filter: if linear { wgpu::MipmapFilterMode::Linear } else { wgpu::MipmapFilterMode::Nearest },
        ..Default::default()
    })
}
