//! Pictures of several samples a pixel.

use rayon::prelude::*;

use crate::texture::{LINEAR_FROM_BYTE, srgb_byte};

/// Averages squares of `across` x `across` pixels in linear light. Where some of them are transparent, colours count as
/// much as they cover.
///
/// `color`: 8-bit sRGB with alpha of a picture `width` pixels wide, both sides multiples of `across`.
pub(crate) fn resolve(color: &[u8], width: usize, across: usize) -> Vec<u8> {
    let mut resolved = vec![0; color.len() / (across * across)];
    let rows = resolved.par_chunks_mut(4 * width / across);
    rows.zip(color.par_chunks(4 * width * across)).for_each(|(row, samples)| {
        for (x, pixel) in row.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (mut light, mut plain, mut alpha) = ([0.0_f32; 3], [0.0_f32; 3], 0.0);
            for y in 0..across {
                let first = 4 * (y * width + x * across);
                for sample in samples[first..first + 4 * across].as_chunks::<4>().0 {
                    let cover = f32::from(sample[3]) / 255.0;
                    alpha += cover;
                    for c in 0..3 {
                        let linear = LINEAR_FROM_BYTE[usize::from(sample[c])];
                        light[c] += cover * linear;
                        plain[c] += linear;
                    }
                }
            }
            let count = (across * across) as f32;
            for c in 0..3 {
                pixel[c] = srgb_byte(if alpha > 0.0 { light[c] / alpha } else { plain[c] / count });
            }
            pixel[3] = (255.0 * alpha / count).round() as u8;
        }
    });
    resolved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_black_and_half_white_is_half_the_light() {
        let (black, white) = ([0, 0, 0, 255], [255; 4]);
        let picture = [black, white, white, white, white, black, white, white].concat();
        assert_eq!(resolve(&picture, 4, 2), [188, 188, 188, 255, 255, 255, 255, 255]);
    }

    #[test]
    fn what_is_not_there_has_no_colour() {
        let (none, red) = ([0; 4], [255, 0, 0, 255]);
        let picture = [none, red, none, none].concat();
        assert_eq!(resolve(&picture, 2, 2), [255, 0, 0, 64]);
    }
}
