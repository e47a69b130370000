//! Max pyramids with a margin: bounds that hold around a position, not only at it.
//!
//! Maximum mipmaps (Tevs, Ihrke and Seidel, I3D 2008) hold inside a node only, so a ray must know
//! exactly in which it is. Widened by a margin they allow for rounding, and for standing for many rays.

use rayon::prelude::*;

use crate::HeightField;
use crate::pyramid::{Level, MaxPyramid, halve, larger, smaller};

/// The drop from the highest point that is free of surface under each node and around it.
///
/// A node of level `k` covers `2^k` cells a side and says how far a point over it, or up to
/// `2^margin` cells beside it, can be below [`MaxPyramid::highest`] and still be above the surface. Nodes
/// of higher levels are the smallest of their four children. So positions may be off by the margin, by
/// rounding or because they stand for a bundle of rays.
#[derive(Debug, Clone)]
pub struct MarginPyramid {
    drops: Vec<f32>,
    /// Where each level starts in the drops; below the finest, where that starts.
    offsets: [i32; LEVELS],
    /// Nodes along x at each level.
    strides: [i32; LEVELS],
    margin: usize,
    finest: usize,
    top: usize,
}

/// Most levels kept. The coarsest may have more than one node.
pub const LEVELS: usize = 16;

/// The largest margin of [`Margins`], as a level.
const WIDEST: usize = 6;

/// Levels above that of the margin at which a pyramid begins: where two cells across are not free for a
/// ray, single cells are looked at themselves, and finer steps of a bundle gain nothing.
const FINEST: usize = 1;

/// Pyramids of several margins, for bundles of rays of several widths.
#[derive(Debug)]
pub struct Margins {
    pyramids: Vec<MarginPyramid>,
}

impl Margins {
    /// Builds all of them; 0.44 floats a cell.
    pub fn build(field: &HeightField) -> Self {
        let pyramid = field.pyramid();
        let widest = WIDEST.min(pyramid.levels().len() - 1);
        let build = |margin| MarginPyramid::build(field, pyramid, margin);
        Self { pyramids: (0..=widest).into_par_iter().map(build).collect() }
    }

    /// Numbers kept in all.
    pub fn floats(&self) -> usize {
        self.pyramids.iter().map(|pyramid| pyramid.drops.len()).sum()
    }

    /// The one with a margin of one cell.
    #[inline(always)]
    pub fn narrowest(&self) -> &MarginPyramid {
        &self.pyramids[0]
    }

    /// The narrowest whose margin is at least `cells` wide; none when that is too wide for all.
    #[inline(always)]
    pub fn at_least(&self, cells: f32) -> Option<&MarginPyramid> {
        self.pyramids.iter().find(|pyramid| cells <= (1_u32 << pyramid.margin) as f32)
    }
}

/// Taken off every drop, so that `f32` arithmetic on rays never passes a bound: some ulps of 1.
pub const SLACK: f32 = 1e-6;

impl MarginPyramid {
    /// Builds the levels from [`FINEST`] above `margin` on.
    fn build(field: &HeightField, pyramid: &MaxPyramid, margin: usize) -> Self {
        let levels = pyramid.levels();
        let top = (levels.len() - 1).min(LEVELS - 1);
        let margin = margin.min(top);
        let finest = (margin + FINEST).min(top);
        let total: usize = levels[finest..=top].iter().map(|level| level.nodes[0] * level.nodes[1]).sum();
        let mut drops = vec![0.0; levels[finest].nodes[0] * levels[finest].nodes[1]];
        drops.reserve_exact(total - drops.len());
        Widened::new(field, pyramid, margin).fill(&mut drops, levels[finest].nodes[0], finest > margin);
        let (mut offsets, mut strides) = ([0; LEVELS], [0; LEVELS]);
        strides[..=finest].fill(levels[finest].nodes[0] as i32);
        let mut at = 0;
        for (k, pair) in levels[..=top].windows(2).enumerate().skip(finest) {
            let (below, above): (&Level, &Level) = (&pair[0], &pair[1]);
            let next = drops.len();
            drops.resize(next + above.nodes[0] * above.nodes[1], 0.0);
            let (head, tail) = drops.split_at_mut(next);
            reduce(&head[at..], below.nodes, tail, above.nodes);
            at = next;
            offsets[k + 1] = at as i32;
            strides[k + 1] = above.nodes[0] as i32;
        }
        Self { drops, offsets, strides, margin, finest, top }
    }

