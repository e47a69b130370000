//! Sphere tracing through a distance map: each step goes as far as the ball around the ray is empty, or to
//! the cell's wall after the bilinear cell was solved in closed form.
//!
//! William Donnelly, Per-Pixel Displacement Mapping with Distance Functions, GPU Gems 2, chapter 8, 2005.
//! There the map is no lower bound, a fixed number of steps is taken and the last one is the hit. Here a
//! step is never longer than the map's bound and never shorter than the way through a cell, so nothing is
//! missed and hits are exact.

use super::cell_walk::{CellWalk, Cells, Leap, Patch, Stand};
use crate::lanes::Lanes;
use crate::{DistanceMap, HeightField, Wrap};

technique! {
    /// Parameters of [`search`](super::Search::trace) as described above.
    Distance = "distance", reads Distance, casts_shadows true,
    summary "steps as far as a ball is empty, closed-form cells near the surface: misses nothing",
    source "Donnelly 2005",
    parameters { steps: 16384 in 1..=65536, "Most steps; a ray that needs more is unconverged."; }
}

/// What rounding of the position costs a step, as a share of the way that the ray came, and of the step.
const DRIFT: f32 = 8.0 * f32::EPSILON;

/// The texels whose footprints the points are in, along one axis: a footprint ends half-way to the next.
#[inline(always)]
fn nearest<L: Lanes>(field: &HeightField, id: L::I, local: L::F, texels: usize) -> L::I {
    let (zero, one) = (L::splat_int(0), L::splat_int(1));
    let last = L::splat_int(texels as i32 - 1);
    let at = id + L::select_int(L::le(L::splat(0.5), local), one, zero);
    match field.wrap() {
        Wrap::Repeat => L::select_int(L::lt_int(last, at), zero, at),
        // The cells begin one texel before the first.
        Wrap::Clamp => L::min_int(L::select_int(L::lt_int(at, one), zero, at - one), last),
        Wrap::Mirror => {
            let back = last + one + last - at;
            L::select_int(L::lt_int(back, zero), zero, L::min_int(at, back))
        }
    }
}

/// Lower bounds of the distance from points at heights `z` to the surface.
#[inline(always)]
fn distance<L: Lanes>(map: &DistanceMap, cells: &Cells<'_, L>, patch: &Patch<L>, z: L::F) -> L::F {
    let [w, h, depth] = map.size();
    let column = nearest::<L>(cells.field, patch.id[0], patch.local[0], w);
    let row = nearest::<L>(cells.field, patch.id[1], patch.local[1], h);
    let z = L::max(z * L::splat(depth as f32), L::splat(0.0));
    let slice = L::to_int(L::min(z, L::splat((depth - 1) as f32)));
    let mut at = [[0; 16]; 3];
    for (at, id) in at.iter_mut().zip([column, row, slice]) {
        L::store_int(id, at);
    }
    // Codes of 16 bits, of which there may be more than an `i32` can number.
    let mut found = [0.0; 16];
    for (lane, found) in found[..L::WIDTH].iter_mut().enumerate() {
        let [i, j, k] = at.map(|ids| ids[lane].max(0) as usize);
        *found = map.distance(i.min(w - 1), j.min(h - 1), k.min(depth - 1));
    }
    L::load(&found)
}

impl Leap for Distance {
    type Maps<'a> = &'a DistanceMap;

    #[inline(always)]
    fn maps<'a>(&self, field: &'a HeightField) -> Option<&'a DistanceMap> {
        field.distance_map()
    }

    #[inline(always)]
    fn most_steps(&self) -> u32 {
        self.steps
    }

    /// 1 / speed, in mesh units.
    #[inline(always)]
    fn pace<L: Lanes>(map: &DistanceMap, delta: [L::F; 3]) -> L::F {
        let metric = map.metric();
        let [x, y, z] =
            [delta[0] * L::splat(metric.x), delta[1] * L::splat(metric.y), delta[2] * L::splat(metric.z)];
        // A standing ray is taken to be slow enough for any distance to be a whole step.
        L::splat(1.0) / L::max(L::sqrt(x * x + y * y + z * z), L::splat(1e-30))
    }

    #[inline(always)]
    fn leap<L: Lanes>(map: &DistanceMap, rays: &CellWalk<L>, cells: &Cells<'_, L>, at: &Stand<L>) -> L::F {
        let free = distance(map, cells, &at.patch, rays.z(rays.t)) * rays.pace;
        rays.t + (free * L::splat(1.0 - DRIFT) - rays.t * L::splat(DRIFT))
    }
}

impl Distance {
    /// What it walks by.
    #[inline(always)]
    pub(crate) fn walk(&self) -> Self {
        *self
    }
}

search_by_leaps!(Distance);
