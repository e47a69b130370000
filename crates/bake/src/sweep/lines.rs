//! The sweep over a block of lines: what rises beyond the nearest steps.

use heightfield::lanes::{self, Lanes};

use super::hull::{Hulls, Points};
use super::plan::{CHORDS, FarSample};
use super::{FAR_FROM, Grid, LANES, Plan};

/// Working memory of one task.
#[derive(Default)]
pub(super) struct Scratch {
    /// Heights of all lines at each sample.
    heights: Vec<[f32; LANES]>,
    /// Room for the corners of the hulls.
    corners: Vec<[f32; 2]>,
}

/// What lines see beyond the nearest steps, side by side.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Far {
    /// Steepest rises, height per step; may be below 0.
    pub rises: [f32; LANES],
    /// 1 / steps to the points that rise so; 0 where there is none.
    pub nearness: [f32; LANES],
}

/// `LANES` lines to be swept, the first starting at `line` on the cross axis, into `out`, one a step;
/// of steps and lines beside the map it holds anything.
pub(super) struct SweepLines<'a> {
    pub plan: &'a Plan,
    pub grid: &'a Grid,
    pub line: i64,
    pub scratch: &'a mut Scratch,
    pub out: &'a mut [Far],
}

/// The steps at which lines pass texels, first and last, and how far they are followed.
#[derive(Debug, Clone, Copy)]
struct Reach {
    first: usize,
    last: usize,
    end: usize,
    /// How far each line is followed, in samples from `first`.
    ends: [i32; LANES],
}

impl Reach {
    /// Of `LANES` lines together.
    fn new(plan: &Plan, line: i64) -> Option<Self> {
        let mut ends = [None; LANES];
        let (mut first, mut last) = (usize::MAX, 0);
        let lines = line..plan.first_line + plan.line_count as i64;
        for (end, line) in ends.iter_mut().zip(lines) {
            if let Some((from, to)) = plan.receivers(line) {
                (first, last) = (first.min(from), last.max(to));
                *end = Some(plan.end(line, to));
            }
        }
        let end = ends.into_iter().flatten().max()?;
        let ends = ends.map(|own| plan.samples_between(first, own.unwrap_or(end)) as i32);
        Some(Self { first, last, end, ends })
    }
}

impl lanes::Kernel for SweepLines<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { plan, grid, line, scratch, out } = self;
        let Some(reach) = Reach::new(plan, line) else { return };
        let samples = plan.samples(reach.first, reach.end);
        heights_of(grid, grid.relative(line), samples, &mut scratch.heights);
        for lane in (0..LANES).step_by(L::WIDTH) {
            sweep::<L>(plan, reach, samples, &scratch.heights, lane, &mut scratch.corners, out);
        }
    }
}

/// Sweeps the lines from `lane` on.
#[inline(always)]
fn sweep<L: Lanes>(
    plan: &Plan,
    reach: Reach,
    samples: &[FarSample],
    heights: &[[f32; LANES]],
    lane: usize,
    corners: &mut Vec<[f32; 2]>,
    out: &mut [Far],
) {
    let ends = L::load_int(&reach.ends[lane..]);
    let mut waiting = samples.len() - 1;
    let mut hulls = Hulls::<L>::new(corners, samples.len(), last_points(samples, heights, &reach.ends, lane));
    for step in (reach.first..=reach.last).rev() {
        let from = step + FAR_FROM;
        if from > reach.end {
            out[step] = Far::default();
            continue;
        }
        let from = plan.samples_between(reach.first, from);
        while waiting > from {
            waiting -= 1;
            let inside = L::lt_int(L::splat_int(waiting as i32), ends);
            let at_end = L::lt_int(ends, L::splat_int((waiting + CHORDS + 1) as i32));
            let chosen = inside & (at_end | may_be_corners::<L>(samples, heights, waiting, lane));
            if L::any(chosen) {
                hulls.push(points(samples, heights, waiting, lane), chosen);
            }
        }
        let own = plan.samples_between(reach.first, step);
        let eyes = Points { step: L::splat(step as f32), height: L::load(&heights[own][lane..]) };
        let (mut rises, mut nearness) = seen(&eyes, &hulls.tangent(&eyes));
        for at in from..samples.len().min(from + CHORDS) {
            let (rise, near) = seen(&eyes, &points(samples, heights, at, lane));
            let beyond = L::lt_int(ends, L::splat_int(at as i32));
            let steeper = L::lt(rises, rise) & !beyond;
            rises = L::select(steeper, rise, rises);
            nearness = L::select(steeper, near, nearness);
        }
        // What ends before it counts shows nothing.
        let (none, zero) = (L::lt_int(ends, L::splat_int(from as i32)), L::splat(0.0));
        L::store(L::select(none, zero, rises), &mut out[step].rises[lane..]);
        L::store(L::select(none, zero, nearness), &mut out[step].nearness[lane..]);
    }
}

