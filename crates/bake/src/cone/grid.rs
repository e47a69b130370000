//! The height field as the search for cones sees it: sites, and tiles of sites with bounds.
//!
//! A *site* is what cones are compared between: a cell of the bilinear surface, or a texel's centre
//! alone for the textbook definition. Lengths are in UV units, positions count sites.

use heightfield::HeightField;
use rayon::prelude::*;

/// Sites along the side of a tile.
pub(super) const TILE: usize = 4;
/// What the height of a bounding plane may be off by through rounding.
const PLANE_MARGIN: f32 = 1e-6;

/// What sites are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sites {
    /// Bilinear cells, one texel wide.
    Cells,
    /// Texel centres, points.
    Texels,
}

/// A tile of sites: the highest point, a plane that no point of it exceeds, and how its gradient ranges.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tile {
    pub max: f32,
    /// Height of the plane at the tile's centre.
    pub level: f32,
    /// Slope of the plane, per UV unit.
    pub slope: [f32; 2],
    /// Least and greatest partial derivatives `dh/du`, `dh/dv` of its cells.
    pub gradient: [[f32; 2]; 2],
}

/// A tile or square of a level, with the first and last of its sites on the map.
pub(super) struct Node<'a> {
    pub tile: &'a Tile,
    pub first: [i64; 2],
    pub last: [i64; 2],
}

/// What is known of the points of a tile, lengths in UV units from some site.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub centre: [f32; 2],
    pub half: [f32; 2],
    pub slope: [f32; 2],
    pub level: f32,
    pub max: f32,
}

impl Bounds {
    /// Of a tile of sites `first` to `last`, seen from site `origin`.
    #[inline(always)]
    pub fn new(grid: &Grid<'_>, tile: &Tile, first: [i64; 2], last: [i64; 2], origin: [i64; 2]) -> Self {
        let side = |axis: usize, sign: f32| {
            let (low, high) = (first[axis] - origin[axis], last[axis] - origin[axis]);
            0.5 * (high as f32 + grid.extent + sign * low as f32) * grid.step[axis]
        };
        Self {
            centre: [side(0, 1.0), side(1, 1.0)],
            half: [side(0, -1.0), side(1, -1.0)],
            slope: tile.slope,
            level: tile.level,
            max: tile.max,
        }
    }
}

/// Tiles, or squares of two by two of the level below.
struct Level {
    nodes: [usize; 2],
    tiles: Vec<Tile>,
}

/// Nodes to look into: level, node, and the first site of its period.
pub(super) type Stack = Vec<(usize, [usize; 2], [i64; 2])>;

/// Puts the one node of the last level on the stack and, if the map is periodic, its images around it.
#[inline(always)]
pub(super) fn push_roots(stack: &mut Stack, level: usize, sites: [usize; 2], periodic: bool) {
    let images = if periodic { -1..=1 } else { 0..=0 };
    for y in images.clone() {
        for x in images.clone() {
            stack.push((level, [0, 0], [x * sites[0] as i64, y * sites[1] as i64]));
        }
    }
}

/// Puts the parts of a node on the stack; `nodes`: of the level below it.
#[inline(always)]
pub(super) fn push_children(
    stack: &mut Stack,
    level: usize,
    node: [usize; 2],
    origin: [i64; 2],
    nodes: [usize; 2],
) {
    for b in [2 * node[1], 2 * node[1] + 1] {
        for a in [2 * node[0], 2 * node[0] + 1] {
            if a < nodes[0] && b < nodes[1] {
                stack.push((level - 1, [a, b], origin));
            }
        }
    }
}

/// See the module.
pub(super) struct Grid<'a> {
    pub sites: [usize; 2],
    /// Width of a site in sites: 1 for cells, 0 for points.
    pub extent: f32,
    /// UV distance of neighbouring sites.
    pub step: [f32; 2],
    pub periodic: bool,
    corners: &'a [f32],
    stride: usize,
    levels: Vec<Level>,
}

