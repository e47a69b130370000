//! What square blocks of cells hold of the surface, and what any rectangle holds.

use heightfield::HeightField;
use rayon::prelude::*;

use super::super::grid::{Stack, push_children, push_roots};

/// Lowest and highest point, and the least and greatest partial derivatives `dh/du`, `dh/dv` per UV unit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ranges {
    pub height: [f32; 2],
    pub gradient: [[f32; 2]; 2],
}

impl Ranges {
    const NONE: Self = Self {
        height: [f32::INFINITY, f32::NEG_INFINITY],
        gradient: [[f32::INFINITY, f32::NEG_INFINITY]; 2],
    };

    fn of_cell([h00, h10, h01, h11]: [f32; 4], [du, dv]: [f32; 2]) -> Self {
        let range = |a: f32, b: f32| [a.min(b), a.max(b)];
        let (upper, lower) = (range(h00, h10), range(h01, h11));
        Self {
            height: [upper[0].min(lower[0]), upper[1].max(lower[1])],
            gradient: [range((h10 - h00) / du, (h11 - h01) / du), range((h01 - h00) / dv, (h11 - h10) / dv)],
        }
    }

    #[inline(always)]
    fn with(&self, other: &Self) -> Self {
        let join = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self {
            height: join(self.height, other.height),
            gradient: [join(self.gradient[0], other.gradient[0]), join(self.gradient[1], other.gradient[1])],
        }
    }
}

/// Blocks of `2^k` by `2^k` cells.
struct Level {
    size: [usize; 2],
    blocks: Vec<Ranges>,
}

/// See the module.
pub(super) struct Blocks {
    levels: Vec<Level>,
    cells: [i64; 2],
    periodic: bool,
}

/// A block with the first and last of its sites.
pub(super) struct Block {
    pub height: [f32; 2],
    pub first: [i64; 2],
    pub last: [i64; 2],
}

/// Bytes for as many cells.
pub(super) fn bytes(cells: u128) -> u128 {
    cells * size_of::<Ranges>() as u128 * 3 / 2
}

impl Blocks {
    pub fn new(field: &HeightField) -> Self {
        let [width, height] = field.cells();
        let (corners, stride) = (field.corners(), width + 1);
        let step = [1.0 / field.width() as f32, 1.0 / field.height() as f32];
        let cell = |[a, b]: [usize; 2]| {
            let at = b * stride + a;
            Ranges::of_cell(
                [corners[at], corners[at + 1], corners[at + stride], corners[at + stride + 1]],
                step,
            )
        };
        let mut levels = vec![Level::new([width, height], cell)];
        while let Some(below) = levels.last().filter(|level| level.size != [1, 1]) {
            let [w, h] = below.size;
            let four = |[a, b]: [usize; 2]| {
                let (left, right) = (2 * a, (2 * a + 1).min(w - 1));
                let (top, bottom) = (2 * b * w, (2 * b + 1).min(h - 1) * w);
                let [upper, lower] =
                    [top, bottom].map(|row| below.blocks[row + left].with(&below.blocks[row + right]));
                upper.with(&lower)
            };
            let next = Level::new([w.div_ceil(2), h.div_ceil(2)], four);
            levels.push(next);
        }
        Self { levels, cells: field.cells().map(|n| n as i64), periodic: field.is_periodic() }
    }

    #[inline(always)]
    pub fn block(&self, level: usize, [a, b]: [usize; 2], origin: [i64; 2]) -> Block {
        let Level { size, blocks } = &self.levels[level];
        let from = [a, b].map(|n| (n << level) as i64);
        let to = [0, 1].map(|axis| (from[axis] + (1 << level)).min(self.cells[axis]) - 1);
        let [first, last] = [from, to].map(|site| [site[0] + origin[0], site[1] + origin[1]]);
        Block { height: blocks[b * size[0] + a].height, first, last }
    }

    /// The whole map and, if it is periodic, its images around it.
    #[inline(always)]
    pub fn roots(&self, stack: &mut Stack) {
        push_roots(stack, self.levels.len() - 1, self.levels[0].size, self.periodic);
    }

    /// The parts of a block.
    #[inline(always)]
    pub fn children(&self, level: usize, node: [usize; 2], origin: [i64; 2], stack: &mut Stack) {
        push_children(stack, level, node, origin, self.levels[level - 1].size);
    }

    /// Ranges of the surface over a rectangle, or wider ones. Positions count cells, from the first one on.
    #[inline(always)]
    pub fn over(&self, [[x0, x1], [y0, y1]]: [[f64; 2]; 2]) -> Ranges {
        let (columns, rows) = (self.on_map(0, x0, x1), self.on_map(1, y0, y1));
        // No run is in more than two blocks.
        let longest = columns.longest().max(rows.longest());
        let level = longest.checked_ilog2().map_or(0, |log| log as usize + 1).min(self.levels.len() - 1);
        let Level { size, blocks } = &self.levels[level];
        let mut ranges = Ranges::NONE;
        for &[top, bottom] in rows.all() {
            for b in top as usize >> level..=bottom as usize >> level {
                for &[left, right] in columns.all() {
                    for a in left as usize >> level..=right as usize >> level {
                        ranges = ranges.with(&blocks[b * size[0] + a]);
                    }
                }
            }
        }
        ranges
    }

