//! One axis of walks from cell to cell that may jump. The twin of `shaders_wgsl/lib/walk_axis.wgsl`.

use crate::lanes::Lanes;

/// The cells of a field along one axis.
#[derive(Clone, Copy)]
pub struct Side<L: Lanes> {
    periodic: bool,
    cells: L::D,
    inverse: L::D,
    highest: L::F,
    last: L::I,
}

impl<L: Lanes> Side<L> {
    /// So many cells, which repeat or of which the outermost are endless.
    #[inline(always)]
    pub fn new(cells: usize, periodic: bool) -> Self {
        Self {
            periodic,
            cells: L::splat_wide(cells as f64),
            inverse: L::splat_wide(1.0 / cells as f64),
            highest: L::splat((cells - 1) as f32),
            last: L::splat_int(cells as i32 - 1),
        }
    }
}

/// Where rays are along one axis. Positions are relative to the start cell, so they keep their precision.
#[derive(Clone, Copy)]
pub struct Axis<L: Lanes> {
    start: L::F,
    direction: L::F,
    /// 1 / direction; 0 when a ray does not move along this axis.
    inverse: L::F,
    /// Added to the time of an exit: 0, or infinity when a ray does not move.
    never: L::F,
    /// The cell a ray is in, relative to the start cell: a whole number.
    pub cell: L::F,
    /// The start cell.
    first: L::F,
}

impl<L: Lanes> Axis<L> {
    /// Rays at `position`, in cells from the first, that move by `direction` in one unit of time.
    #[inline(always)]
    pub fn new(position: L::F, direction: L::F) -> Self {
        let (zero, infinity) = (L::splat(0.0), L::splat(f32::INFINITY));
        let floor = L::floor(position);
        let inverse = L::splat(1.0) / direction;
        let moves = L::lt(L::abs(inverse), infinity);
        Self {
            start: position - floor,
            direction,
            inverse: L::select(moves, inverse, zero),
            never: L::select(moves, zero, infinity),
            cell: zero,
            first: floor,
        }
    }

    /// The chosen lanes of another, the own ones elsewhere.
    #[inline(always)]
    pub fn or(&self, chosen: L::M, other: &Self) -> Self {
        Self {
            start: L::select(chosen, other.start, self.start),
            direction: L::select(chosen, other.direction, self.direction),
            inverse: L::select(chosen, other.inverse, self.inverse),
            never: L::select(chosen, other.never, self.never),
            cell: L::select(chosen, other.cell, self.cell),
            first: L::select(chosen, other.first, self.first),
        }
    }

    /// The ids of the cells on the map, whatever the input. Beyond a clamped map the border cells go on.
    #[inline(always)]
    pub fn id(&self, side: &Side<L>) -> L::I {
        let id = if side.periodic {
            // In f64, where half a cell keeps the quotient of whole numbers off whole numbers.
            let id = L::widen(self.first) + L::widen(self.cell);
            let tile = L::floor_wide((id + L::splat_wide(0.5)) * side.inverse);
            L::narrow(id - tile * side.cells)
        } else {
            L::max(L::min(self.first + self.cell, side.highest), L::splat(0.0))
        };
        L::min_unsigned(L::to_int(id), side.last)
    }

    /// When rays reach the wall before them.
    #[inline(always)]
    pub fn exit(&self) -> L::F {
        let zero = L::splat(0.0);
        let ahead = L::select(L::lt(zero, self.inverse), L::splat(1.0), zero);
        (self.cell + ahead - self.start) * self.inverse + self.never
    }

    /// Goes to the cell behind that wall, where chosen.
    #[inline(always)]
    pub fn advance(&mut self, chosen: L::M) {
        let one = L::splat(1.0);
        let up = L::lt(L::splat(0.0), self.inverse);
        self.cell = L::select(chosen, L::select(up, self.cell + one, self.cell - one), self.cell);
    }

    /// Goes to the cells that rays are in at time `t`, never back and past every wall whose time has come.
    #[inline(always)]
    pub fn place(&mut self, t: L::F) {
        let zero = L::splat(0.0);
        let cell = L::floor(self.start + t * self.direction);
        let ahead = L::select(L::lt(zero, self.inverse), L::max(self.cell, cell), self.cell);
        self.cell = L::select(L::lt(self.inverse, zero), L::min(self.cell, cell), ahead);
        self.advance(L::le(self.exit(), t));
    }

    /// Positions inside the cells at time `t`, 0..1.
    #[inline(always)]
    pub fn local(&self, t: L::F) -> L::F {
        L::max(L::min(self.start - self.cell + t * self.direction, L::splat(1.0)), L::splat(0.0))
    }
}