impl<'a> Grid<'a> {
    pub fn new(field: &'a HeightField, kind: Sites) -> Self {
        let cells = field.cells();
        // The columns beyond the cells repeat those at the start, but for clamped maps.
        let points = if field.is_periodic() { cells } else { cells.map(|n| n + 1) };
        let (sites, extent) = match kind {
            Sites::Cells => (cells, 1.0),
            Sites::Texels => (points, 0.0),
        };
        let mut grid = Self {
            sites,
            extent,
            step: [1.0 / field.width() as f32, 1.0 / field.height() as f32],
            periodic: field.is_periodic(),
            corners: field.corners(),
            stride: cells[0] + 1,
            levels: Vec::new(),
        };
        let mut nodes = sites.map(|n| n.div_ceil(TILE));
        let tile = |grid: &Self, [a, b]: [usize; 2]| {
            if grid.levels.is_empty() { grid.tile_of(a, b) } else { grid.square_of(a, b) }
        };
        loop {
            let tiles = (0..nodes[0] * nodes[1])
                .into_par_iter()
                .with_min_len(64)
                .map(|at| tile(&grid, [at % nodes[0], at / nodes[0]]))
                .collect();
            grid.levels.push(Level { nodes, tiles });
            if nodes == [1, 1] {
                return grid;
            }
            nodes = nodes.map(|n| n.div_ceil(2));
        }
    }

    /// Index of a site on the map.
    #[inline]
    pub fn wrap(&self, site: [i64; 2]) -> [usize; 2] {
        [0, 1].map(|axis| {
            let n = self.sites[axis] as i64;
            let i = site[axis];
            (if self.periodic { i.rem_euclid(n) } else { i.clamp(0, n - 1) }) as usize
        })
    }

    /// Heights at the corners of a site on the map, `[h00, h10, h01, h11]`; all the same for a point.
    #[inline]
    pub fn heights(&self, [i, j]: [usize; 2]) -> [f32; 4] {
        let at = j * self.stride + i;
        let h = self.corners[at];
        if self.extent == 0.0 {
            return [h; 4];
        }
        [h, self.corners[at + 1], self.corners[at + self.stride], self.corners[at + self.stride + 1]]
    }

