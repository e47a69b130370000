//! Walking segments from cell to cell, with jumps in between; shared by the searches whose maps say how
//! far a ray may jump.
//!
//! Where a jump does not take a ray out of its cell, the cell is solved in closed form and the ray goes
//! on at its wall. So every step gains a cell at least, thin features are met wherever they stand, and hits
//! are exact.

// Unchecked table reads.
#![allow(unsafe_code)]

use glam::Vec3;

use super::exact::ON_SURFACE;
use super::walk_axis::{Axis, Side};
use crate::lanes::{Lanes, Portable};
use crate::wide::Segments;
use crate::{Found, HeightField, Status};

/// Farther than this, in cells, `f32` no longer tells cells apart.
const FAR: f32 = (1 << 24) as f32;
/// A light ray that enters a cell this close to its surface still leaves the point it started from.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// A search whose maps say how far rays may jump.
pub trait Leap: Copy {
    /// The maps it reads.
    type Maps<'a>: Copy;

    /// Its maps of a field; none when one is missing.
    fn maps<'a>(&self, field: &'a HeightField) -> Option<Self::Maps<'a>>;

    /// Most steps of a ray.
    fn most_steps(&self) -> u32;

    /// What the length of a jump is counted by, from the ends of segments less their starts.
    fn pace<L: Lanes>(maps: Self::Maps<'_>, delta: [L::F; 3]) -> L::F;

    /// To what time rays may jump from where they stand: infinity when nothing lies ahead.
    fn leap<L: Lanes>(maps: Self::Maps<'_>, rays: &CellWalk<L>, cells: &Cells<'_, L>, at: &Stand<L>) -> L::F;

    /// Takes the chosen rays to the end of their jump.
    fn land<L: Lanes>(&self, rays: &mut CellWalk<L>, _cells: &Cells<'_, L>, chosen: L::M, jump: L::F) {
        rays.jump(chosen, jump);
    }
}

/// The bilinear cells of a field.
#[derive(Clone, Copy)]
pub struct Cells<'a, L: Lanes> {
    /// The field itself.
    pub field: &'a HeightField,
    stride: L::I,
    x: Side<L>,
    y: Side<L>,
}

impl<'a, L: Lanes> Cells<'a, L> {
    /// The cells of a field.
    #[inline(always)]
    pub fn new(field: &'a HeightField) -> Self {
        let [nx, ny] = field.cells();
        let periodic = field.is_periodic();
        Self {
            field,
            stride: L::splat_int(nx as i32 + 1),
            x: Side::new(nx, periodic),
            y: Side::new(ny, periodic),
        }
    }

    /// Four numbers of a table laid out as the corners of the field are, around each cell: along x, then y.
    #[inline(always)]
    pub fn around(&self, table: &[f32], corner: L::I) -> [L::F; 4] {
        assert!(table.len() == self.field.corners().len());
        // SAFETY: a patch's corner is the first of a cell of the field, so all four are of the table.
        let (upper, lower) =
            unsafe { (L::gather_pairs(table, corner), L::gather_pairs(table, corner + self.stride)) };
        [upper.0, upper.1, lower.0, lower.1]
    }

    /// One number of such a table for each cell, where chosen.
    #[inline(always)]
    pub fn of(&self, table: &[f32], corner: L::I, chosen: L::M) -> L::F {
        assert!(table.len() == self.field.corners().len());
        // SAFETY: as above.
        unsafe { L::gather(table, corner, chosen) }
    }
}

/// The bilinear cells under rays.
pub struct Patch<L: Lanes> {
    /// Cell ids along x and y.
    pub id: [L::I; 2],
    /// The first corner among all of the field.
    pub corner: L::I,
    /// Position inside, 0..1.
    pub local: [L::F; 2],
    along: [L::F; 2],
    twist: L::F,
    /// Height of the surface under the ray.
    pub height: L::F,
}

