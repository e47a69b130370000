//! Exact search: descends a max pyramid only into nodes the ray can hit and solves the bilinear cell
//! in closed form. Every hit is the first one; none is skipped.
//!
//! F. Kenton Musgrave, Grid Tracing: Fast Ray Tracing for Height Fields, 1988 (cells); Art Tevs, Ivo
//! Ihrke and Hans-Peter Seidel, Maximum Mipmaps for Fast, Accurate, and Scalable Dynamic Height Field
//! Rendering, I3D 2008 (pyramid); Shaun Ramsey, Kristin Potter and Charles Hansen, Ray Bilinear Patch
//! Intersections, Journal of Graphics Tools 9(3), 2004 (patch).
//!
//! Cells and nodes are integers throughout: a position is never turned back into a cell id, so a ray
//! along a cell border neither stalls nor skips. A ray that enters a cell on or below its surface
//! hits it there; that closes the seam that rounding leaves between neighbouring cells.

use glam::Vec3;
use num_traits::{Float, FromPrimitive, NumCast};

use super::Search;
use crate::chunk::Chunk;
use crate::march::march_exact;
use crate::{Found, HeightField, MaxPyramid, Status};

technique! {
    /// The exact search has no parameters.
    Exact = "exact", reads Pyramid, casts_shadows true,
    summary "max pyramid and closed-form cells: always the first hit of the bilinear surface",
    source "Musgrave 1988; Ramsey, Potter and Hansen 2004; Tevs, Ihrke and Seidel 2008",
    parameters {}
}

/// Most nodes visited in `f32`, as on the device; then the search gives up as unconverged.
pub const MAX_STEPS_F32: u32 = 1 << 14;
/// Most nodes visited in `f64`: some hundred thousand tiles for a nearly horizontal ray, and still no
/// more than milliseconds, so that a batch of hopeless rays comes to an end.
pub const MAX_STEPS_F64: u32 = 1 << 20;

/// A ray in cell space: x and y in cells from the first, z the height.
#[derive(Debug, Clone, Copy)]
pub struct CellRay<T> {
    /// Start. On or below the lid.
    pub start: [T; 3],
    /// Direction, for one unit of the parameter.
    pub direction: [T; 3],
    /// Whether the start lies on the surface, which then does not count as a hit. Rounding is taken
    /// off: the ray starts at the very height of its cell.
    pub from_surface: bool,
}

/// Farther from the surface than this, a start is not on it, whatever the caller says.
pub(super) const ON_SURFACE: f64 = 1e-3;

/// Where a ray met the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellHit<T> {
    /// How the search ended.
    pub status: Status,
    /// Ray parameter of the hit.
    pub t: T,
    /// Cell that was hit.
    pub cell: [usize; 2],
    /// Position inside it, 0..1.
    pub local: [T; 2],
    /// Nodes visited.
    pub steps: u32,
}

/// One axis of the walk: which node the ray is in, and where its sides are.
#[derive(Debug, Clone, Copy)]
struct Axis<T> {
    /// Position at `t = 0`, relative to the lower side of the start cell.
    start: T,
    /// 1 / direction; 0 when the ray does not move along this axis.
    inverse: T,
    /// Node id at the current level.
    node: usize,
    /// Cell id 0 of the current tile, relative to the start cell.
    tile: i64,
    /// Cells in a tile.
    cells: usize,
    periodic: bool,
}

impl<T: Float + FromPrimitive> Axis<T> {
    #[inline(always)]
    fn new(position: T, direction: T, cells: usize, periodic: bool) -> Self {
        let n = int::<T>(cells as i64);
        let floor = position.floor();
        let cell = if periodic { floor - (floor / n).floor() * n } else { floor };
        let cell = cell.max(T::zero()).min(n - T::one());
        let start = if periodic { position - floor } else { position - cell };
        let inverse = direction.recip();
        let node = <usize as NumCast>::from(cell).unwrap_or(0);
        Self {
            start,
            inverse: if inverse.is_finite() { inverse } else { T::zero() },
            node,
            tile: -(node as i64),
            cells,
            periodic,
        }
    }

    /// When the ray reaches a plane between cells. Grows with the distance of the plane.
    #[inline(always)]
    fn time_of(&self, plane: i64) -> T {
        (int::<T>(plane) - self.start) * self.inverse
    }

