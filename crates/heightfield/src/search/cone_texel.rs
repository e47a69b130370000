//! The same walk as [`super::cone`] with the published cone map, interpolated between texels: what its
//! cones cut off the surface is missed. It is here to show that.
//!
//! Jonathan Dummer, Cone Step Mapping: An Iterative Ray-Heightfield Intersection Algorithm, 2006.

use glam::Vec3;

use super::Search;
use super::cell_walk::trace;
use super::cone_walk::ConeWalk;
use crate::chunk::Chunk;
use crate::wide::leaps;
use crate::{ConeKind, Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::trace) as described above.
    ConeTexel = "cone_texel", reads ConeTexel, casts_shadows true,
    summary "the same with the published cone map, whose cones cut the surface: to show what that misses",
    source "Dummer 2006",
    parameters { steps: 16384 in 1..=65536, "Most steps; a ray that needs more is unconverged."; }
}

impl ConeTexel {
    /// What it walks by.
    #[inline(always)]
    pub(crate) fn walk(&self) -> ConeWalk<true> {
        ConeWalk { empty: ConeKind::ConeTexel, relaxed: None, refine: 0, most_steps: self.steps }
    }
}

impl Search for ConeTexel {
    #[inline(always)]
    fn trace(&self, field: &HeightField, start: Vec3, delta: Vec3, _: f32, from_surface: bool) -> Found {
        trace(&self.walk(), field, start, delta, from_surface)
    }

    #[inline(always)]
    fn march(&self, field: &HeightField, chunk: &mut Chunk<'_>) {
        leaps::march(&self.walk(), self, field, chunk);
    }
}
