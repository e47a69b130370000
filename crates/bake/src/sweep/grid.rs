//! Heights laid out for lines that run side by side.

use heightfield::Wrap;
use rayon::prelude::*;

use super::{LANES, NEAR};

/// Heights before the first texel of a row and after its last one, so that a lane of them can be read
/// from any place, and a whole row from any place within [`NEAR`] texels.
const MARGIN: usize = LANES + NEAR + 2;

/// Places of the cross axis that a strip stands for.
const STRIP: usize = 32;
/// Heights that a strip holds of each row, so that a lane of them can be read from any of its places.
const STRIP_ROW: usize = STRIP + LANES;

/// Rows of heights along the cross axis, one for each texel of the main axis.
pub(crate) struct Grid {
    heights: Vec<f32>,
    stride: usize,
    /// The same heights strip by strip, `[strip][main][place]`: a block of lines goes from row to row, and those of
    /// a strip lie close together.
    strips: Vec<f32>,
    rows: usize,
    cross: usize,
    wrap: Wrap,
}

impl Grid {
    /// From `main` rows of `cross` heights.
    pub fn new(rows: &[f32], main: usize, cross: usize, wrap: Wrap) -> Self {
        let stride = period(cross, wrap) + 2 * MARGIN;
        let mut heights = Vec::with_capacity(main * stride);
        for row in rows.chunks_exact(cross) {
            heights.extend((0..stride).map(|j| row[wrap.index(j as i64 - MARGIN as i64, cross)]));
        }
        let mut strips = vec![0.0; strips(cross, wrap) * main * STRIP_ROW];
        strips.par_chunks_mut(main * STRIP_ROW).enumerate().for_each(|(strip, rows)| {
            for (row, to) in heights.chunks_exact(stride).zip(rows.chunks_exact_mut(STRIP_ROW)) {
                let from = &row[strip * STRIP..];
                let count = from.len().min(STRIP_ROW);
                to[..count].copy_from_slice(&from[..count]);
            }
        });
        Self { heights, stride, strips, rows: main, cross, wrap }
    }

    /// Bytes of a grid.
    pub fn bytes(main: usize, cross: usize, wrap: Wrap) -> u128 {
        let row = period(cross, wrap) + 2 * MARGIN + strips(cross, wrap) * STRIP_ROW;
        (main * size_of::<f32>()) as u128 * row as u128
    }

    /// The texel of the main axis for any whole number.
    #[inline(always)]
    pub fn main(&self, at: i64) -> usize {
        self.wrap.index(at, self.rows)
    }

    /// A number of places of the cross axis, less whole periods.
    pub fn relative(&self, place: i64) -> i32 {
        match self.wrap {
            Wrap::Clamp => place as i32,
            wrap => place.rem_euclid(period(self.cross, wrap) as i64) as i32,
        }
    }

    /// `LANES + 1` heights of row `main` from place `line + place` of the cross axis, both [`Self::relative`].
    #[inline(always)]
    pub fn lanes(&self, main: u32, line: i32, place: i32) -> &[f32; LANES + 1] {
        let (n, from) = (self.cross as i32, line + place);
        let start = match self.wrap {
            Wrap::Repeat => from - if from >= n { n } else { 0 },
            Wrap::Mirror => from - if from >= 2 * n { 2 * n } else { 0 },
            Wrap::Clamp => from.clamp(-(MARGIN as i32), n),
        };
        let place = (start + MARGIN as i32) as usize;
        let at = (place / STRIP * self.rows + main as usize) * STRIP_ROW + place % STRIP;
        self.strips[at..].first_chunk().unwrap_or(&[0.0; LANES + 1])
    }

    /// All of row `main` and one height more, from place `from`, at most `NEAR + 1` from 0.
    #[inline(always)]
    pub fn row(&self, main: usize, from: i64) -> &[f32] {
        let start = (from + MARGIN as i64) as usize;
        &self.heights[main * self.stride + start..][..=self.cross]
    }
}

/// Places after which the heights of a row come again.
fn period(cross: usize, wrap: Wrap) -> usize {
    if wrap == Wrap::Mirror { 2 * cross } else { cross }
}

/// Strips of a row: lines begin up to one place behind the last.
fn strips(cross: usize, wrap: Wrap) -> usize {
    (period(cross, wrap) + MARGIN) / STRIP + 1
}