    /// The cells on the map that are between two positions of an axis.
    #[inline(always)]
    fn on_map(&self, axis: usize, from: f64, to: f64) -> Runs {
        let n = self.cells[axis];
        let (from, to) = (from.floor() as i64, to.floor() as i64);
        if !self.periodic {
            return Runs::one(from.clamp(0, n - 1), to.clamp(0, n - 1));
        }
        if to - from >= n - 1 {
            return Runs::one(0, n - 1);
        }
        let first = if (0..n).contains(&from) { from } else { from.rem_euclid(n) };
        let last = first + (to - from);
        if last < n {
            Runs::one(first, last)
        } else {
            Runs { runs: [[first, n - 1], [0, last - n]], count: 2 }
        }
    }
}

/// One or two runs of cells, each by its first and last.
struct Runs {
    runs: [[i64; 2]; 2],
    count: usize,
}

impl Runs {
    #[inline(always)]
    fn one(first: i64, last: i64) -> Self {
        Self { runs: [[first, last]; 2], count: 1 }
    }

    #[inline(always)]
    fn all(&self) -> &[[i64; 2]] {
        &self.runs[..self.count]
    }

    #[inline(always)]
    fn longest(&self) -> i64 {
        (self.runs[0][1] - self.runs[0][0]).max(self.runs[1][1] - self.runs[1][0])
    }
}

impl Level {
    fn new(size: [usize; 2], block: impl Fn([usize; 2]) -> Ranges + Sync) -> Self {
        let blocks = (0..size[0] * size[1])
            .into_par_iter()
            .with_min_len(64)
            .map(|at| block([at % size[0], at / size[0]]))
            .collect();
        Self { size, blocks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heightfield::Wrap;

    #[test]
    fn rectangles_hold_no_more_than_their_ranges_say() {
        let (w, h) = (13_usize, 6_usize);
        let texels: Vec<f32> = (0..w * h).map(|i| ((i * 7919) % 101) as f32 / 101.0).collect();
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let field = HeightField::new(&texels, w, h, wrap).unwrap();
            let blocks = Blocks::new(&field);
            let first = field.first_texel() as f64 + 0.5;
            let surface = |x: f64, y: f64| field.height_at((x + first) / w as f64, (y + first) / h as f64);
            let mut narrow = 0;
            for at in 0..2000_usize {
                let number =
                    |k: usize, n: usize| ((at * 8 + k).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40) % n;
                let [x, y] = [1, 2].map(|k| number(k, 60) as f64 * 0.5 - 15.0);
                let [dx, dy] = [3, 4].map(|k| if at % 20 == 0 { 0.0 } else { number(k, 9) as f64 * 0.5 });
                let ranges = blocks.over([[x, x + dx], [y, y + dy]]);
                let [low, high] = ranges.height.map(f64::from);
                let slopes = ranges.gradient.map(|range| range.map(f64::from));
                for (a, b) in (0..=9).flat_map(|a| (0..=9).map(move |b| (a, b))) {
                    let (x, y) = (x + dx * f64::from(a) / 9.0, y + dy * f64::from(b) / 9.0);
                    let height = surface(x, y);
                    assert!((low - 1e-6..=high + 1e-6).contains(&height), "{wrap:?}: {ranges:?}, {height}");
                    // Towards the inside of the cell, where the slope is that of a line.
                    let (i, j) = (x.floor() + 0.5, y.floor() + 0.5);
                    let u = (surface(i + 0.25, y) - surface(i - 0.25, y)) * 2.0 * w as f64;
                    let v = (surface(x, j + 0.25) - surface(x, j - 0.25)) * 2.0 * h as f64;
                    for (slope, [least, most]) in [u, v].into_iter().zip(slopes) {
                        assert!(slope > least - 1e-3 && slope < most + 1e-3, "{wrap:?}: {slopes:?}, {slope}");
                    }
                }
                if dx + dy == 0.0 {
                    // Of one cell nothing is given away.
                    let (i, j) = (x.floor(), y.floor());
                    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
                    let heights = corners.map(|[a, b]| surface(i + a, j + b));
                    let least = heights.into_iter().fold(f64::INFINITY, f64::min);
                    assert!((least - low).abs() < 1e-6, "{wrap:?}: {least} {low}");
                    narrow += 1;
                }
            }
            assert!(narrow > 10, "{narrow}");
        }
    }
}
