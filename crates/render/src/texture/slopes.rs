//! The slope map of a height field.

use bake::{Kernel, Progress};
use half::f16;
use heightfield::HeightField;
use rayon::prelude::*;

use super::mips::halve;
use super::upload::MipLevel;
use crate::RenderError;

/// All levels of the slopes `dh/du`, `dh/dv`, height per tile, and of their standard deviations within a texel, as four
/// 16-bit floats.
///
/// Slopes rather than unit normals: their average is the slope of the averaged surface, they need no
/// new bake when the relief's scale changes, and the mesh's own frame turns them into mesh units.
pub(crate) fn slopes(field: &HeightField) -> Result<Vec<MipLevel>, RenderError> {
    let mut size = [field.width(), field.height()];
    let slopes = bake::slopes(field, Kernel::Central, Progress::none())?;
    let mut level: Vec<[f32; 4]> = slopes.into_par_iter().map(|[x, y]| [x, y, x * x, y * y]).collect();
    let mut levels = vec![MipLevel { size, bytes: encode(&level) }];
    while size != [1, 1] {
        let (half, next) = halve(size, |x, y| level[y * size[0] + x]);
        levels.push(MipLevel { size: half, bytes: encode(&next) });
        size = half;
        level = next;
    }
    Ok(levels)
}

/// From means of slopes and of their squares.
fn encode(moments: &[[f32; 4]]) -> Vec<u8> {
    let limit = f32::from(f16::MAX);
    let deviation = |mean: f32, square: f32| (square - mean * mean).max(0.0).sqrt();
    moments
        .par_iter()
        .flat_map_iter(|&[x, y, xx, yy]| {
            let stored = [x, y, deviation(x, xx), deviation(y, yy)];
            stored.map(|s| f16::from_f32(s.clamp(-limit, limit)).to_le_bytes()).into_iter().flatten()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use heightfield::Wrap;

    use super::*;

    #[test]
    fn levels_know_how_rough_they_are() {
        // Ridges along v: slopes of plus and minus 4 times a sixteenth of the height.
        let texels: Vec<f32> = (0..64).map(|at| f32::from(u8::from(at % 4 >= 2)) * 0.25).collect();
        let field = HeightField::new(&texels, 8, 8, Wrap::Repeat).unwrap();
        let levels = slopes(&field).unwrap();
        let read =
            |level: &MipLevel, c: usize| f16::from_le_bytes([level.bytes[2 * c], level.bytes[2 * c + 1]]);
        let last = levels.last().unwrap();
        assert!(read(last, 0).to_f32().abs() < 1e-3 && read(last, 3).to_f32() < 1e-3);
        // Every texel is on a flank: central differences of a quarter over two texels.
        assert!((read(last, 2).to_f32() - 0.25 / 2.0 * 8.0).abs() < 1e-2, "{}", read(last, 2));
        assert_eq!(read(&levels[0], 2).to_f32(), 0.0);
    }
}
