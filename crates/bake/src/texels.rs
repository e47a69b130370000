//! Rows of heights, wherever they lie.

use heightfield::{HeightField, Wrap};

use crate::BakeError;
use crate::maps::Grid;

/// Rows of heights by number; any that lie up to [`REACH`] beyond the rows asked for, too.
pub(crate) trait RowSource: Sync {
    /// A row, which has the width of the map.
    fn row(&self, j: i64) -> &[f32];
    /// What lies beyond the first and last column.
    fn wrap(&self) -> Wrap;
}

/// Texels in memory.
#[derive(Debug, Clone, Copy)]
pub struct Texels<'a> {
    heights: &'a [f32],
    size: [usize; 2],
    stride: usize,
    wrap: Wrap,
}

impl<'a> Texels<'a> {
    /// `width * height` heights row by row.
    ///
    /// # Errors
    /// [`BakeError::Shape`].
    pub fn new(heights: &'a [f32], size: [usize; 2], wrap: Wrap) -> Result<Self, BakeError> {
        let [width, height] = size;
        if width == 0 || height == 0 || width.checked_mul(height) != Some(heights.len()) {
            return Err(BakeError::Shape { width, height, channels: 1, got: heights.len() });
        }
        Ok(Self { heights, size, stride: width, wrap })
    }

    /// Those of a height field.
    pub fn of(field: &'a HeightField) -> Self {
        let (stride, first) = (field.cells()[0] + 1, (-field.first_texel()) as usize);
        let heights = &field.corners()[first * stride + first..];
        Self { heights, size: [field.width(), field.height()], stride, wrap: field.wrap() }
    }

    /// Their number and what lies beyond the edge.
    pub fn grid(&self) -> Grid {
        Grid { width: self.size[0], height: self.size[1], wrap: self.wrap }
    }

    /// Width and height.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }
}

impl RowSource for Texels<'_> {
    #[inline(always)]
    fn row(&self, j: i64) -> &[f32] {
        &self.heights[self.wrap.index(j, self.size[1]) * self.stride..][..self.size[0]]
    }

    #[inline(always)]
    fn wrap(&self) -> Wrap {
        self.wrap
    }
}
