//! Positions on the grid of cells, and steps from node to node of a margin pyramid.
//!
//! Positions are plain `f32`: the margin makes up for their rounding. Rays go down, and their
//! parameter is the *drop* below the highest point of the field, the same for all rays.

use crate::lanes::Lanes;
use crate::margin::MarginPyramid;

/// Stands for "never"; finite, so that times zero it is zero.
pub const BIG: f32 = 1e30;

/// The cells along one axis.
#[derive(Clone, Copy)]
pub struct Grid<L: Lanes> {
    periodic: bool,
    cells: L::F,
    inverse: L::F,
    half_inverse: L::F,
    last: L::I,
}

impl<L: Lanes> Grid<L> {
    /// The grid of `cells` cells, which repeats or whose outermost cells are endless.
    #[inline(always)]
    pub fn new(cells: usize, periodic: bool) -> Self {
        let n = cells as f32;
        Self {
            periodic,
            cells: L::splat(n),
            inverse: L::splat(1.0 / n),
            half_inverse: L::splat(0.5 / n),
            last: L::splat_int(cells as i32 - 1),
        }
    }

    /// How many cells there are.
    #[inline(always)]
    pub fn cells(&self) -> L::F {
        self.cells
    }

    /// The node of a position in tiles when the grid has `nodes` of them, of which the last may be less
    /// than whole, and where its two sides are from there, in nodes: the one at `ahead` nodes (0 or 1)
    /// and how far it is. Finite positions give a node of the grid.
    #[inline(always)]
    fn node(&self, tiles: L::F, nodes: L::F, ahead: L::F) -> (L::F, L::F, L::F) {
        let below_one = L::splat(1.0 - f32::EPSILON / 2.0);
        if self.periodic {
            let place = L::min(tiles - L::floor(tiles), below_one) * nodes;
            let node = L::floor(place);
            let side = L::min(node + ahead, nodes);
            (node, side, side - place)
        } else {
            let zero = L::splat(0.0);
            let node = L::floor(L::max(L::min(tiles, below_one), zero) * nodes);
            let side = node + ahead;
            let open = L::le(side, zero) & L::le(ahead, zero) | L::le(nodes, side);
            let far = L::splat(BIG) * (ahead + ahead - L::splat(1.0));
            (node, side, L::select(open, far, side - tiles * nodes))
        }
    }

    /// The number of `cell`, whose neighbour behind, on the way up or down, has number `last`.
    #[inline(always)]
    pub fn next(&self, cell: L::F, last: L::I, up: L::M) -> L::I {
        if !self.periodic {
            return self.number(cell);
        }
        let (zero, one) = (L::splat_int(0), L::splat_int(1));
        let end = L::select_int(up, self.last, zero);
        let step = L::select_int(up, one, zero - one);
        L::select_int(L::eq_int(last, end), self.last - end, last + step)
    }

    /// Whether the cell of this number is so many cells or more away from both ends of the grid.
    #[inline(always)]
    pub fn inner(&self, number: L::I, cells: usize) -> L::M {
        let from_first = number - L::splat_int(cells as i32);
        let room = self.last - L::splat_int(2 * cells as i32);
        // Negative numbers count as large; small grids have no such cell.
        L::eq_int(L::min_unsigned(from_first, room), from_first) & L::lt_int(L::splat_int(0), room)
    }

    /// The number of a cell on any tile, a whole number. Never outside the grid, whatever the input.
    #[inline(always)]
    pub fn number(&self, cell: L::F) -> L::I {
        let cell = if self.periodic {
            let tile = L::floor(L::mul_add(cell, self.inverse, self.half_inverse));
            cell - tile * self.cells
        } else {
            let (first, last) = (L::splat(0.0), self.cells - L::splat(1.0));
            L::max(L::min(cell, last), first)
        };
        L::min_unsigned(L::to_int(cell), self.last)
    }
}

