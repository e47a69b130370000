//! Stepping by cones; shared by every search that reads a cone map. The twin of
//! `shaders_wgsl/lib/cone_walk.wgsl`.
//!
//! Above a point of the surface, at a gap `g` over it, a ray that moves `l` sideways (UV units) while it
//! rises by `z` stays in the empty cone of ratio `c` for `c g / (l - c z)`. Where that does not take it
//! out of its cell, the ray is solved against the bilinear cell in closed form instead and goes on at
//! the cell's wall. So every step gains a cell at least, thin features are met wherever they stand, and
//! hits are exact.
//!
//! In a relaxed cone the ray may go below the surface, once. Where it ends up below, the way there is
//! halved a few times and what is left of it followed cell by cell. That holds for rays that do not
//! rise; the others use empty cones.

use glam::Vec3;

use super::exact::{ON_SURFACE, first_root};
use super::walk_axis::Axis;
use crate::{Found, HeightField, Status};

/// Farther than this, in cells, `f32` no longer tells cells apart.
const FAR: f32 = 1e9;
/// A light ray that enters a cell this close to its surface still leaves the point it started from.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// What a walk reads, and how long it may take.
#[derive(Debug, Clone, Copy)]
pub struct Cones<'a> {
    /// Empty cones, laid out as [`ConeMap::values`](crate::ConeMap::values).
    pub empty: &'a [f32],
    /// Relaxed cones, laid out alike, or nothing.
    pub relaxed: &'a [f32],
    /// Halvings of a jump that ended below the surface.
    pub refine: u32,
    /// Most steps.
    pub most_steps: u32,
}

/// The bilinear cell under the ray.
struct Patch {
    at: usize,
    local: [f32; 2],
    along: [f32; 2],
    twist: f32,
    height: f32,
}

impl Patch {
    #[inline(always)]
    fn new(field: &HeightField, x: &Axis, y: &Axis, t: f32) -> Self {
        let (i, j) = (x.id(), y.id());
        let [h00, h10, h01, h11] = field.cell(i, j);
        let (lx, ly) = (x.local(t), y.local(t));
        let along = [h10 - h00, h01 - h00];
        let twist = (h11 - h10) - (h01 - h00);
        Self {
            at: j * (field.cells()[0] + 1) + i,
            local: [lx, ly],
            along,
            twist,
            height: h00 + lx * along[0] + ly * (along[1] + lx * twist),
        }
    }
}

/// The ratio for the point under the ray: of its cell, or interpolated between its corners.
#[inline(always)]
fn ratio<const BILINEAR: bool>(cones: &[f32], stride: usize, patch: &Patch) -> f32 {
    if !BILINEAR {
        return cones[patch.at];
    }
    let [x, y] = patch.local;
    let row = |at: usize| cones[at] + x * (cones[at + 1] - cones[at]);
    let (upper, lower) = (row(patch.at), row(patch.at + stride));
    upper + y * (lower - upper)
}

/// Follows a segment to the first point on or below the surface.
///
/// `BILINEAR` when the ratios belong to corners; `RELAXED` when there are relaxed cones. With
/// `from_surface` the start lies on the surface and is no hit.
#[inline(always)]
pub fn walk<const BILINEAR: bool, const RELAXED: bool>(
    field: &HeightField,
    cones: &Cones<'_>,
    start: Vec3,
    delta: Vec3,
    from_surface: bool,
) -> Found {
    let [nx, ny] = field.cells();
    let (w, h) = (field.width() as f32, field.height() as f32);
    let first_texel = field.first_texel() as f32;
    let (dx, dy, dz) = (delta.x * w, delta.y * h, delta.z);
    if dx.abs().max(dy.abs()) >= FAR || dx.is_nan() || dy.is_nan() {
        return Found { tau: 0.0, status: Status::Unconverged, steps: 0 };
    }
    let periodic = field.is_periodic();
    let mut x = Axis::new(start.x * w - 0.5 - first_texel, dx, nx, periodic);
    let mut y = Axis::new(start.y * h - 0.5 - first_texel, dy, ny, periodic);
    let lateral = (delta.x * delta.x + delta.y * delta.y).sqrt();
    let relaxed = RELAXED && dz <= 0.0;
    let open = if relaxed { cones.relaxed } else { cones.empty };
    let mut z_start = start.z;
    let mut t = 0.0_f32;
    // Up to here the ray is followed cell by cell.
    let mut closed_until = 0.0_f32;
    for steps in 1..=cones.most_steps {
        let patch = Patch::new(field, &x, &y, t);
        let mut gap = z_start + dz * t - patch.height;
        if from_surface && steps == 1 && gap.abs() <= ON_SURFACE as f32 {
            z_start -= gap;
            gap = 0.0;
        }
        let on_surface = from_surface && gap.abs() <= ROUNDING;
        if gap <= 0.0 && !on_surface {
            return Found::hit(t, steps);
        }
        let exit_x = x.exit();
        let exit_y = y.exit();
        let exit = exit_x.min(exit_y);
        let mut jump = t;
        if gap > 0.0 && !(RELAXED && t < closed_until) {
            let c = ratio::<BILINEAR>(open, nx + 1, &patch);
            let closing = lateral - c * dz;
            if closing > 0.0 {
                jump = t + c * gap / closing;
            } else if c > 0.0 {
                jump = f32::INFINITY;
            }
        }
        if jump > exit || jump == f32::INFINITY {
            if jump == f32::INFINITY {
                return Found::left(steps);
            }
            let (from_x, from_y) = (x, y);
            x.place(jump);
            y.place(jump);
            if relaxed && z_start + dz * jump <= Patch::new(field, &x, &y, jump).height {
                let (mut above, mut below) = (t, jump);
                (x, y) = (from_x, from_y);
                for _ in 0..cones.refine {
                    let middle = 0.5 * (above + below);
                    let (mut at_x, mut at_y) = (x, y);
                    at_x.place(middle);
                    at_y.place(middle);
                    if at_x.cell == x.cell && at_y.cell == y.cell {
                        break;
                    }
                    if z_start + dz * middle <= Patch::new(field, &at_x, &at_y, middle).height {
                        below = middle;
                    } else {
                        (above, x, y) = (middle, at_x, at_y);
                    }
                }
                t = above;
                closed_until = below;
            } else {
                t = jump;
            }
        } else {
            let [lx, ly] = patch.local;
            let slope =
                dz - (patch.along[0] + ly * patch.twist) * dx - (patch.along[1] + lx * patch.twist) * dy;
            let bend = -patch.twist * dx * dy;
            if let Some(s) = first_root(gap, slope, bend, exit - t, on_surface) {
                return Found::hit(t + s, steps);
            }
            t = t.max(exit);
            if exit_x <= exit_y { x.advance() } else { y.advance() }
        }
        // A falling ray meets the floor; the others end with their segment.
        if !t.is_finite() || (dz >= 0.0 && t > 1.0) {
            return Found::left(steps);
        }
    }
    Found { tau: t.min(1.0), status: Status::Unconverged, steps: cones.most_steps }
}
