//! One axis of a walk from cell to cell that may jump. The twin of `shaders_wgsl/lib/walk_axis.wgsl`.

/// Where a ray is along one axis. Positions are relative to the start cell, so they keep their precision.
#[derive(Debug, Clone, Copy)]
pub struct Axis {
    start: f32,
    direction: f32,
    /// 1 / direction; 0 when the ray does not move along this axis.
    inverse: f32,
    /// The cell the ray is in, relative to the start cell.
    pub cell: i32,
    /// Id of the start cell.
    first: i32,
    cells: i32,
    periodic: bool,
}

impl Axis {
    /// A ray at `position`, in cells from the first, that moves by `direction` in one unit of time.
    #[inline(always)]
    pub fn new(position: f32, direction: f32, cells: usize, periodic: bool) -> Self {
        let floor = position.floor();
        let inverse = direction.recip();
        Self {
            start: position - floor,
            direction,
            inverse: if inverse.is_finite() { inverse } else { 0.0 },
            cell: 0,
            first: floor as i32,
            cells: cells as i32,
            periodic,
        }
    }

    /// The id of the cell on the map. Beyond a clamped map the border cells go on.
    #[inline(always)]
    pub fn id(&self) -> usize {
        let id = self.first.saturating_add(self.cell);
        let id = if self.periodic { id.rem_euclid(self.cells) } else { id.clamp(0, self.cells - 1) };
        id as usize
    }

    /// When the ray reaches the wall before it.
    #[inline(always)]
    pub fn exit(&self) -> f32 {
        if self.inverse == 0.0 {
            return f32::INFINITY;
        }
        let wall = if self.inverse > 0.0 { self.cell + 1 } else { self.cell };
        (wall as f32 - self.start) * self.inverse
    }

    /// Goes to the cell behind that wall.
    #[inline(always)]
    pub fn advance(&mut self) {
        self.cell += if self.inverse > 0.0 { 1 } else { -1 };
    }

    /// Goes to the cell that the ray is in at time `t`, never back and past every wall whose time has
    /// come.
    #[inline(always)]
    pub fn place(&mut self, t: f32) {
        let cell = (self.start + t * self.direction).floor() as i32;
        if self.inverse > 0.0 {
            self.cell = self.cell.max(cell);
        } else if self.inverse < 0.0 {
            self.cell = self.cell.min(cell);
        }
        if self.exit() <= t {
            self.advance();
        }
    }

    /// Position inside the cell at time `t`, 0..1.
    #[inline(always)]
    pub fn local(&self, t: f32) -> f32 {
        (self.start - self.cell as f32 + t * self.direction).clamp(0.0, 1.0)
    }
}