    /// Free drops of all levels, each row by row.
    #[inline(always)]
    pub fn drops(&self) -> &[f32] {
        &self.drops
    }

    /// The number of the last node.
    #[inline(always)]
    pub fn last(&self) -> i32 {
        self.drops.len() as i32 - 1
    }

    /// Where level `k` starts.
    #[inline(always)]
    pub fn offsets(&self) -> &[i32; LEVELS] {
        &self.offsets
    }

    /// Nodes along x at level `k`.
    #[inline(always)]
    pub fn strides(&self) -> &[i32; LEVELS] {
        &self.strides
    }

    /// The margin is `2^margin` cells wide.
    #[inline(always)]
    pub fn margin(&self) -> usize {
        self.margin
    }

    /// The finest level.
    #[inline(always)]
    pub fn finest(&self) -> usize {
        self.finest
    }

    /// The coarsest level, a single node.
    #[inline(always)]
    pub fn top(&self) -> usize {
        self.top
    }
}

/// The maxima of the level whose nodes are as wide as the margin, over each node and those around it.
struct Widened<'a> {
    source: &'a [f32],
    nodes: [usize; 2],
    highest: f32,
    x: Neighbours,
    y: Neighbours,
}

impl<'a> Widened<'a> {
    fn new(field: &HeightField, pyramid: &'a MaxPyramid, margin: usize) -> Self {
        let base = &pyramid.levels()[margin];
        let [w, h] = base.nodes;
        let [nx, ny] = field.cells();
        let periodic = field.is_periodic();
        Self {
            source: &pyramid.maxima()[base.offset..][..w * h],
            nodes: base.nodes,
            highest: pyramid.highest(),
            x: Neighbours::new(nx, w, margin, periodic),
            y: Neighbours::new(ny, h, margin, periodic),
        }
    }

    /// Writes the drops of these nodes, or of those twice as wide, to rows of `across` nodes.
    fn fill(&self, drops: &mut [f32], across: usize, halved: bool) {
        let [w, h] = self.nodes;
        let scratch = || [vec![0.0; w], vec![0.0; w], vec![0.0; w]];
        drops.par_chunks_mut(across).enumerate().for_each_init(scratch, |[tall, upper, lower], (b, to)| {
            if halved {
                self.row(2 * b, tall, upper);
                self.row((2 * b + 1).min(h - 1), tall, lower);
                halve(upper, lower, larger, to);
            } else {
                self.row(b, tall, to);
            }
            for to in to {
                *to = larger(self.highest - *to - SLACK, 0.0);
            }
        });
    }

    /// The maxima of row `b`; `tall` is for those along y alone.
    fn row(&self, b: usize, tall: &mut [f32], to: &mut [f32]) {
        let source = |b: usize| &self.source[b * self.nodes[0]..][..self.nodes[0]];
        tall.copy_from_slice(source(b));
        for other in self.y.of(b) {
            tall.iter_mut().zip(source(other)).for_each(|(to, &from)| *to = larger(*to, from));
        }
        self.x.row(tall, to);
    }
}

fn reduce(from: &[f32], [w, h]: [usize; 2], to: &mut [f32], [across, _]: [usize; 2]) {
    to.par_chunks_mut(across).enumerate().for_each(|(b, row)| {
        let upper = &from[2 * b * w..][..w];
        let lower = &from[(2 * b + 1).min(h - 1) * w..][..w];
        halve(upper, lower, smaller, row);
    });
}

/// Which nodes lie within one node's width of each node along an axis.
struct Neighbours {
    nodes: usize,
    /// Cells in the last node, and in the others.
    last: usize,
    full: usize,
    periodic: bool,
}

