//! Rays to segments, searches over these, and hits back to rays.

use super::{Heights, Segments, WideSearch};
use crate::HeightField;
use crate::chunk::{Chunk, Outcome};
use crate::lanes::Lanes;
use crate::lanes::{Kernel, dispatch};
use crate::march::{march_one, period};
use crate::rays::load;

/// Runs a search on every ray of a chunk.
pub(crate) fn march<S: WideSearch>(search: &S, field: &HeightField, chunk: &mut Chunk<'_>) {
    dispatch(March { search, field, chunk });
}

/// A search to run over the rays of a chunk.
pub(super) struct March<'a, 'b, S> {
    pub search: &'a S,
    pub field: &'a HeightField,
    pub chunk: &'a mut Chunk<'b>,
}

impl<S: WideSearch> Kernel for March<'_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { search, field, chunk } = self;
        let heights = Heights::<L>::new(field);
        let n = chunk.origins.len();
        for at in (0..n).step_by(L::WIDTH) {
            if chunk.cancelled() {
                return;
            }
            let lanes = L::first(n - at);
            let origin = load::<L>(chunk.origins, at);
            let direction = load::<L>(chunk.directions, at);
            let clipped = clip::<L>(field, origin, direction);
            let found = search.search(&heights, &clipped.segments);
            let outcome = Outcome::<L> {
                hit: found.hit & clipped.meets,
                unconverged: L::first(0),
                t: clipped.t_start + L::widen(found.tau) * clipped.t_length,
                steps: L::select_int(clipped.meets, found.steps, L::splat_int(0)),
            };
            chunk.write_all(field, at, lanes & !clipped.level, &outcome, origin, direction);
            let mut level = L::bits(lanes & clipped.level);
            while level != 0 {
                march_one(search, field, chunk, at + level.trailing_zeros() as usize);
                level &= level - 1;
            }
        }
    }
}

/// The part of each ray between the lid or its origin and the floor or the lid.
pub(super) struct Clipped<L: Lanes> {
    pub segments: Segments<L>,
    pub t_start: L::D,
    pub t_length: L::D,
    /// Rays that come into the relief.
    pub meets: L::M,
    /// Rays with no end in the slab, for which the rest is of no use.
    pub level: L::M,
}

/// As [`crate::Segment::clip`].
#[inline(always)]
pub(super) fn clip<L: Lanes>(field: &HeightField, origin: [L::D; 3], direction: [L::D; 3]) -> Clipped<L> {
    let (zero, one) = (L::splat_wide(0.0), L::splat_wide(1.0));
    let [du, dv, dz] = direction;
    let oz = origin[2];
    let down = L::lt_wide(dz, zero);
    let up = L::lt_wide(zero, dz);
    let above = L::lt_wide(one, oz);
    let to_lid = (one - oz) / dz;
    let t_start = L::select_wide(above & down, to_lid, zero);
    let t_end = L::select_wide(down, L::max_wide((zero - oz) / dz, t_start), to_lid);
    let period = period(field.wrap());
    let mut u = origin[0] + du * t_start;
    let mut v = origin[1] + dv * t_start;
    if period > 0.0 {
        let period = L::splat_wide(period);
        u = u - L::floor_wide(u / period) * period;
        v = v - L::floor_wide(v / period) * period;
    }
    let z = L::select_wide(L::lt_wide(zero, t_start), one, oz);
    let t_length = t_end - t_start;
    let extent = field.extent();
    let x = du * L::splat_wide(f64::from(extent.tile_size[0]));
    let y = dv * L::splat_wide(f64::from(extent.tile_size[1]));
    let depth = dz * L::splat_wide(f64::from(extent.scale));
    let length = L::sqrt_wide(x * x + y * y + depth * depth);
    let steepness = L::max_wide(depth, zero - depth) / length;
    let cos_theta = L::select_wide(L::lt_wide(zero, length), steepness, one);
    Clipped {
        segments: Segments {
            start: [L::narrow(u), L::narrow(v), L::narrow(z)],
            delta: [L::narrow(du * t_length), L::narrow(dv * t_length), L::narrow(dz * t_length)],
            cos_theta: L::narrow(cos_theta),
        },
        t_start,
        t_length,
        meets: !(above & !down),
        level: !(down | up) & !above,
    }
}
