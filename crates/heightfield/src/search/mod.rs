//! The searches: where does a ray meet the height field? One file each, and one of the same name
//! in `shaders_wgsl/search/` with the same function names and argument order.

use glam::Vec3;

use crate::chunk::Chunk;
use crate::technique::TechniqueInfo;
use crate::{Found, HeightField, Status};

/// What each technique's file provides; the twin of the two functions in its WGSL file.
pub trait Search: Sized {
    /// Searches the segment from `start` to `start + delta` (texture space).
    ///
    /// `cos_theta` is the cosine between ray and normal in mesh units. With `from_surface` the segment
    /// starts on the surface, and the start itself is no hit; searches that do not look at the start need
    /// not know.
    fn trace(
        &self,
        field: &HeightField,
        start: Vec3,
        delta: Vec3,
        cos_theta: f32,
        from_surface: bool,
    ) -> Found;

    /// [`Search::trace`] for a segment that starts anywhere.
    #[inline(always)]
    fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32) -> Found {
        self.trace(field, start, delta, cos_theta, false)
    }

    /// Whether a segment that starts on the surface and goes up is blocked. What lies beyond its end, the
    /// light, throws no shadow.
    #[inline(always)]
    fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32) -> bool {
        let found = self.trace(field, start, delta, cos_theta, true);
        found.status == Status::Hit && found.tau <= 1.0
    }

    /// Runs the search over many rays.
    fn march(&self, field: &HeightField, chunk: &mut Chunk<'_>);
}

/// Declares a technique: its parameter struct and its [`TechniqueInfo`].
macro_rules! technique {
    (
        $(#[$doc:meta])*
        $type:ident = $name:literal, reads $reads:ident, casts_shadows $shadows:literal,
        summary $summary:literal,
        source $source:literal,
        parameters { $($(#[$pdoc:meta])* $parameter:ident: $default:literal in $min:literal..=$max:literal, $psummary:literal;)* }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct $type { $(#[doc = $psummary] pub $parameter: u32,)* }

        /// The registry entry of this technique.
        pub static INFO: $crate::TechniqueInfo = $crate::TechniqueInfo {
            name: $name,
            summary: $summary,
            source: $source,
            parameters: &[$($crate::Parameter {
                name: stringify!($parameter),
                summary: $psummary,
                default: $default as f64,
                min: $min as f64,
                max: $max as f64,
            },)*],
            reads: $crate::technique::Reads::$reads,
            casts_shadows: $shadows,
            search: |field, start, delta, cos_theta, values| {
                $crate::search::Search::search(&$type::read(values), field, start, delta, cos_theta)
            },
            occluded: |field, start, delta, cos_theta, values| {
                $crate::search::Search::occluded(&$type::read(values), field, start, delta, cos_theta)
            },
            march: |field, values, chunk| $crate::search::Search::march(&$type::read(values), field, chunk),
        };

        impl $type {
            #[inline(always)]
            fn read(values: &$crate::technique::Values) -> Self {
                let [$($parameter,)* ..] = *values;
                Self { $($parameter: $parameter as u32,)* }
            }
        }
    };
}

/// Makes a [`Search`] of a technique whose `walk` gives a [`cell_walk::Leap`]. A blanket implementation would
/// meet the one for [`WideSearch`](crate::wide::WideSearch).
macro_rules! search_by_leaps {
    ($type:ident) => {
        impl $crate::search::Search for $type {
            #[inline(always)]
            fn trace(
                &self,
                field: &$crate::HeightField,
                start: glam::Vec3,
                delta: glam::Vec3,
                _: f32,
                from_surface: bool,
            ) -> $crate::Found {
                $crate::search::cell_walk::trace(&self.walk(), field, start, delta, from_surface)
            }

            #[inline(always)]
            fn march(&self, field: &$crate::HeightField, chunk: &mut $crate::chunk::Chunk<'_>) {
                $crate::wide::leaps::march(&self.walk(), self, field, chunk);
            }
        }
    };
}

pub mod binary;
pub mod cell_walk;
pub mod cone;
pub mod cone_texel;
pub mod cone_walk;
pub mod distance;
pub mod exact;
pub mod interval;
pub mod layers;
pub mod parallax;
pub mod parallax_limited;
pub mod pom;
pub mod relaxed_cone;
pub mod relaxed_cone_texel;
pub mod relief;
pub mod steep;
pub mod steep_exponential;
pub mod steep_linear;
pub mod walk_axis;

/// All techniques that search, in the order users see them.
pub static REGISTRY: &[&TechniqueInfo] = &[
    &parallax::INFO,
    &parallax_limited::INFO,
    &steep::INFO,
    &steep_linear::INFO,
    &steep_exponential::INFO,
    &binary::INFO,
    &relief::INFO,
    &pom::INFO,
    &interval::INFO,
    &cone_texel::INFO,
    &relaxed_cone_texel::INFO,
    &cone::INFO,
    &relaxed_cone::INFO,
    &distance::INFO,
    &exact::INFO,
];
