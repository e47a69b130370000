//! Rays that jump from cell to cell, many side by side.
//!
//! They take very unequal numbers of steps, so lanes whose ray has ended are handed new rays once they are
//! many enough.

use super::Segments;
use super::march::clip;
use crate::HeightField;
use crate::chunk::{Chunk, Outcome};
use crate::lanes::{Kernel, Lanes, dispatch};
use crate::march::march_one;
use crate::rays::load;
use crate::search::Search;
use crate::search::cell_walk::{CellWalk, Cells, Leap};

/// Rays looked at together: their segments stay in the first-level cache.
const BATCH: usize = 512;
/// Vectors may be read and written whole behind the last.
const ROOM: usize = BATCH + 16;

/// Runs a search on every ray of a chunk.
pub(crate) fn march<S: Leap>(leap: &S, search: &impl Search, field: &HeightField, chunk: &mut Chunk<'_>) {
    dispatch(March { leap, search, field, chunk });
}

/// A search to run over the rays of a chunk.
pub(super) struct March<'a, 'b, S, T> {
    pub leap: &'a S,
    /// The same for one ray.
    pub search: &'a T,
    pub field: &'a HeightField,
    pub chunk: &'a mut Chunk<'b>,
}

/// Segments that wait for a lane, and what was found of each.
struct Batch {
    /// Starts u, v, z, then ends less starts.
    rows: [[f32; ROOM]; 6],
    /// Which ray of the batch each is.
    ray: [i32; ROOM],
    waiting: usize,
    /// By ray: position along the segment, steps, and whether it hit (bit 0) or is unconverged (bit 1).
    tau: [f32; ROOM],
    steps: [i32; ROOM],
    ended: [u8; ROOM],
}

impl<S: Leap, T: Search> Kernel for March<'_, '_, S, T> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { leap, search, field, chunk } = self;
        let n = chunk.origins.len();
        let Some(maps) = leap.maps(field) else {
            (0..n).for_each(|i| march_one(search, field, chunk, i));
            return;
        };
        let cells = Cells::<L>::new(field);
        let mut batch = Batch {
            rows: [[0.0; ROOM]; 6],
            ray: [0; ROOM],
            waiting: 0,
            tau: [0.0; ROOM],
            steps: [0; ROOM],
            ended: [0; ROOM],
        };
        for from in (0..n).step_by(BATCH) {
            let to = (from + BATCH).min(n);
            batch.fill::<L>(field, chunk, from, to);
            batch.walk(leap, maps, &cells, chunk);
            if chunk.cancelled() {
                return;
            }
            batch.write::<L>(search, field, chunk, from, to);
        }
    }
}

impl Batch {
    /// Clips rays; those that come into the relief, and are not level, wait.
    #[inline(always)]
    fn fill<L: Lanes>(&mut self, field: &HeightField, chunk: &Chunk<'_>, from: usize, to: usize) {
        let lanes: [i32; 16] = std::array::from_fn(|lane| lane as i32);
        self.waiting = 0;
        for at in (from..to).step_by(L::WIDTH) {
            let clipped = clip::<L>(field, load::<L>(chunk.origins, at), load::<L>(chunk.directions, at));
            let chosen = L::first(to - at) & clipped.meets & !clipped.level;
            let Segments { start, delta, .. } = clipped.segments;
            let rows = [start[0], start[1], start[2], delta[0], delta[1], delta[2]];
            for (row, x) in self.rows.iter_mut().zip(rows) {
                L::compress(chosen, x, &mut row[self.waiting..]);
            }
            let numbers = L::load_int(&lanes) + L::splat_int((at - from) as i32);
            self.waiting += L::compress_int(chosen, numbers, &mut self.ray[self.waiting..]);
        }
    }

