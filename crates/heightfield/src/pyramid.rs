//! Max pyramid over the cells of a height field.

use rayon::prelude::*;

use crate::HeightField;

/// One level: the highest corner under each node.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Nodes along x and y.
    pub nodes: [usize; 2],
    /// Where the level starts in [`MaxPyramid::maxima`].
    pub offset: usize,
}

/// Highest points of ever larger blocks of cells.
///
/// Level 0 has a node for each cell, the maximum of its four *corners*: a maximum over texels alone
/// would lie below the bilinear surface between them. Node `a` of level `k` covers cells
/// `a * 2^k` up to `min((a + 1) * 2^k, cells)`, so any size works. The last level is one node.
#[derive(Debug, Clone)]
pub struct MaxPyramid {
    maxima: Vec<f32>,
    levels: Vec<Level>,
    lowest: f32,
}

impl MaxPyramid {
    /// Builds all levels; 4/3 floats a cell.
    pub fn build(field: &HeightField) -> Self {
        let [nx, ny] = field.cells();
        let corners = field.corners();
        let stride = nx + 1;
        let mut levels = Vec::new();
        let mut nodes = [nx, ny];
        let mut total = 0;
        loop {
            levels.push(Level { nodes, offset: total });
            total += nodes[0] * nodes[1];
            if nodes == [1, 1] {
                break;
            }
            nodes = nodes.map(|n| n.div_ceil(2));
        }
        let mut maxima = vec![0.0_f32; total];
        maxima[..nx * ny].par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            let upper = &corners[j * stride..(j + 1) * stride];
            let lower = &corners[(j + 1) * stride..(j + 2) * stride];
            let right = upper[1..].iter().zip(&lower[1..]);
            for (node, ((&a, &b), (&c, &d))) in row.iter_mut().zip(upper.iter().zip(lower).zip(right)) {
                *node = larger(larger(a, b), larger(c, d));
            }
        });
        for pair in levels.windows(2) {
            let (below, above) = (&pair[0], &pair[1]);
            let (source, target) = maxima.split_at_mut(above.offset);
            let source = &source[below.offset..];
            let [w, h] = below.nodes;
            target[..above.nodes[0] * above.nodes[1]].par_chunks_mut(above.nodes[0]).enumerate().for_each(
                |(b, row)| {
                    let upper = &source[2 * b * w..][..w];
                    let lower = &source[(2 * b + 1).min(h - 1) * w..][..w];
                    halve(upper, lower, larger, row);
                },
            );
        }
        let lowest = corners.par_chunks(stride).map(lowest_of).reduce(|| f32::INFINITY, smaller);
        Self { maxima, levels, lowest }
    }

    /// All levels, finest first.
    #[inline(always)]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// The maxima of all levels one after the other, each row by row.
    #[inline(always)]
    pub fn maxima(&self) -> &[f32] {
        &self.maxima
    }

    /// The maximum under node `(a, b)` of a level.
    #[inline(always)]
    pub fn at(&self, level: usize, a: usize, b: usize) -> f32 {
        let level = &self.levels[level];
        self.maxima[level.offset + b * level.nodes[0] + a]
    }

    /// The highest point of the field.
    #[inline(always)]
    pub fn highest(&self) -> f32 {
        self.maxima[self.maxima.len() - 1]
    }

    /// The lowest point of the field.
    #[inline(always)]
    pub fn lowest(&self) -> f32 {
        self.lowest
    }
}

/// The larger of two numbers that are not NaN; compiles to one instruction, unlike [`f32::max`].
#[inline(always)]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers that are not NaN.
#[inline(always)]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// What `chosen` leaves of each two by two numbers of two rows; the last may be alone in its row.
#[inline(always)]
pub(crate) fn halve(upper: &[f32], lower: &[f32], chosen: fn(f32, f32) -> f32, to: &mut [f32]) {
    let ((upper, upper_last), (lower, lower_last)) = (upper.as_chunks::<2>(), lower.as_chunks::<2>());
    for (to, (&[a, b], &[c, d])) in to.iter_mut().zip(upper.iter().zip(lower)) {
        *to = chosen(chosen(a, b), chosen(c, d));
    }
    if let ([a], [b], Some(to)) = (upper_last, lower_last, to.last_mut()) {
        *to = chosen(*a, *b);
    }
}

/// The least of a row, many at a time.
fn lowest_of(row: &[f32]) -> f32 {
    let (chunks, rest) = row.as_chunks::<16>();
    let mut least = [f32::INFINITY; 16];
    for chunk in chunks {
        for (least, &height) in least.iter_mut().zip(chunk) {
            *least = smaller(*least, height);
        }
    }
    least.into_iter().chain(rest.iter().copied()).fold(f32::INFINITY, smaller)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Wrap;

    #[test]
    fn every_node_is_the_maximum_of_the_corners_below_it() {
        for (w, h) in [(1, 1), (1, 9), (7, 5), (16, 16), (33, 2)] {
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                let texels: Vec<f32> = (0..w * h).map(|i| ((i * 7919) % 101) as f32 / 101.0).collect();
                let field = HeightField::new(&texels, w, h, wrap).unwrap();
                let pyramid = field.pyramid();
                let [nx, ny] = field.cells();
                for (k, level) in pyramid.levels().iter().enumerate() {
                    for b in 0..level.nodes[1] {
                        for a in 0..level.nodes[0] {
                            let first = field.first_texel();
                            let mut highest = 0.0_f32;
                            for j in b << k..=((b + 1) << k).min(ny) {
                                for i in a << k..=((a + 1) << k).min(nx) {
                                    let x = wrap.index(i as i64 + first, w);
                                    let y = wrap.index(j as i64 + first, h);
                                    highest = highest.max(texels[y * w + x]);
                                }
                            }
                            assert_eq!(pyramid.at(k, a, b), highest, "{w}x{h} {wrap:?} level {k} ({a}, {b})");
                        }
                    }
                }
                assert_eq!(pyramid.levels().last().unwrap().nodes, [1, 1]);
            }
        }
    }
}
