//! Interval mapping: equal layers, then secant steps that always keep the crossing between the last
//! position above and the last below (regula falsi).
//!
//! Eric Risser, Musawir Shah and Sumanta Pattanaik, Interval Mapping, University of Central Florida,
//! 2005; Faster Relief Mapping Using the Secant Method, Journal of Graphics Tools 12(3), 2007.

use glam::Vec3;

use super::Search;
use super::layers::{Bracket, any_below, first_below, gap_at, secant};
use crate::{Found, HeightField};

technique! {
    /// Parameters of [`search`](Search::search) as described above.
    Interval = "interval", reads Heights, casts_shadows true,
    summary "equal layers, then regula falsi inside the bracket",
    source "Risser, Shah and Pattanaik 2007",
    parameters { linear: 24 in 1..=4096, "Equal layers between lid and floor."; refine: 4 in 0..=32, "Secant steps inside the bracket."; }
}

impl Search for Interval {
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> Found {
        let bracket = first_below(field, start, delta, self.linear);
        if !bracket.found {
            return Found::left(bracket.steps);
        }
        let Bracket { mut above, mut below, mut gap_above, mut gap_below, .. } = bracket;
        for _ in 0..self.refine {
            let tau = secant(above, below, gap_above, gap_below);
            let gap = gap_at(field, start, delta, tau);
            if gap <= 0.0 {
                below = tau;
                gap_below = gap;
            } else {
                above = tau;
                gap_above = gap;
            }
        }
        Found::hit(secant(above, below, gap_above, gap_below), bracket.steps + self.refine)
    }

    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, _cos_theta: f32) -> bool {
        any_below(field, start, delta, self.linear)
    }
}