/// One axis of rays, for one unit of drop.
#[derive(Clone, Copy)]
pub struct Axis<L: Lanes> {
    /// Position at drop 0, in tiles.
    pub start: L::F,
    /// Tiles.
    pub direction: L::F,
    /// 1 / direction in cells; [`BIG`] when the ray does not move along this axis.
    pub inverse: L::F,
}

impl<L: Lanes> Axis<L> {
    /// 1 / direction in cells.
    #[inline(always)]
    pub fn inverse_of(direction: L::F) -> L::F {
        // Below that, the inverse would be larger than what stands for "never".
        let moving = L::lt(L::splat(1.0 / BIG), L::abs(direction));
        L::select(moving, L::splat(1.0) / direction, L::splat(BIG))
    }
}

/// Rays that step from node to node, as far as they are surely above the surface.
#[derive(Clone, Copy)]
pub struct Coarse<L: Lanes> {
    x: Axis<L>,
    y: Axis<L>,
    /// 1 along an axis on which they go up, 0 elsewhere.
    ahead: [L::F; 2],
    /// An eighth of a cell, as drop: so far a step goes into the next node.
    overshoot: L::F,
    /// Where they are. Down to here nothing is in the way.
    pub drop: L::F,
    level: L::I,
    /// Nodes visited.
    pub steps: L::I,
    /// Lanes not yet stopped.
    pub running: L::M,
}

impl<L: Lanes> Coarse<L> {
    /// Rays at a drop, to begin at a level.
    #[inline(always)]
    pub fn new(x: Axis<L>, y: Axis<L>, drop: L::F, level: L::I, running: L::M) -> Self {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let overshoot = L::splat(0.125) * L::min(L::abs(x.inverse), L::abs(y.inverse));
        let ahead_x = L::select(L::lt(zero, x.inverse), one, zero);
        let ahead_y = L::select(L::lt(zero, y.inverse), one, zero);
        Self { x, y, ahead: [ahead_x, ahead_y], overshoot, drop, level, steps: L::splat_int(0), running }
    }

    /// One step of every running lane: across its node when that is free, else down to the free drop
    /// and to a finer node. Lanes stop that are not free at the finest level.
    #[inline(always)]
    pub fn step(&mut self, bound: &MarginPyramid, gx: &Grid<L>, gy: &Grid<L>) {
        let level = self.level;
        let finer = L::splat_int(0) - level;
        let (node_x, side_x, to_x) = gx.node(
            L::mul_add(self.drop, self.x.direction, self.x.start),
            L::times_power(gx.cells, finer),
            self.ahead[0],
        );
        let (node_y, side_y, to_y) = gy.node(
            L::mul_add(self.drop, self.y.direction, self.y.start),
            L::times_power(gy.cells, finer),
            self.ahead[1],
        );
        let at = L::to_int(node_x)
            + L::to_int(node_y) * L::lookup(bound.strides(), level)
            + L::lookup(bound.offsets(), level);
        let at = L::min_unsigned(at, L::splat_int(bound.last()));
        // SAFETY: at most the last of the table.
        let free = unsafe { L::gather_all(bound.drops(), at) };
        let (to_x, to_y) = (to_x * self.x.inverse, to_y * self.y.inverse);
        let cells = L::times_power(L::splat(1.0), level);
        let exit = L::mul_add(L::min(to_x, to_y), cells, self.drop + self.overshoot);
        let clear = L::le(exit, free);
        self.drop = L::select(self.running, L::min(L::max(self.drop, free), exit), self.drop);
        let step = L::splat_int(1);
        self.steps = L::select_int(self.running, self.steps + step, self.steps);
        // The side a ray leaves by, counted in nodes, is even where it is a side of the parent as well.
        let side = L::select(L::le(to_x, to_y), side_x, side_y);
        let climb = clear & !L::odd(L::to_int(side));
        let down = L::select_int(clear, level, level - step);
        let failed = L::lt_int(down, L::splat_int(bound.finest() as i32));
        let highest = L::splat_int(bound.top() as i32);
        self.level = L::select_int(climb, L::min_int(level + step, highest), down);
        self.running = self.running & !failed;
    }
}
