//! Slopes of a height field at its texel centres.

use heightfield::HeightField;

use crate::rows::{Block, Fill, for_each_row};
use crate::{BakeError, Kernel, Progress};

/// Slopes `[dh/du, dh/dv]` at the texel centres, height per tile, `u` right and `v` **down**.
///
/// `height * width` pairs, row by row. Multiply by `scale / tile_size` for mesh units.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn slopes(
    field: &HeightField,
    kernel: Kernel,
    mut progress: Progress<'_>,
) -> Result<Vec<[f32; 2]>, BakeError> {
    let fill = Slopes { size: [field.width() as f32, field.height() as f32] };
    let mut slopes = vec![[0.0; 2]; field.width() * field.height()];
    for_each_row(field, kernel, &mut slopes, &mut progress, &fill)?;
    Ok(slopes)
}

struct Slopes {
    size: [f32; 2],
}

impl Fill for Slopes {
    type Sample = [f32; 2];
    const SAMPLES: usize = 1;

    #[inline(always)]
    fn fill(&self, block: &Block<'_>, out: &mut [[f32; 2]]) {
        for ((slope, gx), gy) in out.iter_mut().zip(block.gx).zip(block.gy) {
            *slope = [gx * self.size[0], gy * self.size[1]];
        }
    }
}
