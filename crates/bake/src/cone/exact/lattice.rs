//! Heights of texel centres with a margin, so that rows are read in lanes across the edge of the map.

use heightfield::HeightField;

/// Rows are padded to multiples of this, the most lanes there are.
pub(in super::super) const ROUND: usize = 16;

/// Texels that the margin holds on each side, besides room for lanes on the right.
pub(super) const MARGIN: i64 = NEAR + 2;

/// Texels at up to this many columns and rows are compared one by one.
pub(super) const NEAR: i64 = 8;

/// See the module.
pub(in super::super) struct Lattice {
    heights: Vec<f32>,
    stride: usize,
}

impl Lattice {
    pub fn new(field: &HeightField) -> Self {
        let (width, height) = (field.width(), field.height());
        let stride = (width + 2 * MARGIN as usize + 1).next_multiple_of(ROUND) + ROUND;
        let rows = height as i64 + 2 * MARGIN + 1;
        let mut heights = Vec::with_capacity(stride * rows as usize);
        let texels = field.texels();
        let wrap = field.wrap();
        let columns: Vec<usize> = (0..stride as i64).map(|i| wrap.index(i - MARGIN, width)).collect();
        for j in 0..rows {
            let row = &texels[wrap.index(j - MARGIN, height) * width..][..width];
            heights.extend(columns.iter().map(|&i| row[i]));
        }
        Self { heights, stride }
    }

    /// Heights from texel `(i, j)` on; at least as many as there are lanes.
    #[inline(always)]
    pub fn from(&self, i: i64, j: i64) -> &[f32] {
        &self.heights[(j + MARGIN) as usize * self.stride + (i + MARGIN) as usize..]
    }
}

/// Numbers by texel, from column and row -1 to the one behind the last; rows are padded for lanes.
pub(in super::super) struct Plane {
    pub stride: usize,
    pub values: Vec<f32>,
}

impl Plane {
    pub fn new(width: usize, height: usize, value: f32) -> Self {
        let stride = (width + 2).next_multiple_of(ROUND);
        Self { stride, values: vec![value; stride * (height + 2)] }
    }

    /// The row of texel row `j`, from column -1 on.
    #[inline(always)]
    pub fn row(&self, j: i64) -> &[f32] {
        &self.values[(j + 1) as usize * self.stride..][..self.stride]
    }
}