impl<L: Lanes> Patch<L> {
    /// The cells at time `t`.
    #[inline(always)]
    pub fn new(cells: &Cells<'_, L>, x: &Axis<L>, y: &Axis<L>, t: L::F) -> Self {
        let id = [x.id(&cells.x), y.id(&cells.y)];
        let corner = id[1] * cells.stride + id[0];
        let [h00, h10, h01, h11] = cells.around(cells.field.corners(), corner);
        let local = [x.local(t), y.local(t)];
        let along = [h10 - h00, h01 - h00];
        let twist = (h11 - h10) - (h01 - h00);
        let height = h00 + local[0] * along[0] + local[1] * (along[1] + local[0] * twist);
        Self { id, corner, local, along, twist, height }
    }
}

/// Where rays stand over the surface.
pub struct Stand<L: Lanes> {
    /// The cell under each.
    pub patch: Patch<L>,
    /// Height over the surface there.
    pub gap: L::F,
    /// Which start from the surface and are still on it.
    on_surface: L::M,
    exits: [L::F; 2],
}

/// Rays on their way through the cells.
#[derive(Clone, Copy)]
pub struct CellWalk<L: Lanes> {
    /// Along x, in cells.
    x: Axis<L>,
    /// Along y, in cells.
    y: Axis<L>,
    /// Position along the segment.
    pub t: L::F,
    direction: [L::F; 3],
    z_start: L::F,
    /// What [`Leap::pace`] gave.
    pub pace: L::F,
    /// Up to here rays may not jump.
    pub closed_until: L::F,
    /// Cells visited.
    pub steps: L::I,
    /// Which are still on their way.
    pub running: L::M,
    /// Which of the others met the surface.
    pub hit: L::M,
    /// Which of the others ran out of steps.
    pub unconverged: L::M,
}

impl<L: Lanes> CellWalk<L> {
    /// The chosen rays, at the start of their segments. Those whose segment is too long for `f32` are
    /// unconverged at once. With `from_surface` the start lies on the surface and is no hit.
    #[inline(always)]
    pub fn new<S: Leap>(
        maps: S::Maps<'_>,
        cells: &Cells<'_, L>,
        segments: &Segments<L>,
        chosen: L::M,
        from_surface: bool,
    ) -> Self {
        let field = cells.field;
        let size = [L::splat(field.width() as f32), L::splat(field.height() as f32)];
        let shift = L::splat(0.5 + field.first_texel() as f32);
        let [start, delta] = [segments.start, segments.delta];
        let (dx, dy) = (delta[0] * size[0], delta[1] * size[1]);
        // False for NaN.
        let near = L::lt(L::abs(dx), L::splat(FAR)) & L::lt(L::abs(dy), L::splat(FAR));
        let zero = L::splat(0.0);
        let mut rays = Self {
            x: Axis::new(start[0] * size[0] - shift, dx),
            y: Axis::new(start[1] * size[1] - shift, dy),
            t: zero,
            direction: [dx, dy, delta[2]],
            z_start: start[2],
            pace: S::pace::<L>(maps, delta),
            closed_until: zero,
            steps: L::splat_int(0),
            running: chosen & near,
            hit: L::first(0),
            unconverged: chosen & !near,
        };
        if from_surface {
            // A start that is off by rounding is taken to the very height of the surface.
            let gap = rays.z_start - Patch::new(cells, &rays.x, &rays.y, zero).height;
            let close = L::le(L::abs(gap), L::splat(ON_SURFACE as f32));
            rays.z_start = L::select(close, rays.z_start - gap, rays.z_start);
        }
        rays
    }

