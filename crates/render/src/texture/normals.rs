//! Tangent-space normal maps: the material's own, and the 8-bit one of dot3.

use bake::{Convention, Image, Kernel, Progress, Samples};
use glam::Vec3;
use half::f16;
use heightfield::HeightField;
use rayon::prelude::*;

use super::mips::halve;
use super::upload::MipLevel;
use crate::RenderError;

/// Unit normals of an image. Maps of two channels get the third from the length.
///
/// Integers encode `n * 0.5 + 0.5`. Floats may do so too or be plain vectors: the reading under which
/// they are closer to unit length is taken.
pub fn unit_normals(image: &Image) -> Vec<Vec3> {
    let stored = image.to_f32();
    let float = matches!(image.samples, Samples::F32(_));
    let read = |texel: &[f32], plain: bool| {
        let decode = |value: f32| if plain { value } else { 2.0 * value - 1.0 };
        let (x, y) = (decode(texel[0]), decode(texel[1]));
        let z = if texel.len() > 2 { decode(texel[2]) } else { (1.0 - x * x - y * y).max(0.0).sqrt() };
        Vec3::new(x, y, z)
    };
    let plain = float && {
        if image.channels == 2 {
            stored.iter().any(|value| *value < 0.0)
        } else {
            let deviation = |plain: bool| -> f64 {
                let texels = stored.par_chunks(image.channels);
                texels.map(|texel| f64::from((read(texel, plain).length() - 1.0).abs())).sum()
            };
            deviation(true) < deviation(false)
        }
    };
    stored
        .par_chunks(image.channels)
        .map(|texel| {
            let normal = read(texel, plain).normalize_or(Vec3::Z);
            if normal.is_finite() { normal } else { Vec3::Z }
        })
        .collect()
}

/// All levels of the material's own map, 16-bit floats; the fourth is the length of the mean of unit normals, which
/// tells how much they differ within a texel.
pub(crate) fn own(image: &Image) -> Vec<MipLevel> {
    chain([image.width, image.height], unit_normals(image), |mean| {
        let normal = mean.normalize_or(Vec3::Z);
        let encoded = [normal.x, normal.y, normal.z].map(|c| 0.5 * c + 0.5);
        let [x, y, z] = encoded;
        bytemuck::cast::<_, [u8; 8]>(
            [x, y, z, mean.length().min(1.0)].map(|c| f16::from_f32(c).to_le_bytes()),
        )
    })
}

/// All levels of the material's own map, 8 bits.
pub(crate) fn own_8_bit(image: &Image) -> Vec<MipLevel> {
    chain([image.width, image.height], unit_normals(image), eight_bits)
}

/// All levels of a normal map baked from heights, 8 bits.
pub(crate) fn baked_8_bit(field: &HeightField) -> Result<Vec<MipLevel>, RenderError> {
    let normals = bake::normal_map(field, Kernel::Central, Convention::OpenGl, Progress::none())?;
    let normals = normals.chunks_exact(3).map(Vec3::from_slice).collect();
    Ok(chain([field.width(), field.height()], normals, eight_bits))
}

fn eight_bits(mean: Vec3) -> [u8; 4] {
    let normal = mean.normalize_or(Vec3::Z);
    let stored = |c: f32| ((0.5 * c + 0.5) * 255.0).round() as u8;
    [stored(normal.x), stored(normal.y), stored(normal.z), 255]
}

/// `encode` gets the means of the unit normals in a texel, which are shorter than 1 where those differ.
fn chain<const B: usize>(
    mut size: [usize; 2],
    mut level: Vec<Vec3>,
    encode: impl Fn(Vec3) -> [u8; B] + Sync,
) -> Vec<MipLevel> {
    let bytes = |level: &[Vec3]| level.par_iter().flat_map_iter(|mean| encode(*mean)).collect();
    let mut levels = vec![MipLevel { size, bytes: bytes(&level) }];
    while size != [1, 1] {
        let (half, next) = halve(size, |x, y| level[y * size[0] + x].to_array());
        let next: Vec<Vec3> = next.into_iter().map(Vec3::from).collect();
        levels.push(MipLevel { size: half, bytes: bytes(&next) });
        size = half;
        level = next;
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_are_read_as_what_they_are() {
        let plain = Image::new(1, 1, 3, Samples::F32(vec![0.0, 0.0, 1.0])).unwrap();
        let encoded = Image::new(1, 1, 3, Samples::F32(vec![0.5, 0.5, 1.0])).unwrap();
        let bytes = Image::new(1, 1, 3, Samples::U8(vec![128, 128, 255])).unwrap();
        let two = Image::new(1, 1, 2, Samples::U8(vec![128, 128])).unwrap();
        for image in [plain, encoded, bytes, two] {
            assert!(unit_normals(&image)[0].angle_between(Vec3::Z) < 0.006, "{image:?}");
        }
    }

    #[test]
    fn levels_stay_unit() {
        let image = Image::new(2, 1, 3, Samples::U8(vec![255, 128, 128, 128, 128, 255])).unwrap();
        let levels = own_8_bit(&image);
        let last: Vec<f32> = levels[1].bytes[..3].iter().map(|b| f32::from(*b) / 127.5 - 1.0).collect();
        assert!((Vec3::from_slice(&last).length() - 1.0).abs() < 0.02, "{last:?}");
    }
}
