//! Heights laid out for lines that run side by side.

use heightfield::Wrap;

use super::{LANES, NEAR};

/// Heights before the first texel of a row and after its last one, so that a lane of them can be read
/// from any place, and a whole row from any place within [`NEAR`] texels.
const MARGIN: usize = LANES + NEAR + 2;

/// Rows of heights along the cross axis, one for each texel of the main axis.
pub(crate) struct Grid {
    heights: Vec<f32>,
    stride: usize,
    cross: usize,
    wrap: Wrap,
}

impl Grid {
    /// From `main` rows of `cross` heights.
    pub fn new(rows: &[f32], main: usize, cross: usize, wrap: Wrap) -> Self {
        let period = if wrap == Wrap::Mirror { 2 * cross } else { cross };
        let stride = period + 2 * MARGIN;
        let mut heights = Vec::with_capacity(main * stride);
        for row in rows.chunks_exact(cross) {
            heights.extend((0..stride).map(|j| row[wrap.index(j as i64 - MARGIN as i64, cross)]));
        }
        Self { heights, stride, cross, wrap }
    }

    /// The texel of the main axis for any whole number.
    #[inline(always)]
    pub fn main(&self, at: i64) -> usize {
        self.wrap.index(at, self.heights.len() / self.stride)
    }

    /// `LANES + 1` heights of row `main` from place `from` of the cross axis, which may be any.
    #[inline(always)]
    pub fn lanes(&self, main: usize, from: i64) -> &[f32; LANES + 1] {
        let n = self.cross as i64;
        let start = match self.wrap {
            Wrap::Repeat => from.rem_euclid(n),
            Wrap::Mirror => from.rem_euclid(2 * n),
            Wrap::Clamp => from.clamp(-(MARGIN as i64), n),
        };
        let at = main * self.stride + (start + MARGIN as i64) as usize;
        self.heights[at..].first_chunk().unwrap_or(&[0.0; LANES + 1])
    }

    /// All of row `main` and one height more, from place `from`, at most `NEAR + 1` from 0.
    #[inline(always)]
    pub fn row(&self, main: usize, from: i64) -> &[f32] {
        let start = (from + MARGIN as i64) as usize;
        &self.heights[main * self.stride + start..][..=self.cross]
    }
}
