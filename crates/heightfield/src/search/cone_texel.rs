//! The same walk as [`super::cone`] with the published cone map, interpolated between texels: what its
//! cones cut off the surface is missed. It is here to show that.
//!
//! Jonathan Dummer, Cone Step Mapping: An Iterative Ray-Heightfield Intersection Algorithm, 2006.

use super::cone_walk::ConeWalk;
use crate::ConeKind;

technique! {
    /// Parameters of [`search`](super::Search::trace) as described above.
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

search_by_leaps!(ConeTexel);
