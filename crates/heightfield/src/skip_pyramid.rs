//! Max pyramid whose nodes reach half a cell beyond their borders: for searches that keep positions in
//! floating point and skip empty space.
//!
//! A walk over [`MaxPyramid`](crate::MaxPyramid) must know exactly which node it is in, so it keeps
//! integer ids and steps from border to border. Here a position may be wrong by almost half a cell and
//! the maximum that is read still bounds the surface around the true one: node ids come from rounding
//! the position, and a step may end a little beyond the border instead of on it. The idea of bounds that
//! cover a neighbourhood is that of conservative rasterisation (Hasselgren et al., GPU Gems 2, 2005).

use rayon::prelude::*;

use crate::HeightField;
use crate::pyramid::{halve, larger};

/// Highest points of a quadtree over one period of the map.
///
/// At *depth* `j` the period is cut into `2^bits` equal nodes along each axis, for whatever number of
/// cells: node borders need not be cell borders, so wrapping a node id is one bitwise AND. Depth 0 is one
/// node; at the finest, [`Self::deepest`], a node is 5/6 to 5/3 of a cell wide. The shorter axis of a map
/// that is not square stays whole at the first depths: it has `2^max(0, j - lag)` nodes.
///
/// Node `a` of `n` along an axis of `c` cells covers the positions `a c / n .. (a + 1) c / n` in cell
/// space and at least half a cell on either side, around the border of a repeated map too. On
/// [`Wrap::Clamp`](crate::Wrap::Clamp) the nodes at the border go on for ever: clamp the node id. For sides
/// that are powers of two a finest node holds the maximum of the 4 x 4 corners of the cell and its
/// neighbours.
///
/// All depths lie one after the other, coarsest first, each row by row. Depth `j` with `n` nodes in all
/// starts at `offset_bits & (n - 1)`. That makes 4/3 floats a cell for powers of two, less than 2 for
/// other squares, and at most 2.4 for a map one cell wide.
#[derive(Debug, Clone)]
pub struct SkipPyramid {
    maxima: Vec<f32>,
    lags: [u32; 2],
    deepest: u32,
    offset_bits: u32,
}

impl SkipPyramid {
    /// Builds all depths from the corner heights.
    pub fn build(field: &HeightField) -> Self {
        let bits = field.cells().map(|cells| (cells * 6 / 5).ilog2());
        let deepest = bits[0].max(bits[1]);
        let lags = bits.map(|own| deepest - own);
        let count_bits = |depth: u32| lags.iter().map(|&lag| depth.saturating_sub(lag)).sum::<u32>();
        let offset_bits = (0..deepest).fold(0, |bits, depth| bits | 1 << count_bits(depth));
        let total = offset_bits as usize + (1 << count_bits(deepest));
        let mut pyramid = Self { maxima: vec![0.0; total], lags, deepest, offset_bits };
        pyramid.fill_finest(field);
        for depth in (0..deepest).rev() {
            pyramid.reduce_into(depth);
        }
        pyramid
    }

    /// Maxima of the corners around each node of the finest depth: along x, then along y.
    fn fill_finest(&mut self, field: &HeightField) {
        let [nx, ny] = self.nodes(self.deepest);
        let [columns, rows] = field.cells();
        let corners = field.corners();
        let periodic = field.is_periodic();
        let across: Vec<[usize; 2]> = (0..nx).map(|a| reach(a, nx, columns)).collect();
        let aligned = nx == columns && periodic;
        let mut along_x = vec![0.0_f32; nx * (rows + 1)];
        along_x.par_chunks_mut(nx).enumerate().for_each(|(j, maxima)| {
            let row = &corners[j * (columns + 1)..(j + 1) * (columns + 1)];
            // One corner before the first and as many behind the last as the windows reach.
            let before = if periodic { row[columns - 1] } else { row[0] };
            let behind = |i: usize| if periodic { row[i % columns] } else { row[columns] };
            let extended: Vec<f32> = std::iter::once(before)
                .chain(row.iter().copied())
                .chain((columns + 1..columns + 3).map(behind))
                .collect();
            if aligned {
                for (i, maximum) in maxima.iter_mut().enumerate() {
                    let [a, b, c, d] = [0, 1, 2, 3].map(|k| extended[i + k]);
                    *maximum = larger(larger(a, b), larger(c, d));
                }
            } else {
                for (&[from, to], maximum) in across.iter().zip(maxima) {
                    *maximum = extended[from..to].iter().copied().fold(0.0, larger);
                }
            }
        });
        let offset = self.offset(self.deepest);
        self.maxima[offset..].par_chunks_mut(nx).enumerate().for_each(|(b, maxima)| {
            let [from, to] = reach(b, ny, rows);
            for shifted in from..to {
                let j = match (shifted.checked_sub(1), periodic) {
                    (Some(j), true) => j % rows,
                    (None, true) => rows - 1,
                    (j, false) => j.unwrap_or(0).min(rows),
                };
                for (maximum, &height) in maxima.iter_mut().zip(&along_x[j * nx..(j + 1) * nx]) {
                    *maximum = larger(*maximum, height);
                }
            }
        });
    }

