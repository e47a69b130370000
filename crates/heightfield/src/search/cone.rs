//! Cone stepping that misses nothing: each step goes as far as an empty cone reaches, or to the cell's
//! wall after the bilinear cell was solved in closed form.
//!
//! Jonathan Dummer, Cone Step Mapping: An Iterative Ray-Heightfield Intersection Algorithm, 2006; Robert
//! Ban, Gabor Valasek, Csaba Balint and Viktor Vad, Robust Cone Step Mapping, EGSR 2024 (a least step and
//! cones that hold for the bilinear surface).

use super::cone_walk::ConeWalk;
use crate::ConeKind;

technique! {
    /// Parameters of [`search`](super::Search::trace) as described above.
    Cone = "cone", reads Cone, casts_shadows true,
    summary "steps as far as an empty cone reaches, closed-form cells near the surface: misses nothing",
    source "Dummer 2006; Ban, Valasek, Balint and Vad 2024",
    parameters { steps: 16384 in 1..=65536, "Most steps; a ray that needs more is unconverged."; }
}

impl Cone {
    /// What it walks by.
    #[inline(always)]
    pub(crate) fn walk(&self) -> ConeWalk<false> {
        ConeWalk { empty: ConeKind::Cone, relaxed: None, refine: 0, most_steps: self.steps }
    }
}

search_by_leaps!(Cone);
