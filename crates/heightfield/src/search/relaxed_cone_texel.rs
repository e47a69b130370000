//! The same walk as [`super::relaxed_cone`] with the published maps, interpolated between texels: their
//! cones are pierced more than once here and there, and what a step jumps over is missed. It is here to
//! show that.
//!
//! Fabio Policarpo and Manuel Oliveira, Relaxed Cone Stepping for Relief Mapping, GPU Gems 3, chapter 18,
//! 2007.

use super::cone_walk::ConeWalk;
use crate::ConeKind;

technique! {
    /// Parameters of [`search`](super::Search::trace) as described above.
    RelaxedConeTexel = "relaxed_cone_texel", reads RelaxedConeTexel, casts_shadows true,
    summary "the same with the published maps, pierced more than once: to show what that misses",
    source "Policarpo and Oliveira 2007",
    parameters { steps: 16384 in 1..=65536, "Most steps; a ray that needs more is unconverged."; refine: 12 in 0..=32, "Halvings of a jump that ends below the surface, before it is followed cell by cell."; }
}

impl RelaxedConeTexel {
    /// What it walks by.
    #[inline(always)]
    pub(crate) fn walk(&self) -> ConeWalk<true> {
        ConeWalk {
            empty: ConeKind::ConeTexel,
            relaxed: Some(ConeKind::RelaxedConeTexel),
            refine: self.refine,
            most_steps: self.steps,
        }
    }
}

search_by_leaps!(RelaxedConeTexel);