    /// Fills a depth from the next finer one.
    fn reduce_into(&mut self, depth: u32) {
        let [nx, ny] = self.nodes(depth);
        let [finer_x, finer_y] = self.nodes(depth + 1);
        let (from, to) = (self.offset(depth + 1), self.offset(depth));
        let (coarse, fine) = self.maxima.split_at_mut(from);
        let fine = &fine[..finer_x * finer_y];
        coarse[to..to + nx * ny].par_chunks_mut(nx).enumerate().for_each(|(b, maxima)| {
            let (upper, lower) = if finer_y == ny { (b, b) } else { (2 * b, 2 * b + 1) };
            let upper = &fine[upper * finer_x..][..finer_x];
            let lower = &fine[lower * finer_x..][..finer_x];
            if finer_x == nx {
                for ((maximum, &h), &k) in maxima.iter_mut().zip(upper).zip(lower) {
                    *maximum = larger(h, k);
                }
            } else {
                halve(upper, lower, larger, maxima);
            }
        });
    }

    /// The finest depth; depth 0 is one node.
    #[inline(always)]
    pub fn deepest(&self) -> u32 {
        self.deepest
    }

    /// Depths at which the map is still one node wide along each axis; one of the two is 0.
    #[inline(always)]
    pub fn lags(&self) -> [u32; 2] {
        self.lags
    }

    /// Nodes along x and y at a depth: powers of two.
    #[inline(always)]
    pub fn nodes(&self, depth: u32) -> [usize; 2] {
        self.lags.map(|lag| 1 << depth.saturating_sub(lag))
    }

    /// Depth `j` with `n` nodes in all starts at `offset_bits & (n - 1)`.
    #[inline(always)]
    pub fn offset_bits(&self) -> u32 {
        self.offset_bits
    }

    /// Where a depth starts in [`Self::maxima`].
    #[inline(always)]
    pub fn offset(&self, depth: u32) -> usize {
        let [nx, ny] = self.nodes(depth);
        self.offset_bits as usize & (nx * ny - 1)
    }

    /// The maxima of all depths, coarsest first.
    #[inline(always)]
    pub fn maxima(&self) -> &[f32] {
        &self.maxima
    }

    /// The maximum around node `(a, b)` of a depth.
    #[inline(always)]
    pub fn at(&self, depth: u32, a: usize, b: usize) -> f32 {
        self.maxima[self.offset(depth) + b * self.nodes(depth)[0] + a]
    }
}

