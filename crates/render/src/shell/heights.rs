//! Lowest and highest heights over parts of a map.

use std::ops::Range;

use glam::Vec2;
use heightfield::HeightField;

use super::around;

/// Blocks of cells along a side at most.
const MOST_BLOCKS: usize = 64;
/// Blocks that a triangle may cover before it gets the bounds of the whole map.
const MOST_COVERED: usize = 1024;

/// Lowest and highest height of blocks of cells.
pub(super) struct HeightBounds<'a> {
    field: &'a HeightField,
    /// Cells along the sides of a block.
    width: [usize; 2],
    blocks: [usize; 2],
    bounds: Vec<[f32; 2]>,
    all: [f32; 2],
}

fn union(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

const NONE: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

impl<'a> HeightBounds<'a> {
    pub fn new(field: &'a HeightField) -> Self {
        let cells = field.cells();
        let width = cells.map(|side| side.div_ceil(MOST_BLOCKS));
        let blocks = [0, 1].map(|axis| cells[axis].div_ceil(width[axis]));
        let mut bounds = vec![NONE; blocks[0] * blocks[1]];
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                let block = &mut bounds[j / width[1] * blocks[0] + i / width[0]];
                *block = field.cell(i, j).iter().fold(*block, |sum, &height| union(sum, [height; 2]));
            }
        }
        let all = bounds.iter().fold(NONE, |sum, &block| union(sum, block));
        Self { field, width, blocks, bounds, all }
    }

    /// Bounds of the heights over a triangle of texture coordinates.
    pub fn over(&self, uvs: [Vec2; 3]) -> [f32; 2] {
        let [low, high] = around(uvs).map(|uv| uv.as_dvec2().to_array());
        let [across, down] = [0, 1].map(|axis| self.blocks_over(axis, low[axis], high[axis]));
        let covered = |ranges: &[Range<usize>; 2]| ranges[0].len() + ranges[1].len();
        if covered(&across).saturating_mul(covered(&down)) > MOST_COVERED {
            return self.all;
        }
        let mut sum = NONE;
        for j in down.into_iter().flatten() {
            for i in across.iter().cloned().flatten() {
                sum = union(sum, self.bounds[j * self.blocks[0] + i]);
            }
        }
        sum
    }

    /// The blocks along one axis that hold the cells from one texture coordinate to another.
    fn blocks_over(&self, axis: usize, low: f64, high: f64) -> [Range<usize>; 2] {
        let texels = [self.field.width(), self.field.height()][axis] as f64;
        let cells = self.field.cells()[axis] as i64;
        let block = |cell: i64| cell as usize / self.width[axis];
        let cell = |uv: f64| (uv * texels - 0.5 - self.field.first_texel() as f64).floor() as i64;
        // A cell more on each side for what rounding may do.
        let (first, last) = (cell(low).saturating_sub(1), cell(high).saturating_add(1));
        if !self.field.is_periodic() {
            return [block(first.clamp(0, cells - 1))..block(last.clamp(0, cells - 1)) + 1, 0..0];
        }
        if last.saturating_sub(first) >= cells {
            return [0..self.blocks[axis], 0..0];
        }
        let (a, b) = (block(first.rem_euclid(cells)), block(last.rem_euclid(cells)));
        if first.rem_euclid(cells) <= last.rem_euclid(cells) {
            [a..b + 1, 0..0]
        } else {
            [a..self.blocks[axis], 0..b + 1]
        }
    }
}

#[cfg(test)]
mod tests {
    use heightfield::Wrap;

    use super::*;

    #[test]
    fn bounds_hold_every_height_of_a_triangle() {
        for (wrap, side) in [
            (Wrap::Repeat, 200),
            (Wrap::Mirror, 33),
            (Wrap::Clamp, 150),
            (Wrap::Repeat, 7),
            (Wrap::Repeat, 130),
        ] {
            let texels: Vec<f32> = (0..side * side).map(|at| (at * 7919 % 1000) as f32 / 999.0).collect();
            let field = HeightField::new(&texels, side, side, wrap).unwrap();
            let bounds = HeightBounds::new(&field);
            let mut narrower = 0;
            for at in 0..200 {
                let start = Vec2::new((at as f32 * 0.37) % 5.0 - 2.0, (at as f32 * 0.61) % 5.0 - 2.0);
                let uvs = [start, start + Vec2::new(0.013, 0.002), start + Vec2::new(-0.004, 0.017)];
                let [low, high] = bounds.over(uvs);
                narrower += usize::from([low, high] != bounds.all);
                for step in 0..100 {
                    let (a, b) = (f32::from(step as u8 % 10) / 9.0, f32::from(step as u8 / 10) / 9.0);
                    let uv = uvs[0] + (uvs[1] - uvs[0]) * a * (1.0 - b) + (uvs[2] - uvs[0]) * b;
                    let height = field.height_at(f64::from(uv.x), f64::from(uv.y)) as f32;
                    assert!(
                        low <= height && height <= high,
                        "{wrap:?} {side} {uv}: {height} in {low}..{high}"
                    );
                }
            }
            assert!(side < 20 || narrower > 50, "{wrap:?} {side}: {narrower}");
        }
    }
}
