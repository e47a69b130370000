//! Horizon maps on the device: one layer an azimuth, 16-bit floats.

use bake::maps::{Map, Value};
use bake::{Progress, bake_cached};
use half::f16;
use heightfield::HeightField;
use rayon::prelude::*;

use crate::{Device, RenderError};

/// Bakes the horizon of a height field, or takes it out of the cache, and uploads it as a texture array.
pub(crate) fn horizon(
    device: &Device,
    field: &HeightField,
    azimuths: u32,
) -> Result<wgpu::TextureView, RenderError> {
    let (width, height) = (field.width(), field.height());
    let limits = device.device.limits();
    let longest = u64::from(limits.max_texture_dimension_2d);
    Device::check("side of a horizon map, in texels,", width.max(height) as u64, longest)?;
    let layers = u64::from(limits.max_texture_array_layers);
    Device::check("azimuths of a horizon map", u64::from(azimuths), layers)?;
    let map = Map::named("horizon")?;
    let options = map.info.defaults().with("azimuths", Value::Whole(azimuths.into()))?;
    let baked = bake_cached(field, map, &options, Progress::none())?;
    let sines = baked.layers.par_iter().flat_map(|layer| &layer.texels);
    let texels: Vec<u16> = sines.map(|&sine| f16::from_f32(sine).to_bits()).collect();
    let size = wgpu::Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: azimuths };
    let descriptor = wgpu::TextureDescriptor {
        label: Some("horizon"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    device.guard("uploading a horizon map", || {
        let texture = device.device.create_texture(&descriptor);
        device.queue.write_texture(
            texture.as_image_copy(),
            bytemuck::cast_slice(&texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(2 * size.width),
                rows_per_image: Some(size.height),
            },
            size,
        );
        Ok(texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        }))
    })
}