/// The sample on each line at which it ends.
#[inline(always)]
fn last_points<L: Lanes>(
    samples: &[FarSample],
    heights: &[[f32; LANES]],
    ends: &[i32; LANES],
    lane: usize,
) -> Points<L> {
    let (mut steps, mut lasts) = ([0.0; LANES], [0.0; LANES]);
    for at in 0..LANES {
        let end = ends[at] as usize;
        (steps[at], lasts[at]) = (samples[end].step, heights[end][at]);
    }
    Points { step: L::load(&steps[lane..]), height: L::load(&lasts[lane..]) }
}

/// How steeply points rise, and 1 / steps to them.
#[inline(always)]
fn seen<L: Lanes>(eyes: &Points<L>, points: &Points<L>) -> (L::F, L::F) {
    let nearness = L::splat(1.0) / (points.step - eyes.step);
    ((points.height - eyes.height) * nearness, nearness)
}

/// A sample on the lines from `lane` on.
#[inline(always)]
fn points<L: Lanes>(samples: &[FarSample], heights: &[[f32; LANES]], at: usize, lane: usize) -> Points<L> {
    Points { step: L::splat(samples[at].step), height: L::load(&heights[at][lane..]) }
}

/// Where a sample rises above the chords of the samples before and after it, one to [`CHORDS`] away. No other can be a
/// corner of the hull but near its ends: at the near one, chords are looked at that begin with samples that do not count.
#[inline(always)]
fn may_be_corners<L: Lanes>(samples: &[FarSample], heights: &[[f32; LANES]], at: usize, lane: usize) -> L::M {
    let own = L::load(&heights[at][lane..]);
    let mut above = L::first(L::WIDTH);
    if at >= CHORDS && at + CHORDS < samples.len() {
        for (apart, share) in (1..).zip(samples[at].chords) {
            above = above & is_above::<L>(heights, at, apart, share, lane, own);
        }
    }
    above
}

/// Where a sample rises above the chord of those `apart` before and after it.
#[inline(always)]
fn is_above<L: Lanes>(
    heights: &[[f32; LANES]],
    at: usize,
    apart: usize,
    share: f32,
    lane: usize,
    own: L::F,
) -> L::M {
    let (before, after) = (L::load(&heights[at - apart][lane..]), L::load(&heights[at + apart][lane..]));
    L::lt(before + (after - before) * L::splat(share), own)
}

/// Heights of the bilinear surface at the samples of all lines.
#[inline(always)]
fn heights_of(grid: &Grid, line: i32, samples: &[FarSample], heights: &mut Vec<[f32; LANES]>) {
    heights.resize(heights.len().max(samples.len()), [0.0; LANES]);
    heights.truncate(samples.len());
    for (heights, sample) in heights.iter_mut().zip(samples) {
        let [row_share, column_share] = sample.shares;
        column(grid.lanes(sample.main[0], line, sample.place), row_share, heights);
        if column_share > 0.0 {
            let mut next = [0.0; LANES];
            column(grid.lanes(sample.main[1], line, sample.place), row_share, &mut next);
            for lane in 0..LANES {
                heights[lane] += (next[lane] - heights[lane]) * column_share;
            }
        }
    }
}

/// Heights between neighbours.
#[inline(always)]
fn column(run: &[f32; LANES + 1], share: f32, heights: &mut [f32; LANES]) {
    for lane in 0..LANES {
        heights[lane] = run[lane] + (run[lane + 1] - run[lane]) * share;
    }
}
