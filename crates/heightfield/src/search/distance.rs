//! Sphere tracing through a distance map: each step goes as far as the ball around the ray is empty, or to
//! the cell's wall after the bilinear cell was solved in closed form.
//!
//! William Donnelly, Per-Pixel Displacement Mapping with Distance Functions, GPU Gems 2, chapter 8, 2005.
//! There the map is no lower bound, a fixed number of steps is taken and the last one is the hit. Here a
//! step is never longer than the map's bound and never shorter than the way through a cell, so nothing is
//! missed and hits are exact.

use glam::Vec3;

use super::Search;
use super::exact::{ON_SURFACE, first_root};
use super::walk_axis::Axis;
use crate::{DistanceMap, Found, HeightField, Status};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    Distance = "distance", reads Distance, casts_shadows true,
    summary "steps as far as a ball is empty, closed-form cells near the surface: misses nothing",
    source "Donnelly 2005",
    parameters { steps: 16384 in 1..=65536, "Most steps; a ray that needs more is unconverged."; }
}

/// Farther than this, in cells, `f32` no longer tells cells apart.
const FAR: f32 = 1e9;
/// A light ray that enters a cell this close to its surface still leaves the point it started from.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// What rounding of the position costs a step, as a share of the way that the ray came, and of the step.
const DRIFT: f32 = 8.0 * f32::EPSILON;

/// The bilinear cell under the ray.
struct Cell {
    id: [usize; 2],
    local: [f32; 2],
    along: [f32; 2],
    twist: f32,
    height: f32,
}

impl Cell {
    #[inline(always)]
    fn new(field: &HeightField, x: &Axis, y: &Axis, t: f32) -> Self {
        let id = [x.id(), y.id()];
        let [h00, h10, h01, h11] = field.cell(id[0], id[1]);
        let local = [x.local(t), y.local(t)];
        let along = [h10 - h00, h01 - h00];
        let twist = (h11 - h10) - (h01 - h00);
        let height = h00 + local[0] * along[0] + local[1] * (along[1] + local[0] * twist);
        Self { id, local, along, twist, height }
    }

    /// The least distance from here to the surface.
    #[inline(always)]
    fn distance(&self, field: &HeightField, map: &DistanceMap, z: f32) -> f32 {
        let [w, h, depth] = map.size();
        // The footprint of a texel ends half-way to the next.
        let texel = |axis: usize, n: usize| {
            let nearest = self.id[axis] as i64 + field.first_texel() + i64::from(self.local[axis] >= 0.5);
            field.wrap().index(nearest, n)
        };
        let slice = ((z * depth as f32) as usize).min(depth - 1);
        map.distance(texel(0, w), texel(1, h), slice)
    }
}

impl Distance {
    #[inline(always)]
    fn trace(&self, field: &HeightField, start: Vec3, delta: Vec3, from_surface: bool) -> Found {
        let Some(map) = field.distance_map() else {
            return Found { tau: 0.0, status: Status::Unconverged, steps: 0 };
        };
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
        // A standing ray is taken to be slow enough for any distance to be a whole step.
        let inverse_speed = (delta * map.metric()).length().max(1e-30).recip();
        let mut z_start = start.z;
        let mut t = 0.0_f32;
        for steps in 1..=self.steps {
            let cell = Cell::new(field, &x, &y, t);
            let mut gap = z_start + dz * t - cell.height;
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
            let free = cell.distance(field, map, z_start + dz * t) * inverse_speed;
            let jump = t + (free * (1.0 - DRIFT) - t * DRIFT);
            if jump > exit {
                t = jump;
                x.place(t);
                y.place(t);
            } else {
                let [lx, ly] = cell.local;
                let slope =
                    dz - (cell.along[0] + ly * cell.twist) * dx - (cell.along[1] + lx * cell.twist) * dy;
                let bend = -cell.twist * dx * dy;
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
        Found { tau: t.min(1.0), status: Status::Unconverged, steps: self.steps }
    }
}

impl Search for Distance {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> Found {
        self.trace(field, start, delta, false)
    }

    #[inline(always)]
    fn leave(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> Found {
        self.trace(field, start, delta, true)
    }

    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> bool {
        let found = self.trace(field, start, delta, true);
        // What lies beyond the light throws no shadow.
        found.status == Status::Hit && found.tau <= 1.0
    }
}
