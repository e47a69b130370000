//! Searches over many rays side by side.
//!
//! A search that implements [`WideSearch`] is written once for any number of lanes; the search for one
//! ray, which the device's is compared with, is the same code with one lane, and so gives the same bits.

mod heights;
pub(crate) mod leaps;
mod march;

use glam::Vec3;

use crate::lanes::{Lanes, Portable};
use crate::search::Search;
use crate::{Found, HeightField, Status};

pub use heights::Heights;
pub(crate) use march::march;

/// Segments to search: see [`crate::Segment`].
#[derive(Clone, Copy)]
pub struct Segments<L: Lanes> {
    /// Where they start: u, v, z.
    pub start: [L::F; 3],
    /// End minus start.
    pub delta: [L::F; 3],
    /// Cosine between ray and normal in mesh units.
    pub cos_theta: L::F,
}

impl<L: Lanes> Segments<L> {
    /// The same segment in every lane.
    #[inline(always)]
    pub fn one(start: Vec3, delta: Vec3, cos_theta: f32) -> Self {
        Self {
            start: [L::splat(start.x), L::splat(start.y), L::splat(start.z)],
            delta: [L::splat(delta.x), L::splat(delta.y), L::splat(delta.z)],
            cos_theta: L::splat(cos_theta),
        }
    }

    /// Ray height minus surface height at `tau`.
    #[inline(always)]
    pub fn gap_at(&self, heights: &Heights<'_, L>, tau: L::F) -> L::F {
        let u = self.start[0] + self.delta[0] * tau;
        let v = self.start[1] + self.delta[1] * tau;
        self.start[2] + self.delta[2] * tau - heights.sample(u, v)
    }
}

/// What searches find: see [`Found`]. Lanes without a hit left the relief.
#[derive(Clone, Copy)]
pub struct Findings<L: Lanes> {
    /// Position along the segment.
    pub tau: L::F,
    /// Which met the surface.
    pub hit: L::M,
    /// Height reads.
    pub steps: L::I,
}

/// A search over any number of segments at once, which does not look at their starts.
pub trait WideSearch: Copy {
    /// As [`Search::trace`]. Lanes are independent of each other.
    fn search<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> Findings<L>;

    /// As [`Search::occluded`].
    fn occluded<L: Lanes>(&self, heights: &Heights<'_, L>, rays: &Segments<L>) -> L::M;
}

impl<S: WideSearch> Search for S {
    #[inline(always)]
    fn trace(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32, _: bool) -> Found {
        type One = Portable<1>;
        let rays = Segments::one(start, delta, cos_theta);
        let found = WideSearch::search::<One>(self, &Heights::new(field), &rays);
        let (mut tau, mut steps) = ([0.0], [0]);
        One::store(found.tau, &mut tau);
        One::store_int(found.steps, &mut steps);
        let status = if One::any(found.hit) { Status::Hit } else { Status::Left };
        Found { tau: tau[0], status, steps: steps[0] as u32 }
    }

    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32) -> bool {
        type One = Portable<1>;
        let rays = Segments::one(start, delta, cos_theta);
        One::any(WideSearch::occluded::<One>(self, &Heights::new(field), &rays))
    }

    #[inline(always)]
    fn march(&self, field: &HeightField, chunk: &mut crate::chunk::Chunk<'_>) {
        march(self, field, chunk);
    }
}

#[cfg(test)]
mod tests;