    /// When the ray leaves the node.
    #[inline(always)]
    fn exit(&self, level: usize) -> T {
        if self.inverse == T::zero() {
            return T::infinity();
        }
        if self.inverse > T::zero() {
            let upper = ((self.node + 1) << level).min(self.cells);
            if !self.periodic && upper == self.cells {
                return T::infinity();
            }
            self.time_of(upper as i64 + self.tile)
        } else {
            let lower = self.node << level;
            if !self.periodic && lower == 0 {
                return T::infinity();
            }
            self.time_of(lower as i64 + self.tile)
        }
    }

    /// Steps into the next node; says whether that crossed a border of the parent.
    #[inline(always)]
    fn advance(&mut self, nodes: usize) -> bool {
        if self.inverse > T::zero() {
            self.node += 1;
            if self.node == nodes {
                self.node = 0;
                self.tile += self.cells as i64;
            }
            self.node.is_multiple_of(2)
        } else {
            let crosses = self.node.is_multiple_of(2);
            if self.node == 0 {
                self.node = nodes;
                self.tile -= self.cells as i64;
            }
            self.node -= 1;
            crosses
        }
    }

    /// Goes down to the child that the ray is in at time `t`.
    #[inline(always)]
    fn descend(&mut self, level: usize, t: T) {
        let child = 2 * self.node;
        let middle = (child + 1) << (level - 1);
        self.node = child;
        if middle >= self.cells {
            return;
        }
        let in_upper = if self.inverse > T::zero() {
            t >= self.time_of(middle as i64 + self.tile)
        } else if self.inverse < T::zero() {
            t < self.time_of(middle as i64 + self.tile)
        } else {
            self.start >= int::<T>(middle as i64 + self.tile)
        };
        if in_upper {
            self.node += 1;
        }
    }

    /// Position inside cell `node` (level 0) at time `t`.
    #[inline(always)]
    fn local(&self, t: T, direction: T) -> T {
        let x = self.start - int::<T>(self.node as i64 + self.tile) + t * direction;
        if x.is_finite() { x.max(T::zero()).min(T::one()) } else { T::zero() }
    }
}

#[inline(always)]
fn int<T: FromPrimitive + Float>(i: i64) -> T {
    T::from_i64(i).unwrap_or_else(T::zero)
}

/// The first root of a ray against one bilinear cell.
///
/// `gap` is ray height minus surface height at the entry, `z_gap(s) = gap + s * (slope + s * bend)`.
/// Returns the first `s` in `0..=length` where it reaches zero.
#[inline(always)]
pub(super) fn first_root<T: Float>(gap: T, slope: T, bend: T, length: T, from_surface: bool) -> Option<T> {
    let zero = T::zero();
    if from_surface {
        // The start itself is a root: only the other one counts.
        if slope < zero || (slope == zero && bend < zero) {
            return Some(zero);
        }
        let other = -slope / bend;
        return (bend < zero && other <= length).then_some(other);
    }
    if gap <= zero {
        return Some(zero);
    }
    let root = if bend == zero {
        if slope >= zero {
            return None;
        }
        -gap / slope
    } else {
        let two = T::one() + T::one();
        let discriminant = slope * slope - two * two * bend * gap;
        if discriminant < zero {
            return None;
        }
        let q =
            if slope >= zero { -(slope + discriminant.sqrt()) } else { discriminant.sqrt() - slope } / two;
        // With q > 0 the roots gap / q and q / bend are ordered; with q < 0 only q / bend can be positive.
        if q > zero {
            gap / q
        } else if bend < zero && q < zero {
            q / bend
        } else {
            return None;
        }
    };
    (root <= length).then_some(root)
}

