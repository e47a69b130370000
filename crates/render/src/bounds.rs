//! The lowest and the highest surface around each node of a quadtree, and how steep it is there: what a ray can meet.
//!
//! At *depth* `d` one period of the map is cut into `2^d` by `2^d` equal nodes, whatever its cells. What a node holds
//! is true of half a node around it too, so whatever is no longer than a node lies within that of its middle: one read
//! bounds the ground under a whole stretch of a ray. All depths lie one after the other, coarsest first, each row by
//! row; depth `d` starts at `(4^d - 1) / 3`.

use heightfield::HeightField;
use rayon::prelude::*;

/// Nodes along a side of the finest depth are at most this many, as a power of two: bounds need no more detail, and
/// stay small beside the map.
const MOST_DEPTH: u32 = 9;
/// Cells along a side of the finest nodes, as a power of two.
const FINEST_CELLS: u32 = 2;
/// Part of a 16-bit step that heights may be beside it and count as on it: rounding, for which the shader adds a
/// margin (`BOUNDS_ROUNDING` in `shaders_wgsl/lib/bounds.wgsl`).
const BESIDE: f32 = 0.01;

/// What there is to know of some ground.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ground {
    low: f32,
    high: f32,
    /// Largest rise along u and v, heights for one texel.
    steepest: [f32; 2],
}

impl Ground {
    const NONE: Self = Self { low: f32::INFINITY, high: f32::NEG_INFINITY, steepest: [0.0; 2] };

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            steepest: [0, 1].map(|axis| self.steepest[axis].max(other.steepest[axis])),
        }
    }

    fn of_cell(heights: [f32; 4]) -> Self {
        let [h00, h10, h01, h11] = heights;
        Self {
            low: heights.into_iter().fold(f32::INFINITY, f32::min),
            high: heights.into_iter().fold(f32::NEG_INFINITY, f32::max),
            steepest: [(h10 - h00).abs().max((h11 - h01).abs()), (h01 - h00).abs().max((h11 - h10).abs())],
        }
    }

    /// As `shaders_wgsl/bindings/bounds.wgsl` has it, rounded outwards.
    fn packed(self) -> [u32; 2] {
        let low = (self.low * 65535.0 + BESIDE).floor().clamp(0.0, 65535.0) as u32;
        let high = (self.high * 65535.0 - BESIDE).ceil().clamp(0.0, 65535.0) as u32;
        let [u, v] = self.steepest.map(|rise| (rise * 65535.0 + BESIDE).ceil().clamp(0.0, 65535.0) as u32);
        [low | high << 16, u | v << 16]
    }
}

/// The quadtree over one period of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    nodes: Vec<u32>,
    depth: u32,
    low: f32,
    high: f32,
}

impl Bounds {
    /// Nodes of a map that nobody has looked at: heights from 0 to 1, as steep as can be.
    pub const UNKNOWN: [u32; 2] = [0xffff_0000, 0xffff_ffff];

    /// The finest depth over a map.
    pub fn depth_of(field: &HeightField) -> u32 {
        let [columns, rows] = field.cells();
        let cells = columns.max(rows).next_power_of_two().ilog2();
        cells.saturating_sub(FINEST_CELLS).min(MOST_DEPTH)
    }

    /// Builds all depths.
    pub fn of(field: &HeightField) -> Self {
        let depth = Self::depth_of(field);
        // Nodes without anything around them, from one depth below the finest.
        let mut finer = cut(field, depth + 1);
        let mut depths = Vec::new();
        for depth in (0..=depth).rev() {
            depths.push(with_surroundings(&finer, 1 << (depth + 1), field.is_periodic()));
            finer = halved(&finer, 1 << (depth + 1));
        }
        let Ground { low, high, .. } = finer[0];
        let ordered = || depths.iter().rev().flatten();
        let nodes = ordered().map(|node| node[0]).chain(ordered().map(|node| node[1])).collect();
        Self { nodes, depth, low, high }
    }

    /// What lies on the device: the lowest and highest surface of all nodes, then the steepest slopes.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The lowest and the highest point of the map.
    pub fn span(&self) -> [f32; 2] {
        [self.low, self.high]
    }

    /// The finest depth.
    pub fn depth(&self) -> u32 {
        self.depth
    }
}

/// Cells from and to of node `at` of `nodes` along an axis.
fn cells_of(at: usize, nodes: usize, cells: usize) -> std::ops::Range<usize> {
    at * cells / nodes..((at + 1) * cells).div_ceil(nodes)
}

/// The ground of each node at a depth.
fn cut(field: &HeightField, depth: u32) -> Vec<Ground> {
    let nodes = 1_usize << depth;
    let [columns, rows] = field.cells();
    let mut grounds = vec![Ground::NONE; nodes * nodes];
    grounds.par_chunks_mut(nodes).enumerate().for_each(|(row, grounds)| {
        for j in cells_of(row, nodes, rows) {
            for (column, ground) in grounds.iter_mut().enumerate() {
                for i in cells_of(column, nodes, columns) {
                    *ground = ground.with(Ground::of_cell(field.cell(i, j)));
                }
            }
        }
    });
    grounds
}

/// Of four nodes one.
fn halved(finer: &[Ground], side: usize) -> Vec<Ground> {
    let half = side / 2;
    (0..half * half)
        .map(|at| {
            let first = 2 * (at / half) * side + 2 * (at % half);
            let [a, b, c, d] = [0, 1, side, side + 1].map(|offset| finer[first + offset]);
            a.with(b).with(c.with(d))
        })
        .collect()
}

/// Nodes twice as wide as `finer`, of which there are `side` along a side, each with half a node around it.
fn with_surroundings(finer: &[Ground], side: usize, periodic: bool) -> Vec<[u32; 2]> {
    let half = side / 2;
    // Two finer nodes make one, and one on either side is half of it.
    let around = |at: usize| {
        [side - 1, 0, 1, 2].map(|offset| {
            let place = 2 * at + offset;
            if periodic {
                place % side
            } else if offset == side - 1 {
                (2 * at).saturating_sub(1)
            } else {
                place.min(side - 1)
            }
        })
    };
    let places: Vec<[usize; 4]> = (0..half).map(around).collect();
    (0..half * half)
        .into_par_iter()
        .map(|at| {
            let mut ground = Ground::NONE;
            for row in places[at / half] {
                for column in places[at % half] {
                    ground = ground.with(finer[row * side + column]);
                }
            }
            ground.packed()
        })
        .collect()
}