    /// Follows all that wait.
    #[inline(always)]
    fn walk<L: Lanes, S: Leap>(
        &mut self,
        leap: &S,
        maps: S::Maps<'_>,
        cells: &Cells<'_, L>,
        chunk: &Chunk<'_>,
    ) {
        let few = L::WIDTH as u32 * 3 / 4;
        let nowhere =
            Segments { start: [L::splat(0.0); 3], delta: [L::splat(0.0); 3], cos_theta: L::splat(1.0) };
        let mut rays = CellWalk::new::<S>(maps, cells, &nowhere, L::first(0), false);
        let mut slots = [0_i32; 16];
        let (mut next, mut used) = (0, 0_u32);
        while !chunk.cancelled() {
            let running = L::bits(rays.running);
            if running == 0 || (running.count_ones() <= few && next < self.waiting) {
                self.keep(&rays, &slots, used & !running);
                let vacant = L::first(L::WIDTH) & !rays.running;
                let more = (L::WIDTH - running.count_ones() as usize).min(self.waiting - next);
                used = running;
                if more > 0 {
                    let segments = self.segments(next, vacant);
                    let mut lanes = L::bits(vacant);
                    let mut fresh = 0_u32;
                    for slot in next..next + more {
                        let lane = lanes.trailing_zeros();
                        slots[lane as usize & 15] = self.ray[slot];
                        fresh |= 1 << lane;
                        lanes &= lanes.wrapping_sub(1);
                    }
                    let chosen = L::from_bits(fresh);
                    let others = CellWalk::new::<S>(maps, cells, &segments, chosen, chunk.from_surface);
                    rays = rays.or(chosen, &others);
                    used |= fresh;
                    next += more;
                } else if running == 0 {
                    return;
                }
            }
            rays.step(leap, maps, cells, chunk.from_surface);
        }
    }

    /// Segments from place `next` on, one for each vacant lane.
    #[inline(always)]
    fn segments<L: Lanes>(&self, next: usize, vacant: L::M) -> Segments<L> {
        let zero = L::splat(0.0);
        let [u, v, z, du, dv, dz] = &self.rows;
        Segments {
            start: [
                L::expand(vacant, &u[next..], zero),
                L::expand(vacant, &v[next..], zero),
                L::expand(vacant, &z[next..], zero),
            ],
            delta: [
                L::expand(vacant, &du[next..], zero),
                L::expand(vacant, &dv[next..], zero),
                L::expand(vacant, &dz[next..], zero),
            ],
            cos_theta: L::splat(1.0),
        }
    }

    /// Takes what was found from lanes that have ended.
    #[inline(always)]
    fn keep<L: Lanes>(&mut self, rays: &CellWalk<L>, slots: &[i32; 16], mut lanes: u32) {
        if lanes == 0 {
            return;
        }
        let (mut tau, mut steps) = ([0.0; 16], [0; 16]);
        L::store(rays.t, &mut tau);
        L::store_int(rays.steps, &mut steps);
        let (hit, unconverged) = (L::bits(rays.hit), L::bits(rays.unconverged));
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize & 15;
            let ray = slots[lane] as usize;
            self.tau[ray] = tau[lane];
            self.steps[ray] = steps[lane];
            self.ended[ray] = (hit >> lane & 1) as u8 | ((unconverged >> lane & 1) as u8) << 1;
            lanes &= lanes - 1;
        }
    }

    /// Writes what was found.
    #[inline(always)]
    fn write<L: Lanes>(
        &self,
        search: &impl Search,
        field: &HeightField,
        chunk: &mut Chunk<'_>,
        from: usize,
        to: usize,
    ) {
        for at in (from..to).step_by(L::WIDTH) {
            let lanes = L::first(to - at);
            let (origin, direction) = (load::<L>(chunk.origins, at), load::<L>(chunk.directions, at));
            let clipped = clip::<L>(field, origin, direction);
            let (mut hit, mut unconverged) = (0, 0);
            for (lane, &ended) in self.ended[at - from..][..L::WIDTH].iter().enumerate() {
                hit |= u32::from(ended & 1) << lane;
                unconverged |= u32::from(ended >> 1) << lane;
            }
            let tau = L::load(&self.tau[at - from..]);
            let steps = L::load_int(&self.steps[at - from..]);
            let outcome = Outcome::<L> {
                hit: L::from_bits(hit) & clipped.meets,
                unconverged: L::from_bits(unconverged) & clipped.meets,
                t: clipped.t_start + L::widen(tau) * clipped.t_length,
                steps: L::select_int(clipped.meets, steps, L::splat_int(0)),
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
