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
    count: L::I,
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
            count: L::splat_int(cells as i32),
        }
    }

    /// Cells to tiles.
    #[inline(always)]
    pub fn tiles(&self, cells: L::F) -> L::F {
        cells * self.inverse
    }

    /// Where a position in tiles lies, in cells; on the tile at the origin when the grid repeats.
    #[inline(always)]
    fn place(&self, tiles: L::F) -> L::F {
        if self.periodic { (tiles - L::floor(tiles)) * self.cells } else { tiles * self.cells }
    }

    /// The cell of a place. Never outside the grid, whatever the input.
    #[inline(always)]
    fn cell_at(&self, place: L::F) -> L::I {
        if self.periodic {
            L::min_unsigned(L::to_int(place), self.last)
        } else {
            let (first, last) = (L::splat(0.0), self.cells - L::splat(1.0));
            L::min_unsigned(L::to_int(L::max(L::min(place, last), first)), self.last)
        }
    }

    /// The number of a cell on any tile, a whole number. Never outside the grid, whatever the input.
    #[inline(always)]
    pub fn number(&self, cell: L::F) -> L::I {
        if self.periodic {
            let tile = L::floor(L::mul_add(cell, self.inverse, self.half_inverse));
            L::min_unsigned(L::to_int(cell - tile * self.cells), self.last)
        } else {
            self.cell_at(cell)
        }
    }

    /// Whether a side of a node is where the endless cells begin.
    #[inline(always)]
    fn is_open(&self, side: L::F, up: L::M) -> L::M {
        let border = L::select(up, self.cells, L::splat(0.0));
        L::le(L::abs(side - border), L::splat(0.0))
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
        let moving = L::lt(L::splat(1e-20), L::abs(direction));
        L::select(moving, L::splat(1.0) / direction, L::splat(BIG))
    }

    #[inline(always)]
    fn refill(&self, chosen: L::M, start: &[f32], direction: &[f32], inverse: &[f32]) -> Self {
        Self {
            start: L::expand(chosen, start, self.start),
            direction: L::expand(chosen, direction, self.direction),
            inverse: L::expand(chosen, inverse, self.inverse),
        }
    }
}

/// Rays that step from node to node, as far as they are surely above the surface.
#[derive(Clone, Copy)]
pub struct Coarse<L: Lanes> {
    x: Axis<L>,
    y: Axis<L>,
    up_x: L::M,
    up_y: L::M,
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
        let zero = L::splat(0.0);
        let overshoot = L::splat(0.125) * L::min(L::abs(x.inverse), L::abs(y.inverse));
        let (up_x, up_y) = (L::lt(zero, x.inverse), L::lt(zero, y.inverse));
        Self { x, y, up_x, up_y, overshoot, drop, level, steps: L::splat_int(0), running }
    }

    /// One step of every running lane: across its node when that is free, else down to the free drop
    /// and to a finer node. Lanes stop that are not free at the finest level.
    #[inline(always)]
    pub fn step(&mut self, bound: &MarginPyramid, gx: &Grid<L>, gy: &Grid<L>) {
        let one = L::splat_int(1);
        let level = self.level;
        let x = gx.place(L::mul_add(self.drop, self.x.direction, self.x.start));
        let y = gy.place(L::mul_add(self.drop, self.y.direction, self.y.start));
        let node_x = L::shift_right(gx.cell_at(x), level);
        let node_y = L::shift_right(gy.cell_at(y), level);
        let at = L::lookup(bound.offsets(), level) + node_x + node_y * L::lookup(bound.strides(), level);
        // SAFETY: a node of its level, since its cell is inside the grid.
        let free = unsafe { L::gather(bound.drops(), at, self.running) };
        let next_x = L::select_int(self.up_x, node_x + one, node_x);
        let next_y = L::select_int(self.up_y, node_y + one, node_y);
        let side_x = L::to_float(L::min_int(L::shift_left(next_x, level), gx.count));
        let side_y = L::to_float(L::min_int(L::shift_left(next_y, level), gy.count));
        let mut to_x = (side_x - x) * self.x.inverse;
        let mut to_y = (side_y - y) * self.y.inverse;
        if !gx.periodic {
            to_x = L::select(gx.is_open(side_x, self.up_x), L::splat(BIG), to_x);
            to_y = L::select(gy.is_open(side_y, self.up_y), L::splat(BIG), to_y);
        }
        let exit = self.drop + (L::min(to_x, to_y) + self.overshoot);
        let clear = L::le(exit, free);
        self.drop = L::select(self.running, L::min(L::max(self.drop, free), exit), self.drop);
        self.steps = L::select_int(self.running, self.steps + one, self.steps);
        // The side a ray leaves by, counted in nodes, is even where it is a side of the parent as well.
        let side = L::select_int(L::le(to_x, to_y), next_x, next_y);
        let climb = clear & !L::odd(side);
        let down = L::select_int(clear, level, level - one);
        let failed = L::lt_int(down, L::splat_int(bound.margin() as i32));
        let highest = L::splat_int(bound.top() as i32);
        self.level = L::select_int(climb, L::min_int(level + one, highest), down);
        self.running = self.running & !failed;
    }

    /// Replaces the chosen lanes by the first numbers of the arrays, in order.
    #[inline(always)]
    pub fn refill(&mut self, chosen: L::M, from: [&[f32]; 7], level: L::I) {
        let x = self.x.refill(chosen, from[0], from[2], from[4]);
        let y = self.y.refill(chosen, from[1], from[3], from[5]);
        let drop = L::expand(chosen, from[6], self.drop);
        let steps = L::select_int(chosen, L::splat_int(0), self.steps);
        let level = L::select_int(chosen, level, self.level);
        *self = Self { steps, ..Self::new(x, y, drop, level, self.running) };
    }
}
