//! The slope map of a height field.

use bake::{Kernel, Progress};
use half::f16;
use heightfield::{HeightField, Wrap};
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
    let first = slopes.par_iter().map(|&[x, y]| [x, y, x * x, y * y]).collect::<Vec<_>>();
    let mut levels = vec![MipLevel { size, bytes: encode(&first) }];
    let mut level = moments(&slopes, size, field.wrap());
    drop((slopes, first));
    while size != [1, 1] {
        let (half, next) = halve(size, |x, y| level[y * size[0] + x]);
        levels.push(MipLevel { size: half, bytes: encode(&next) });
        size = half;
        level = next;
    }
    Ok(levels)
}

/// Slopes at the texels, and the means of their squares over the texels' areas, interpolated as the sampler does: halfway
/// between two slopes that differ they are smaller than at both.
fn moments(slopes: &[[f32; 2]], [width, height]: [usize; 2], wrap: Wrap) -> Vec<[f32; 4]> {
    let beside = |at: usize, side: usize| match wrap {
        Wrap::Repeat => [(at + side - 1) % side, at, (at + 1) % side],
        Wrap::Clamp | Wrap::Mirror => [at.saturating_sub(1), at, (at + 1).min(side - 1)],
    };
    // Mean over a texel of the product of two lines, given before, at and after its middle.
    let product = |a: [f32; 3], b: [f32; 3]| {
        7.0 / 12.0 * a[1] * b[1]
            + (a[1] * (b[0] + b[2]) + b[1] * (a[0] + a[2])) / 12.0
            + (a[0] * b[0] + a[2] * b[2]) / 24.0
    };
    let mut texels = vec![[0.0; 4]; width * height];
    texels.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let rows = beside(y, height).map(|y| &slopes[y * width..(y + 1) * width]);
        for (x, texel) in row.iter_mut().enumerate() {
            let columns = beside(x, width);
            let square = |axis: usize| {
                let [above, here, below] = rows.map(|row| columns.map(|x| row[x][axis]));
                7.0 / 12.0 * product(here, here)
                    + (product(here, above) + product(here, below)) / 6.0
                    + (product(above, above) + product(below, below)) / 24.0
            };
            let [along, down] = rows[1][x];
            *texel = [along, down, square(0), square(1)];
        }
    });
    texels
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
        // Every texel is on a flank: central differences of a quarter over two texels. From each to the next the slope
        // stays as it is or turns around, and is smaller on the way: the mean square is 1 or a third.
        let expected = 0.25 / 2.0 * 8.0 * (2.0_f32 / 3.0).sqrt();
        assert!((read(last, 2).to_f32() - expected).abs() < 1e-2, "{}", read(last, 2));
        assert_eq!(read(&levels[0], 2).to_f32(), 0.0);
    }
}
