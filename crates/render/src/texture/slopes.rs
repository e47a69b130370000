//! The slope map of a height field.

use bake::{Kernel, Progress};
use half::f16;
use heightfield::HeightField;
use rayon::prelude::*;

use super::mips::halve;
use super::upload::MipLevel;
use crate::RenderError;

/// All levels of the slopes `dh/du`, `dh/dv`, height per tile, as two 16-bit floats.
///
/// Slopes rather than unit normals: their average is the slope of the averaged surface, they need no
/// new bake when the relief's scale changes, and the mesh's own frame turns them into mesh units.
pub(crate) fn slopes(field: &HeightField) -> Result<Vec<MipLevel>, RenderError> {
    let mut size = [field.width(), field.height()];
    let mut level = bake::slopes(field, Kernel::Central, Progress::none())?;
    let mut levels = vec![MipLevel { size, bytes: encode(&level) }];
    while size != [1, 1] {
        let (half, next) = halve(size, |x, y| level[y * size[0] + x]);
        levels.push(MipLevel { size: half, bytes: encode(&next) });
        size = half;
        level = next;
    }
    Ok(levels)
}

fn encode(slopes: &[[f32; 2]]) -> Vec<u8> {
    let limit = f32::from(f16::MAX);
    slopes
        .par_iter()
        .flat_map_iter(|slope| {
            slope.map(|s| f16::from_f32(s.clamp(-limit, limit)).to_le_bytes()).into_iter().flatten()
        })
        .collect()
}