    /// The chosen lanes of others, the own ones elsewhere.
    #[inline(always)]
    pub fn or(&self, chosen: L::M, other: &Self) -> Self {
        let ([x, y, z], [other_x, other_y, other_z]) = (self.direction, other.direction);
        Self {
            x: self.x.or(chosen, &other.x),
            y: self.y.or(chosen, &other.y),
            t: L::select(chosen, other.t, self.t),
            direction: [
                L::select(chosen, other_x, x),
                L::select(chosen, other_y, y),
                L::select(chosen, other_z, z),
            ],
            z_start: L::select(chosen, other.z_start, self.z_start),
            pace: L::select(chosen, other.pace, self.pace),
            closed_until: L::select(chosen, other.closed_until, self.closed_until),
            steps: L::select_int(chosen, other.steps, self.steps),
            running: either::<L>(chosen, self.running, other.running),
            hit: either::<L>(chosen, self.hit, other.hit),
            unconverged: either::<L>(chosen, self.unconverged, other.unconverged),
        }
    }

    /// Height of the rays at time `t`.
    #[inline(always)]
    pub fn z(&self, t: L::F) -> L::F {
        self.z_start + self.direction[2] * t
    }

    /// By how much they rise in one unit of time.
    #[inline(always)]
    pub fn rise(&self) -> L::F {
        self.direction[2]
    }

    /// Looks at the cells that the rays are in.
    #[inline(always)]
    fn stand(&self, cells: &Cells<'_, L>, from_surface: bool) -> Stand<L> {
        let patch = Patch::new(cells, &self.x, &self.y, self.t);
        let gap = self.z(self.t) - patch.height;
        let on_surface = if from_surface { L::le(L::abs(gap), L::splat(ROUNDING)) } else { L::first(0) };
        Stand { patch, gap, on_surface, exits: [self.x.exit(), self.y.exit()] }
    }

    /// Which rays are on or below the surface at time `t`, in the cells that they are in.
    #[inline(always)]
    pub fn below(&self, cells: &Cells<'_, L>, t: L::F) -> L::M {
        L::le(self.z(t), Patch::new(cells, &self.x, &self.y, t).height)
    }

    /// Which are in the same cell as others.
    #[inline(always)]
    pub fn shares_cell(&self, other: &Self) -> L::M {
        let (x, y) = (other.x.cell, other.y.cell);
        let same_x = L::le(self.x.cell, x) & L::le(x, self.x.cell);
        same_x & L::le(self.y.cell, y) & L::le(y, self.y.cell)
    }

    /// Takes the chosen rays ahead, to the cells that they are in then.
    #[inline(always)]
    pub fn jump(&mut self, chosen: L::M, t: L::F) {
        let (mut x, mut y) = (self.x, self.y);
        x.place(t);
        y.place(t);
        self.x.cell = L::select(chosen, x.cell, self.x.cell);
        self.y.cell = L::select(chosen, y.cell, self.y.cell);
        self.t = L::select(chosen, t, self.t);
    }

    /// Solves the cells: which rays meet the surface in theirs before its wall, and when.
    #[inline(always)]
    fn root(&self, stand: &Stand<L>, exit: L::F) -> (L::M, L::F) {
        let [dx, dy, dz] = self.direction;
        let Patch { local: [lx, ly], along, twist, .. } = stand.patch;
        let slope = dz - (along[0] + ly * twist) * dx - (along[1] + lx * twist) * dy;
        let zero = L::splat(0.0);
        let bend = zero - twist * dx * dy;
        let length = exit - self.t;
        let falls = L::lt(slope, zero);
        let (bends_down, straight) = (L::lt(bend, zero), L::le(bend, zero) & L::le(zero, bend));
        let discriminant = slope * slope - L::splat(4.0) * bend * stand.gap;
        let square_root = L::sqrt(L::max(discriminant, zero));
        let twice = L::select(falls, square_root - slope, zero - (slope + square_root));
        let q = L::select(straight, zero - slope, twice * L::splat(0.5));
        // With q > 0 the roots gap / q and q / bend are ordered; else only q / bend can be positive.
        let ordered = L::lt(zero, q);
        let root = L::select(ordered, stand.gap, q) / L::select(ordered, q, bend);
        let real =
            L::le(zero, discriminant) & (ordered | (bends_down & L::lt(q, zero))) & L::le(root, length);
        // On the surface the start itself is a root: only the other one counts.
        let sinks = falls | (L::le(slope, zero) & bends_down);
        let other = (zero - slope) / bend;
        let again = sinks | (bends_down & L::le(other, length));
        let met = (stand.on_surface & again) | (!stand.on_surface & real);
        let from_surface = L::select(sinks, zero, other);
        (met, L::select(stand.on_surface, from_surface, root))
    }