    fn tile_of(&self, a: usize, b: usize) -> Tile {
        let e = self.extent as usize;
        let [x0, y0] = [a * TILE, b * TILE];
        let last = |from: usize, n: usize| (from + TILE - 1).min(n - 1);
        let (x1, y1) = (last(x0, self.sites[0]) + e, last(y0, self.sites[1]) + e);
        let h = |i: usize, j: usize| self.corners[j * self.stride + i];
        let [du, dv] = self.step;
        // Mean slope between opposite sides; the plane is then lifted until it covers every corner.
        let mean = |sum: f32, sides: usize, run: usize, unit: f32| {
            if run == 0 { 0.0 } else { sum / (sides as f32 * run as f32 * unit) }
        };
        let across = (y0..=y1).map(|j| h(x1, j) - h(x0, j)).sum();
        let down = (x0..=x1).map(|i| h(i, y1) - h(i, y0)).sum();
        let slope = [mean(across, y1 - y0 + 1, x1 - x0, du), mean(down, x1 - x0 + 1, y1 - y0, dv)];
        let centre = [0.5 * (x0 + x1) as f32, 0.5 * (y0 + y1) as f32];
        let mut tile = Tile {
            max: f32::NEG_INFINITY,
            level: f32::NEG_INFINITY,
            slope,
            gradient: [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]],
        };
        for j in y0..=y1 {
            for i in x0..=x1 {
                let height = h(i, j);
                let (x, y) = ((i as f32 - centre[0]) * du, (j as f32 - centre[1]) * dv);
                tile.max = tile.max.max(height);
                tile.level = tile.level.max(height - slope[0] * x - slope[1] * y);
                let mut note = |axis: usize, slope: f32| {
                    tile.gradient[0][axis] = tile.gradient[0][axis].min(slope);
                    tile.gradient[1][axis] = tile.gradient[1][axis].max(slope);
                };
                if i < x1 {
                    note(0, (h(i + 1, j) - height) / du);
                }
                if j < y1 {
                    note(1, (h(i, j + 1) - height) / dv);
                }
            }
        }
        tile.level += PLANE_MARGIN;
        tile
    }

    /// The tile over four of the last level.
    fn square_of(&self, a: usize, b: usize) -> Tile {
        let at = self.levels.len() - 1;
        let below = &self.levels[at];
        let centre = |bounds: [[i64; 2]; 2]| {
            [0, 1].map(|axis| {
                0.5 * ((bounds[0][axis] + bounds[1][axis]) as f32 + self.extent) * self.step[axis]
            })
        };
        let middle = centre(self.sites_of(at + 1, [a, b]));
        let parts: Vec<(&Tile, [[i64; 2]; 2])> = [[0, 0], [1, 0], [0, 1], [1, 1]]
            .map(|[x, y]| [2 * a + x, 2 * b + y])
            .into_iter()
            .filter(|node| node[0] < below.nodes[0] && node[1] < below.nodes[1])
            .map(|node| (below.tile(node), self.sites_of(at, node)))
            .collect();
        let share = 1.0 / parts.len() as f32;
        let slope = [0, 1].map(|axis| share * parts.iter().map(|(part, _)| part.slope[axis]).sum::<f32>());
        let mut tile = Tile {
            max: f32::NEG_INFINITY,
            level: f32::NEG_INFINITY,
            slope,
            gradient: [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]],
        };
        for (part, sites) in parts {
            tile.max = tile.max.max(part.max);
            let from = centre(sites);
            let mut level = part.level;
            for axis in 0..2 {
                let half = 0.5 * ((sites[1][axis] - sites[0][axis]) as f32 + self.extent) * self.step[axis];
                // The plane over the part, above the one over all: highest at one of the part's sides.
                level +=
                    (part.slope[axis] - slope[axis]).abs() * half - slope[axis] * (from[axis] - middle[axis]);
                tile.gradient[0][axis] = tile.gradient[0][axis].min(part.gradient[0][axis]);
                tile.gradient[1][axis] = tile.gradient[1][axis].max(part.gradient[1][axis]);
            }
            tile.level = tile.level.max(level + PLANE_MARGIN);
        }
        tile
    }

    /// A node of a level.
    #[inline(always)]
    pub fn node(&self, level: usize, node: [usize; 2]) -> Node<'_> {
        let [first, last] = self.sites_of(level, node);
        Node { tile: self.levels[level].tile(node), first, last }
    }

    /// The whole map and, if it is periodic, its images around it.
    #[inline(always)]
    pub fn roots(&self, stack: &mut Stack) {
        push_roots(stack, self.levels.len() - 1, self.sites, self.periodic);
    }

    /// The parts of a node.
    #[inline(always)]
    pub fn children(&self, level: usize, node: [usize; 2], origin: [i64; 2], stack: &mut Stack) {
        push_children(stack, level, node, origin, self.levels[level - 1].nodes);
    }

    /// First and last site of a node of a level, on the map.
    #[inline(always)]
    fn sites_of(&self, level: usize, node: [usize; 2]) -> [[i64; 2]; 2] {
        let first = node.map(|n| ((n << level) * TILE) as i64);
        let last = [0, 1].map(|axis| ((((node[axis] + 1) << level) * TILE).min(self.sites[axis])) as i64 - 1);
        [first, last]
    }
}

impl Level {
    fn tile(&self, [a, b]: [usize; 2]) -> &Tile {
        &self.tiles[b * self.nodes[0] + a]
    }
}