/// The corners, counted from one before the first, that bound the surface over node `a` of `n` and half
/// a cell around it: `from..to`.
fn reach(a: usize, n: usize, cells: usize) -> [usize; 2] {
    // Half a cell is n parts of 2 n. One corner to the left is index 0, so 1 cell is added: 2 n parts.
    let from = (2 * a * cells + n) / (2 * n);
    let to = (2 * (a + 1) * cells + 3 * n).div_ceil(2 * n);
    [from, to + 1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Wrap;

    const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
    const SIZES: [(usize, usize); 9] =
        [(1, 1), (1, 9), (2, 2), (7, 5), (16, 16), (33, 2), (31, 8), (3, 64), (17, 12)];

    fn map(w: usize, h: usize, wrap: Wrap) -> HeightField {
        let texels: Vec<f32> = (0..w * h).map(|i| ((i * 7919) % 101) as f32 / 101.0).collect();
        HeightField::new(&texels, w, h, wrap).unwrap()
    }

    /// The highest corner between two positions in cell space, by the texels as the wrap mode names them.
    fn highest_between(field: &HeightField, from: [f64; 2], to: [f64; 2]) -> f32 {
        let first = field.first_texel();
        let mut highest = f32::NEG_INFINITY;
        for j in from[1].floor() as i64..=to[1].ceil() as i64 {
            for i in from[0].floor() as i64..=to[0].ceil() as i64 {
                highest = highest.max(field.texel(i + first, j + first));
            }
        }
        highest
    }

    #[test]
    fn finest_nodes_hold_the_corners_up_to_half_a_cell_around_them_and_no_others() {
        for (w, h) in SIZES {
            for wrap in WRAPS {
                let field = map(w, h, wrap);
                let pyramid = SkipPyramid::build(&field);
                let nodes = pyramid.nodes(pyramid.deepest());
                for b in 0..nodes[1] {
                    for a in 0..nodes[0] {
                        let border = |id: [usize; 2], beyond: f64| {
                            [0, 1].map(|k| id[k] as f64 * field.cells()[k] as f64 / nodes[k] as f64 + beyond)
                        };
                        let expected =
                            highest_between(&field, border([a, b], -0.5), border([a + 1, b + 1], 0.5));
                        let got = pyramid.at(pyramid.deepest(), a, b);
                        assert_eq!(got, expected, "{w}x{h} {wrap:?} node ({a}, {b})");
                    }
                }
            }
        }
    }

    #[test]
    fn every_node_bounds_the_surface_half_a_cell_around_it() {
        for (w, h) in SIZES {
            for wrap in WRAPS {
                let field = map(w, h, wrap);
                let pyramid = SkipPyramid::build(&field);
                let first = field.first_texel() as f64;
                for depth in 0..=pyramid.deepest() {
                    let nodes = pyramid.nodes(depth);
                    for b in 0..nodes[1] {
                        for a in 0..nodes[0] {
                            let bound = f64::from(pyramid.at(depth, a, b));
                            for k in 0..64 {
                                let share = [k % 8, k / 8].map(|s| f64::from(s) / 7.0);
                                let [x, y] = [0, 1].map(|axis| {
                                    let size = field.cells()[axis] as f64 / nodes[axis] as f64;
                                    let id = [a, b][axis] as f64;
                                    id * size - 0.5 + share[axis] * (size + 1.0) + first + 0.5
                                });
                                let height = field.height_at(x / w as f64, y / h as f64);
                                assert!(height <= bound + 1e-12, "{w}x{h} {wrap:?} {depth} ({a}, {b})");
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn coarser_nodes_are_the_maximum_of_the_finer_and_nothing_is_stored_twice() {
        for (w, h) in SIZES {
            for wrap in WRAPS {
                let field = map(w, h, wrap);
                let pyramid = SkipPyramid::build(&field);
                assert_eq!(pyramid.nodes(0), [1, 1]);
                let [cx, cy] = field.cells();
                let most = if cx == cy { 2.0 } else { 2.4 };
                assert!(pyramid.maxima().len() as f64 <= most * (cx * cy) as f64);
                let mut end = 0;
                for depth in 0..=pyramid.deepest() {
                    let nodes = pyramid.nodes(depth);
                    assert_eq!(pyramid.offset(depth), end, "{w}x{h} {wrap:?} depth {depth}");
                    end += nodes[0] * nodes[1];
                    if depth == pyramid.deepest() {
                        continue;
                    }
                    let finer = pyramid.nodes(depth + 1);
                    let factor = [finer[0] / nodes[0], finer[1] / nodes[1]];
                    let mut expected = vec![0.0_f32; nodes[0] * nodes[1]];
                    for b in 0..finer[1] {
                        for a in 0..finer[0] {
                            let over = &mut expected[b / factor[1] * nodes[0] + a / factor[0]];
                            *over = over.max(pyramid.at(depth + 1, a, b));
                        }
                    }
                    let from = pyramid.offset(depth);
                    assert_eq!(pyramid.maxima()[from..from + expected.len()], expected);
                }
                assert_eq!(end, pyramid.maxima().len());
            }
        }
    }

    #[test]
    fn a_node_without_its_margin_would_be_noticed() {
        // Negative control: the plain maxima of a cell's own corners do not bound its surroundings.
        let field = map(16, 16, Wrap::Repeat);
        let plain = field.pyramid();
        let lower = (0..256)
            .filter(|k| plain.at(0, k % 16, k / 16) < SkipPyramid::build(&field).at(4, k % 16, k / 16))
            .count();
        assert!(lower > 100, "{lower} of 256");
    }
}
