//! Relaxed cone stepping that misses nothing: steps through cones that a ray pierces at most once; where
//! one ends below the surface, the crossing lies in it and halving finds it. Rays that rise, such as those
//! to a light, step by empty cones.
//!
//! Fabio Policarpo and Manuel Oliveira, Relaxed Cone Stepping for Relief Mapping, GPU Gems 3, chapter 18,
//! 2007; Robert Ban, Gabor Valasek, Csaba Balint and Viktor Vad, Robust Cone Step Mapping, EGSR 2024 (cones
//! that are pierced once).

use super::cone_walk::ConeWalk;
use crate::ConeKind;

technique! {
    /// Parameters of [`search`](super::Search::trace) as described above.
    RelaxedCone = "relaxed_cone", reads RelaxedCone, casts_shadows true,
    summary "steps through cones that a ray pierces at most once, then halves: misses nothing",
    source "Policarpo and Oliveira 2007; Ban, Valasek, Balint and Vad 2024",
    parameters { steps: 16384 in 1..=65536, "Most steps; a ray that needs more is unconverged."; refine: 12 in 0..=32, "Halvings of a jump that ends below the surface, before it is followed cell by cell."; }
}

impl RelaxedCone {
    /// What it walks by.
    #[inline(always)]
    pub(crate) fn walk(&self) -> ConeWalk<false> {
        ConeWalk {
            empty: ConeKind::Cone,
            relaxed: Some(ConeKind::RelaxedCone),
            refine: self.refine,
            most_steps: self.steps,
        }
    }
}

search_by_leaps!(RelaxedCone);