/// Follows a ray through the pyramid to the first point on or below the surface.
#[inline(always)]
pub fn trace<T: Float + FromPrimitive>(
    field: &HeightField,
    pyramid: &MaxPyramid,
    ray: &CellRay<T>,
    max_steps: u32,
) -> CellHit<T> {
    let zero = T::zero();
    let [nx, ny] = field.cells();
    let [dx, dy, dz] = ray.direction;
    let mut z_start = ray.start[2];
    let rounding = T::epsilon() * int::<T>(8);
    let mut x = Axis::new(ray.start[0], dx, nx, field.is_periodic());
    let mut y = Axis::new(ray.start[1], dy, ny, field.is_periodic());
    let done = |status, t, x: &Axis<T>, y: &Axis<T>, local, steps| CellHit {
        status,
        t,
        cell: [x.node, y.node],
        local,
        steps,
    };
    let highest = T::from(pyramid.highest()).unwrap_or_else(zero_of);
    let flat_period = dz == zero && field.is_periodic() && (x.inverse == zero || y.inverse == zero);
    let levels = pyramid.levels();
    let top = levels.len() - 1;
    let mut level = if ray.from_surface { 0 } else { top };
    x.node >>= level;
    y.node >>= level;
    let mut t = zero;
    if dz >= zero && z_start > highest {
        return done(Status::Left, t, &x, &y, [zero; 2], 0);
    }
    let mut first = ray.from_surface;
    let mut steps = 0;
    while steps < max_steps {
        steps += 1;
        let nodes = levels[level].nodes;
        let maximum = T::from(pyramid.at(level, x.node, y.node)).unwrap_or_else(zero_of);
        let exit_x = x.exit(level);
        let exit_y = y.exit(level);
        let exit = exit_x.min(exit_y);
        let lowest = if dz < zero { z_start + dz * exit } else { z_start + dz * t };
        if lowest <= maximum {
            if level > 0 {
                if dz < zero {
                    t = t.max((maximum - z_start) / dz).min(exit);
                }
                x.descend(level, t);
                y.descend(level, t);
                level -= 1;
                continue;
            }
            let corners = field.cell(x.node, y.node);
            let [h00, h10, h01, h11] = corners.map(|h| T::from(h).unwrap_or_else(zero_of));
            let (lx, ly) = (x.local(t, dx), y.local(t, dy));
            let (along_x, along_y, twist) = (h10 - h00, h01 - h00, h11 - h10 - h01 + h00);
            let height = h00 + lx * along_x + ly * (along_y + lx * twist);
            let mut gap = z_start + dz * t - height;
            if first && gap.abs() <= T::from(ON_SURFACE).unwrap_or_else(zero_of) {
                z_start = z_start - gap;
                gap = zero;
            }
            // A light ray that enters a cell on the surface still leaves the point it started from.
            let on_surface = ray.from_surface && gap.abs() <= rounding;
            let slope = dz
                - (along_x + ly * twist) * moving(dx, along_x, twist)
                - (along_y + lx * twist) * moving(dy, along_y, twist);
            let bend = if twist == zero { zero } else { -twist * dx * dy };
            if let Some(s) = first_root(gap, slope, bend, exit - t, on_surface) {
                let hit = t + s;
                let local = [x.local(hit, dx), y.local(hit, dy)];
                return done(Status::Hit, hit, &x, &y, local, steps);
            }
        }
        first = false;
        t = t.max(exit);
        if !t.is_finite() || (dz > zero && z_start + dz * t > highest) {
            return done(Status::Left, t, &x, &y, [zero; 2], steps);
        }
        let crossed = if exit_x <= exit_y { x.advance(nodes[0]) } else { y.advance(nodes[1]) };
        if crossed && level < top {
            level += 1;
            x.node /= 2;
            y.node /= 2;
        }
        if flat_period && (x.tile.unsigned_abs() as usize > 2 * nx || y.tile.unsigned_abs() as usize > 2 * ny)
        {
            return done(Status::Left, t, &x, &y, [zero; 2], steps);
        }
    }
    done(Status::Unconverged, t, &x, &y, [zero; 2], steps)
}

/// A direction that matters only where the surface changes along it; keeps endless cells finite.
#[inline(always)]
fn moving<T: Float>(direction: T, along: T, twist: T) -> T {
    if along == T::zero() && twist == T::zero() { T::zero() } else { direction }
}

#[inline(always)]
fn zero_of<T: Float>() -> T {
    T::zero()
}

/// Turns a texture-space position into cell space.
#[inline(always)]
pub fn cell_position(field: &HeightField, u: f64, v: f64) -> [f64; 2] {
    let first = field.first_texel() as f64;
    [u * field.width() as f64 - 0.5 - first, v * field.height() as f64 - 0.5 - first]
}

impl Search for Exact {
    #[inline(always)]
    fn trace(&self, field: &HeightField, start: Vec3, delta: Vec3, _: f32, from_surface: bool) -> Found {
        let first = field.first_texel() as f32;
        let (w, h) = (field.width() as f32, field.height() as f32);
        let ray = CellRay {
            start: [start.x * w - 0.5 - first, start.y * h - 0.5 - first, start.z],
            direction: [delta.x * w, delta.y * h, delta.z],
            from_surface,
        };
        let hit = trace(field, field.pyramid(), &ray, MAX_STEPS_F32);
        Found { tau: hit.t, status: hit.status, steps: hit.steps }
    }

    #[inline(always)]
    fn march(&self, field: &HeightField, chunk: &mut Chunk<'_>) {
        march_exact(field, chunk);
    }
}
