//! Walking a segment from cell to cell, with jumps in between; shared by the searches whose maps say how
//! far a ray may jump.
//!
//! Where a jump does not take the ray out of its cell, the cell is solved in closed form and the ray goes
//! on at its wall. So every step gains a cell at least, thin features are met wherever they stand, and hits
//! are exact.

use glam::Vec3;

use super::exact::{ON_SURFACE, first_root};
use super::walk_axis::Axis;
use crate::{Found, HeightField, Status};

/// Farther than this, in cells, `f32` no longer tells cells apart.
const FAR: f32 = 1e9;
/// A light ray that enters a cell this close to its surface still leaves the point it started from.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// The bilinear cell under a ray.
pub struct Patch {
    /// Cell id along x and y.
    pub id: [usize; 2],
    /// Position inside it, 0..1.
    pub local: [f32; 2],
    along: [f32; 2],
    twist: f32,
    /// Height of the surface under the ray.
    pub height: f32,
}

impl Patch {
    /// The cell at time `t`.
    #[inline(always)]
    pub fn new(field: &HeightField, x: &Axis, y: &Axis, t: f32) -> Self {
        let id = [x.id(), y.id()];
        let [h00, h10, h01, h11] = field.cell(id[0], id[1]);
        let local = [x.local(t), y.local(t)];
        let along = [h10 - h00, h01 - h00];
        let twist = (h11 - h10) - (h01 - h00);
        let height = h00 + local[0] * along[0] + local[1] * (along[1] + local[0] * twist);
        Self { id, local, along, twist, height }
    }
}

/// Where a ray stands over the surface.
pub struct Stand {
    /// The cell under it.
    pub patch: Patch,
    /// Its height over the surface there.
    pub gap: f32,
    /// Whether it starts from the surface and is still on it.
    pub on_surface: bool,
    exits: [f32; 2],
}

impl Stand {
    /// When the ray leaves its cell.
    #[inline(always)]
    pub fn exit(&self) -> f32 {
        self.exits[0].min(self.exits[1])
    }
}

/// A ray on its way through the cells.
pub struct CellWalk {
    /// Along x, in cells.
    pub x: Axis,
    /// Along y, in cells.
    pub y: Axis,
    /// Position along the segment.
    pub t: f32,
    direction: [f32; 3],
    z_start: f32,
    from_surface: bool,
    first: bool,
}

impl CellWalk {
    /// A ray at the start of a segment; none when the segment is too long for `f32`. With `from_surface`
    /// the start lies on the surface and is no hit.
    #[inline(always)]
    pub fn new(field: &HeightField, start: Vec3, delta: Vec3, from_surface: bool) -> Option<Self> {
        let [nx, ny] = field.cells();
        let (w, h) = (field.width() as f32, field.height() as f32);
        let first_texel = field.first_texel() as f32;
        let (dx, dy) = (delta.x * w, delta.y * h);
        if dx.abs().max(dy.abs()) >= FAR || dx.is_nan() || dy.is_nan() {
            return None;
        }
        let periodic = field.is_periodic();
        Some(Self {
            x: Axis::new(start.x * w - 0.5 - first_texel, dx, nx, periodic),
            y: Axis::new(start.y * h - 0.5 - first_texel, dy, ny, periodic),
            t: 0.0,
            direction: [dx, dy, delta.z],
            z_start: start.z,
            from_surface,
            first: true,
        })
    }

    /// Height of the ray at time `t`.
    #[inline(always)]
    pub fn z(&self, t: f32) -> f32 {
        self.z_start + self.direction[2] * t
    }

    /// Looks at the cell that the ray is in. A start on the surface is taken to its very height first.
    #[inline(always)]
    pub fn stand(&mut self, field: &HeightField) -> Stand {
        let patch = Patch::new(field, &self.x, &self.y, self.t);
        let mut gap = self.z(self.t) - patch.height;
        if self.from_surface && self.first && gap.abs() <= ON_SURFACE as f32 {
            self.z_start -= gap;
            gap = 0.0;
        }
        self.first = false;
        let on_surface = self.from_surface && gap.abs() <= ROUNDING;
        Stand { patch, gap, on_surface, exits: [self.x.exit(), self.y.exit()] }
    }

    /// Jumps ahead.
    #[inline(always)]
    pub fn jump(&mut self, t: f32) {
        self.x.place(t);
        self.y.place(t);
        self.t = t;
    }

    /// Solves the cell: gives the hit in it, or goes on to its wall.
    #[inline(always)]
    pub fn cross(&mut self, stand: &Stand) -> Option<f32> {
        let [dx, dy, dz] = self.direction;
        let Patch { local: [lx, ly], along, twist, .. } = stand.patch;
        let slope = dz - (along[0] + ly * twist) * dx - (along[1] + lx * twist) * dy;
        let bend = -twist * dx * dy;
        let exit = stand.exit();
        if let Some(s) = first_root(stand.gap, slope, bend, exit - self.t, stand.on_surface) {
            return Some(self.t + s);
        }
        self.t = self.t.max(exit);
        if stand.exits[0] <= stand.exits[1] {
            self.x.advance()
        } else {
            self.y.advance()
        }
        None
    }

    /// Whether nothing lies ahead: a falling ray meets the floor, the others end with their segment.
    #[inline(always)]
    pub fn has_left(&self) -> bool {
        !self.t.is_finite() || (self.direction[2] >= 0.0 && self.t > 1.0)
    }

    /// What is found when the steps run out.
    #[inline(always)]
    pub fn unconverged(&self, steps: u32) -> Found {
        Found { tau: self.t.min(1.0), status: Status::Unconverged, steps }
    }
}

/// What is found when a search cannot begin.
pub const NOTHING: Found = Found { tau: 0.0, status: Status::Unconverged, steps: 0 };
