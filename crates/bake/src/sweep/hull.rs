//! Upper convex hulls of what lies ahead on neighbouring lines, one a lane, and their tangents.
//!
//! Each lane has a stack of corners, the nearest on top. A line passes a few corners a step, and its tangent moves by
//! a few: the lanes take as many turns as the one that needs most. All numbers are `f32`; where a step is rounded, the
//! height is that of the surface there, so steps and heights fit together.

// Corners are read at different depths.
#![allow(unsafe_code)]

use heightfield::lanes::Lanes;

/// Below every height by so much that no corner is hidden in front of it, and finite when it is multiplied.
const NOTHING: f32 = -1e30;
/// Corners looked at one after another before the rest is halved again and again.
const LINEAR_TRIES: u32 = 6;

/// A point on each line.
#[derive(Clone, Copy)]
pub(super) struct Points<L: Lanes> {
    pub step: L::F,
    pub height: L::F,
}

impl<L: Lanes> Points<L> {
    /// Where `far` rises at least as steeply as `near`, seen from here.
    #[inline(always)]
    fn see_past(&self, near: &Self, far: &Self) -> L::M {
        let (near_rise, far_rise) = (near.height - self.height, far.height - self.height);
        L::le(near_rise * (far.step - self.step), far_rise * (near.step - self.step))
    }

    #[inline(always)]
    fn select(mask: L::M, yes: &Self, no: &Self) -> Self {
        Self { step: L::select(mask, yes.step, no.step), height: L::select(mask, yes.height, no.height) }
    }
}

/// See the module.
pub(super) struct Hulls<'a, L: Lanes> {
    /// Step and height of each corner, `[depth][lane]`; the lowest is [`NOTHING`].
    corners: &'a mut [[f32; 2]],
    lane: L::I,
    /// Depth of the uppermost corner, at least 1, and below half of `corners` even where it grows by one.
    depth: L::I,
    top: Points<L>,
    below: Points<L>,
    /// Depth of the corner that was seen last.
    seen: L::I,
}

/// 1 where the mask is set.
#[inline(always)]
fn ones<L: Lanes>(mask: L::M) -> L::I {
    L::select_int(mask, L::splat_int(1), L::splat_int(0))
}

impl<'a, L: Lanes> Hulls<'a, L> {
    /// Hulls of one corner, that will be of no more than `most`.
    #[inline(always)]
    pub fn new(room: &'a mut Vec<[f32; 2]>, most: usize, first: Points<L>) -> Self {
        // The lowest, and what is written above the uppermost.
        room.resize(room.len().max((most + 2) * L::WIDTH), [0.0; 2]);
        let mut step = [0.0; 16];
        let mut height = [0.0; 16];
        L::store(first.step, &mut step);
        L::store(first.height, &mut height);
        let mut lanes = [0; 16];
        for (lane, number) in lanes[..L::WIDTH].iter_mut().enumerate() {
            *number = lane as i32;
            room[lane] = [step[lane] + 1.0, NOTHING];
            room[L::WIDTH + lane] = [step[lane], height[lane]];
        }
        let one = L::splat_int(1);
        let nothing = Points { step: first.step + L::splat(1.0), height: L::splat(NOTHING) };
        Self { corners: room, lane: L::load_int(&lanes), depth: one, top: first, below: nothing, seen: one }
    }

    /// The corners at a depth, from 0 to one above the uppermost.
    #[inline(always)]
    fn at(&self, depth: L::I) -> Points<L> {
        let place = (depth * L::splat_int(L::WIDTH as i32) + self.lane) * L::splat_int(2);
        // SAFETY: depths begin at 0, grow by one with each point, and `new` made room for all of them.
        let (step, height) = unsafe { L::gather_pairs(self.corners.as_flattened(), place) };
        Points { step, height }
    }

    /// Adds a point in front of the chosen hulls; takes off the corners that it hides from all before it.
    #[inline(always)]
    pub fn push(&mut self, point: Points<L>, chosen: L::M) {
        let one = L::splat_int(1);
        let mut hides = chosen & point.see_past(&self.top, &self.below);
        while L::any(hides) {
            self.depth = self.depth - ones::<L>(hides);
            self.top = Points::select(hides, &self.below, &self.top);
            // Elsewhere it is what it was.
            self.below = self.at(self.depth - one);
            hides = hides & point.see_past(&self.top, &self.below);
        }
        self.below = Points::select(chosen, &self.top, &self.below);
        self.top = Points::select(chosen, &point, &self.top);
        let mut depths = [0; 16];
        let mut points = [[0.0; 16]; 2];
        L::store_int(self.depth + one, &mut depths);
        L::store(point.step, &mut points[0]);
        L::store(point.height, &mut points[1]);
        for lane in 0..L::WIDTH {
            // Where it is not chosen it lies above the uppermost, where nobody looks.
            if let Some(corner) = self.corners.get_mut(depths[lane] as usize * L::WIDTH + lane) {
                *corner = [points[0][lane], points[1][lane]];
            }
        }
        self.depth = self.depth + ones::<L>(chosen);
    }

    /// The corners that rise most steeply from `eyes`, beginning with those that were seen last: what the eyes next
    /// to these saw is mostly near.
    #[inline(always)]
    pub fn tangent(&mut self, eyes: &Points<L>) -> Points<L> {
        // From near to far the rise grows up to the tangent and falls from there on. That is the last corner, from the
        // far end on, beyond which it does not rise; nothing rises beyond the lowest.
        let one = L::splat_int(1);
        let mut at = L::min_int(self.seen, self.depth);
        let mut here = self.at(at);
        let mut beyond = self.at(at - one);
        let down = eyes.see_past(&here, &beyond);
        let (mut sinks, mut tries) = (down, LINEAR_TRIES);
        while L::any(sinks) && tries > 0 {
            at = at - ones::<L>(sinks);
            here = Points::select(sinks, &beyond, &here);
            beyond = self.at(at - one);
            sinks = sinks & eyes.see_past(&here, &beyond);
            tries -= 1;
        }
        let mut climbs = !down & L::lt_int(at, self.depth);
        tries = LINEAR_TRIES;
        while L::any(climbs) {
            let before = self.at(L::min_int(at + one, self.depth));
            climbs = climbs & !eyes.see_past(&before, &here);
            if tries == 0 {
                break;
            }
            at = at + ones::<L>(climbs);
            here = Points::select(climbs, &before, &here);
            climbs = climbs & L::lt_int(at, self.depth);
            tries -= 1;
        }
        if L::any(sinks | climbs) {
            at = self.halve(eyes, at, sinks, climbs);
            here = self.at(at);
        }
        self.seen = at;
        here
    }

    /// The depth of the tangent, which lies below `at` or above it, or is there.
    #[inline(always)]
    fn halve(&self, eyes: &Points<L>, at: L::I, below: L::M, above: L::M) -> L::I {
        let one = L::splat_int(1);
        let mut low = L::select_int(below, one, at);
        let mut high = L::select_int(above, self.depth + one, at + ones::<L>(!below));
        loop {
            let open = L::lt_int(low + one, high);
            if !L::any(open) {
                return low;
            }
            let middle = L::to_int(L::to_float(low + high) * L::splat(0.5));
            let rises = eyes.see_past(&self.at(middle), &self.at(middle - one));
            high = L::select_int(open & rises, middle, high);
            low = L::select_int(open & !rises, middle, low);
        }
    }
}
