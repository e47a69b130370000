//! Colour maps: sRGB, 8 bits, mipmaps averaged in linear light.

use std::sync::LazyLock;

use bake::{Image, Samples};
use rayon::prelude::*;

use super::mips::halve;
use super::upload::MipLevel;

/// Linear light of an sRGB-encoded value in 0..1. IEC 61966-2-1.
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The sRGB encoding of linear light in 0..1. IEC 61966-2-1.
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.0031308 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Linear light of each 8-bit sRGB value.
pub(crate) static LINEAR_FROM_BYTE: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear_from_srgb(byte as f32 / 255.0)));

/// The 8-bit sRGB value of linear light.
pub(crate) fn srgb_byte(linear: f32) -> u8 {
    byte(srgb_from_linear(linear))
}

fn byte(value: f32) -> u8 {
    // NaN becomes 0.
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// All levels of a colour map. Grey maps spread to rgb; alpha is 1 where there is none.
pub(crate) fn albedo(image: &Image) -> Vec<MipLevel> {
    let channels = image.channels;
    let sample = |at: usize| match &image.samples {
        Samples::U8(samples) => samples[at],
        Samples::U16(samples) => byte(f32::from(samples[at]) / 65535.0),
        Samples::F32(samples) => byte(samples[at]),
    };
    let mut size = [image.width, image.height];
    let mut bytes = vec![0_u8; 4 * size[0] * size[1]];
    bytes.par_chunks_mut(4 * size[0]).enumerate().for_each(|(y, row)| {
        for (x, texel) in row.chunks_exact_mut(4).enumerate() {
            let at = (y * image.width + x) * channels;
            let rgba = match channels {
                1 => [sample(at), sample(at), sample(at), 255],
                2 => [sample(at), sample(at), sample(at), sample(at + 1)],
                3 => [sample(at), sample(at + 1), sample(at + 2), 255],
                _ => [sample(at), sample(at + 1), sample(at + 2), sample(at + 3)],
            };
            texel.copy_from_slice(&rgba);
        }
    });
    let mut levels = vec![MipLevel { size, bytes }];
    let mut linear: Vec<[f32; 4]> = Vec::new();
    while size != [1, 1] {
        let (half, next) = if linear.is_empty() {
            let bytes = &levels[0].bytes;
            halve(size, |x, y| {
                let at = 4 * (y * size[0] + x);
                let rgb = |c: usize| LINEAR_FROM_BYTE[usize::from(bytes[at + c])];
                [rgb(0), rgb(1), rgb(2), f32::from(bytes[at + 3]) / 255.0]
            })
        } else {
            halve(size, |x, y| linear[y * size[0] + x])
        };
        let bytes = next
            .par_iter()
            .flat_map_iter(|&[r, g, b, a]| [srgb_byte(r), srgb_byte(g), srgb_byte(b), byte(a)])
            .collect();
        levels.push(MipLevel { size: half, bytes });
        size = half;
        linear = next;
    }
    levels
}

/// One white texel.
pub(crate) fn white() -> Vec<MipLevel> {
    vec![MipLevel { size: [1, 1], bytes: vec![255; 4] }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_goes_there_and_back() {
        for value in 0..=255_u8 {
            assert_eq!(byte(srgb_from_linear(LINEAR_FROM_BYTE[usize::from(value)])), value);
        }
    }

    #[test]
    fn black_and_white_average_to_half_the_light() {
        let image = Image::new(2, 1, 1, Samples::U8(vec![0, 255])).unwrap();
        let levels = albedo(&image);
        assert_eq!(levels[1].bytes, [188, 188, 188, 255]);
    }
}
