//! Sphere tracing through a distance map: each step goes as far as the ball around the ray is empty, or to
//! the cell's wall after the bilinear cell was solved in closed form.
//!
//! William Donnelly, Per-Pixel Displacement Mapping with Distance Functions, GPU Gems 2, chapter 8, 2005.
//! There the map is no lower bound, a fixed number of steps is taken and the last one is the hit. Here a
//! step is never longer than the map's bound and never shorter than the way through a cell, so nothing is
//! missed and hits are exact.

use glam::Vec3;

use super::Search;
use super::cell_walk::{CellWalk, NOTHING, Patch};
use crate::{DistanceMap, Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::trace) as described above.
    Distance = "distance", reads Distance, casts_shadows true,
    summary "steps as far as a ball is empty, closed-form cells near the surface: misses nothing",
    source "Donnelly 2005",
    parameters { steps: 16384 in 1..=65536, "Most steps; a ray that needs more is unconverged."; }
}

/// What rounding of the position costs a step, as a share of the way that the ray came, and of the step.
const DRIFT: f32 = 8.0 * f32::EPSILON;

/// The least distance from a point at height `z` over a cell to the surface.
#[inline(always)]
fn distance(field: &HeightField, map: &DistanceMap, patch: &Patch, z: f32) -> f32 {
    let [w, h, depth] = map.size();
    // The footprint of a texel ends half-way to the next.
    let texel = |axis: usize, n: usize| {
        let nearest = patch.id[axis] as i64 + field.first_texel() + i64::from(patch.local[axis] >= 0.5);
        field.wrap().index(nearest, n)
    };
    let slice = ((z * depth as f32) as usize).min(depth - 1);
    map.distance(texel(0, w), texel(1, h), slice)
}

impl Search for Distance {
    #[inline(always)]
    fn trace(&self, field: &HeightField, start: Vec3, delta: Vec3, _: f32, from_surface: bool) -> Found {
        let Some(map) = field.distance_map() else { return NOTHING };
        let Some(mut ray) = CellWalk::new(field, start, delta, from_surface) else { return NOTHING };
        // A standing ray is taken to be slow enough for any distance to be a whole step.
        let inverse_speed = (delta * map.metric()).length().max(1e-30).recip();
        for steps in 1..=self.steps {
            let stand = ray.stand(field);
            if stand.gap <= 0.0 && !stand.on_surface {
                return Found::hit(ray.t, steps);
            }
            let free = distance(field, map, &stand.patch, ray.z(ray.t)) * inverse_speed;
            let jump = ray.t + (free * (1.0 - DRIFT) - ray.t * DRIFT);
            if jump > stand.exit() {
                ray.jump(jump);
            } else if let Some(t) = ray.cross(&stand) {
                return Found::hit(t, steps);
            }
            if ray.has_left() {
                return Found::left(steps);
            }
        }
        ray.unconverged(self.steps)
    }
}