    /// One step of every running ray: a jump, or through its cell.
    #[inline(always)]
    pub fn step<S: Leap>(&mut self, search: &S, maps: S::Maps<'_>, cells: &Cells<'_, L>, from_surface: bool) {
        let (zero, infinity) = (L::splat(0.0), L::splat(f32::INFINITY));
        let running = self.running;
        let stand = self.stand(cells, from_surface);
        let exit = L::min(stand.exits[0], stand.exits[1]);
        let below = running & L::le(stand.gap, zero) & !stand.on_surface;
        let jump = S::leap(maps, self, cells, &stand);
        let away = L::le(infinity, jump);
        let going = running & !below & !away;
        let leaping = going & L::lt(exit, jump);
        let crossing = going & !leaping;
        let (root, until) = self.root(&stand, exit);
        let met = crossing & root;
        let crossed = crossing & !root;
        let t = L::select(met, self.t + until, L::max(self.t, exit));
        self.t = L::select(crossing, t, self.t);
        let by_x = L::le(stand.exits[0], stand.exits[1]);
        self.x.advance(crossed & by_x);
        self.y.advance(crossed & !by_x);
        if L::any(leaping) {
            search.land(self, cells, leaping, jump);
        }
        // A falling ray meets the floor, the others end with their segment.
        let beyond = L::le(zero, self.direction[2]) & L::lt(L::splat(1.0), self.t);
        let gone = !L::lt(L::abs(self.t), infinity) | beyond;
        let hit = below | met;
        self.steps = L::select_int(running, self.steps + L::splat_int(1), self.steps);
        let ended = L::eq_int(self.steps, L::splat_int(search.most_steps() as i32));
        let open = (leaping | crossed) & !gone;
        self.hit = self.hit | hit;
        self.unconverged = self.unconverged | (open & ended);
        self.running = open & !ended;
    }
}

/// The other mask where chosen.
#[inline(always)]
fn either<L: Lanes>(chosen: L::M, own: L::M, other: L::M) -> L::M {
    (own & !chosen) | (other & chosen)
}

/// Follows one segment to the first point on or below the surface; see [`super::Search::trace`]. Nothing is
/// found without the maps.
#[inline(always)]
pub fn trace<S: Leap>(
    search: &S,
    field: &HeightField,
    start: Vec3,
    delta: Vec3,
    from_surface: bool,
) -> Found {
    type One = Portable<1>;
    let Some(maps) = search.maps(field) else {
        return Found { tau: 0.0, status: Status::Unconverged, steps: 0 };
    };
    let cells = Cells::<One>::new(field);
    let segments = Segments::one(start, delta, 1.0);
    let mut ray = CellWalk::new::<S>(maps, &cells, &segments, One::first(1), from_surface);
    while One::any(ray.running) {
        ray.step(search, maps, &cells, from_surface);
    }
    let (mut t, mut steps) = ([0.0], [0]);
    One::store(ray.t, &mut t);
    One::store_int(ray.steps, &mut steps);
    match (One::any(ray.hit), One::any(ray.unconverged)) {
        (true, _) => Found::hit(t[0], steps[0] as u32),
        (_, true) => Found { tau: t[0].min(1.0), status: Status::Unconverged, steps: steps[0] as u32 },
        _ => Found::left(steps[0] as u32),
    }
}