impl Neighbours {
    fn new(cells: usize, nodes: usize, level: usize, periodic: bool) -> Self {
        Self { nodes, last: cells - ((nodes - 1) << level), full: 1 << level, periodic }
    }

    /// The nodes beside node `a` that its margin reaches. The last node may be narrower than the
    /// margin, and then the one behind it is reached as well.
    fn of(&self, a: usize) -> impl Iterator<Item = usize> + '_ {
        let size = |node: usize| if node == self.nodes - 1 { self.last } else { self.full };
        let walk = move |forward: bool| {
            let mut node = a;
            let mut covered = 0;
            std::iter::from_fn(move || {
                if covered >= self.full {
                    return None;
                }
                let edge = if forward { node == self.nodes - 1 } else { node == 0 };
                if edge && !self.periodic {
                    return None;
                }
                node = match (edge, forward) {
                    (true, true) => 0,
                    (true, false) => self.nodes - 1,
                    (false, true) => node + 1,
                    (false, false) => node - 1,
                };
                covered += size(node);
                Some(node)
            })
        };
        walk(false).chain(walk(true))
    }

    /// The largest number around each node of a row.
    fn row(&self, from: &[f32], to: &mut [f32]) {
        for (a, to) in to.iter_mut().enumerate().take(self.nodes) {
            if a > 1 && a + 2 < self.nodes {
                continue;
            }
            *to = self.of(a).map(|node| from[node]).fold(from[a], f32::max);
        }
        if self.nodes > 4 {
            let inner = &mut to[2..self.nodes - 2];
            for ((to, &left), (&at, &right)) in
                inner.iter_mut().zip(&from[1..]).zip(from[2..].iter().zip(&from[3..]))
            {
                *to = larger(at, larger(left, right));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Wrap;

    /// The highest corner of the cells `from..to` along both axes, by walking over all of them.
    fn highest_of(field: &HeightField, x: std::ops::Range<i64>, y: std::ops::Range<i64>) -> f32 {
        let cells = field.cells().map(|n| n as i64);
        let inside = |i: i64, n: i64| {
            if field.is_periodic() { Some(i.rem_euclid(n)) } else { (0..n).contains(&i).then_some(i) }
        };
        let mut highest = 0.0_f32;
        for j in y {
            for i in x.clone() {
                if let (Some(i), Some(j)) = (inside(i, cells[0]), inside(j, cells[1])) {
                    highest = field.cell(i as usize, j as usize).into_iter().fold(highest, f32::max);
                }
            }
        }
        highest
    }

    #[test]
    fn drops_are_free_in_each_node_and_around_it() {
        for (w, h) in [(1, 1), (1, 9), (7, 5), (16, 16), (33, 2), (70, 9)] {
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                let texels: Vec<f32> = (0..w * h).map(|i| ((i * 7919) % 101) as f32 / 101.0).collect();
                let field = HeightField::new(&texels, w, h, wrap).unwrap();
                let levels = field.pyramid().levels();
                for bound in &Margins::build(&field).pyramids {
                    let margin = 1_i64 << bound.margin();
                    for (k, level) in levels.iter().enumerate().skip(bound.finest()) {
                        for b in 0..level.nodes[1] {
                            for a in 0..level.nodes[0] {
                                let side = |a: usize, n: usize| {
                                    (a << k) as i64 - margin..((a + 1) << k).min(n) as i64 + margin
                                };
                                let [nx, ny] = field.cells();
                                let highest = highest_of(&field, side(a, nx), side(b, ny));
                                let free = field.pyramid().highest() - highest;
                                let at = bound.offsets()[k] as usize + b * bound.strides()[k] as usize + a;
                                let drop = bound.drops()[at];
                                assert!(drop <= free && drop >= 0.0, "{w}x{h} {wrap:?} {k} ({a}, {b})");
                                // Where nodes are whole it is no less than it must be.
                                if nx % (1 << k) == 0 && ny % (1 << k) == 0 {
                                    assert_eq!(
                                        drop,
                                        (free - SLACK).max(0.0),
                                        "{w}x{h} {wrap:?} {k} ({a}, {b})"
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
