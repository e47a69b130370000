//! The coarse walk: each ray, or bundle, down to where it may be near the surface.

use super::block::{DROP, Queue};
use super::grid::{Axis, Coarse, Grid};
use crate::lanes::Lanes;
use crate::margin::MarginPyramid;

/// Packets in flight: while one waits for memory the other computes.
const STREAMS: usize = 2;

/// A packet and the slots its lanes come from.
#[derive(Clone, Copy)]
struct Stream<L: Lanes> {
    rays: Coarse<L>,
    slots: [u16; 16],
    /// Lanes that hold a ray whose drop is not yet written back.
    used: u32,
}

/// Walks all of a queue over a pyramid.
///
/// Rays take unequal numbers of steps, so lanes that have stopped are handed new rays once they are
/// many enough.
#[inline(always)]
pub fn walk<L: Lanes>(queue: &mut Queue, bound: &MarginPyramid, gx: &Grid<L>, gy: &Grid<L>) {
    let few = L::WIDTH as u32 * 3 / 8;
    let zero = L::splat(0.0);
    let still = Axis { start: zero, direction: zero, inverse: zero };
    let idle = Coarse::<L>::new(still, still, zero, L::splat_int(0), L::first(0));
    let mut streams = [Stream::<L> { rays: idle, slots: [0; 16], used: 0 }; STREAMS];
    let mut next = 0;
    loop {
        let mut alive = false;
        for stream in &mut streams {
            let running = L::bits(stream.rays.running);
            if running == 0 || (running.count_ones() <= few && next < queue.len) {
                write_back(queue, stream, running);
                next += refill(queue, stream, next);
                if !L::any(stream.rays.running) {
                    continue;
                }
            }
            alive = true;
            stream.rays.step(bound, gx, gy);
        }
        if !alive {
            return;
        }
    }
}

/// Stores the drops of lanes that have stopped.
#[inline(always)]
fn write_back<L: Lanes>(queue: &mut Queue, stream: &mut Stream<L>, running: u32) {
    let mut done = stream.used & !running;
    if done != 0 {
        let (mut drop, mut steps) = ([0.0; 16], [0; 16]);
        L::store(stream.rays.drop, &mut drop);
        L::store_int(stream.rays.steps, &mut steps);
        while done != 0 {
            let lane = done.trailing_zeros() as usize & 15;
            let slot = usize::from(stream.slots[lane]);
            queue.single[DROP][slot] = drop[lane];
            queue.steps[slot] += steps[lane];
            done &= done - 1;
        }
    }
    stream.used = running;
}

/// Gives rays from slot `next` on to the lanes that do not run; returns how many.
#[inline(always)]
fn refill<L: Lanes>(queue: &Queue, stream: &mut Stream<L>, next: usize) -> usize {
    let running = stream.rays.running;
    let vacant = L::WIDTH - L::bits(running).count_ones() as usize;
    let more = vacant.min(queue.len - next);
    if more == 0 {
        return 0;
    }
    let chosen = L::first(L::WIDTH) & !running;
    stream.rays.refill(chosen, std::array::from_fn(|k| &queue.single[k][next..]));
    let mut vacant = L::bits(chosen);
    let mut fresh = 0_u32;
    for slot in next..next + more {
        let lane = vacant.trailing_zeros();
        stream.slots[lane as usize & 15] = slot as u16;
        fresh |= 1 << lane;
        vacant &= vacant.wrapping_sub(1);
    }
    stream.used |= fresh;
    stream.rays.running = running | L::from_bits(fresh);
    more
}
