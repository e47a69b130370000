//! The sweep over a block of lines: what rises beyond the nearest steps.

use heightfield::lanes;

use super::plan::Sample;
use super::{FAR_FROM, Grid, LANES, Plan};

/// Working memory of one task.
#[derive(Default)]
pub(super) struct Scratch {
    /// Heights of all lines at each sample.
    heights: Vec<[f32; LANES]>,
    /// Which lines may have a corner of a hull at each sample, 1 or 0.
    corners: Vec<[u8; LANES]>,
    /// The samples of one line that may be corners.
    kept: Vec<u32>,
    /// Room for the hull ahead of the point at hand, farthest first.
    hull: Vec<Point>,
}

/// What a point of a line sees beyond the nearest steps.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Far {
    /// Steepest rise, height per step; may be below 0.
    pub rise: f32,
    /// 1 / steps to the point that rises so; 0 where there is none.
    pub nearness: f32,
}

/// A point of a line.
#[derive(Debug, Clone, Copy)]
struct Point {
    step: f64,
    height: f64,
}

impl Point {
    /// Whether `far` rises at least as steeply as `near`, seen from here.
    #[inline(always)]
    fn sees_past(&self, near: &Point, far: &Point) -> bool {
        (near.height - self.height) * (far.step - self.step)
            <= (far.height - self.height) * (near.step - self.step)
    }
}

/// `LANES` lines to be swept, the first starting at `line` on the cross axis, into `out`, `[step][line]`;
/// steps beside the map are left as they are.
pub(super) struct SweepLines<'a> {
    pub plan: &'a Plan,
    pub grid: &'a Grid,
    pub line: i64,
    pub scratch: &'a mut Scratch,
    pub out: &'a mut [Far],
}

/// The steps of a line that pass a texel, and how far it is followed.
#[derive(Debug, Clone, Copy)]
struct Reach {
    first: usize,
    last: usize,
    end: usize,
}

impl lanes::Kernel for SweepLines<'_> {
    type Output = ();

    /// Of the lanes only the instruction set is taken.
    #[inline(always)]
    fn run<L: lanes::Lanes>(self) {
        let Self { plan, grid, line, scratch, out } = self;
        let mut reaches = [None; LANES];
        for (lane, reach) in reaches.iter_mut().enumerate() {
            let line = line + lane as i64;
            if line < plan.first_line + plan.line_count as i64 {
                *reach = plan.receivers(line).map(|(first, last)| Reach {
                    first,
                    last,
                    end: plan.end(line, last),
                });
            }
        }
        let (mut first, mut last, mut end) = (usize::MAX, 0, 0);
        for reach in reaches.iter().flatten() {
            (first, last, end) = (first.min(reach.first), last.max(reach.last), end.max(reach.end));
        }
        if end == 0 {
            return;
        }
        let samples = plan.samples(first, end);
        heights_of(plan, grid, line, samples, &mut scratch.heights);
        mark_corners(samples, &scratch.heights, &mut scratch.corners);
        look_just_ahead(plan, [first, last], samples, &scratch.heights, out);
        for (lane, reach) in reaches.into_iter().enumerate() {
            if let Some(reach) = reach {
                sweep_line(plan, first, reach, samples, lane, scratch, out);
            }
        }
    }
}

/// Sweeps one of the lines whose samples begin at step `first`.
#[inline(always)]
fn sweep_line(
    plan: &Plan,
    first: usize,
    reach: Reach,
    samples: &[Sample],
    lane: usize,
    scratch: &mut Scratch,
    out: &mut [Far],
) {
    let Scratch { heights, corners, kept, hull } = scratch;
    let count = plan.samples_between(first, reach.end) + 1;
    let (samples, heights) = (&samples[..count], &heights[..count]);
    let mut waiting = keep(&corners[..count], lane, kept);
    hull.resize(hull.len().max(waiting), Point { step: 0.0, height: 0.0 });
    // Corners of the hull, and which of them the step before saw.
    let (mut corners, mut seen) = (0, 0);
    for step in (reach.first..=reach.last).rev() {
        let out = &mut out[step * LANES + lane];
        let from = step + FAR_FROM;
        if from > reach.end {
            *out = Far::default();
            continue;
        }
        let from = plan.samples_between(first, from);
        while waiting > 0 && kept[waiting - 1] as usize >= from {
            waiting -= 1;
            let at = kept[waiting] as usize;
            let point = Point { step: samples[at].step, height: f64::from(heights[at][lane]) };
            corners = push(hull, corners, point);
        }
        let far = if corners > 0 {
            let height = heights[plan.samples_between(first, step)][lane];
            let eye = Point { step: step as f64, height: f64::from(height) };
            seen = tangent(&hull[..corners], &eye, seen);
            let steepest = &hull[seen];
            let nearness = 1.0 / (steepest.step - eye.step);
            Far { rise: ((steepest.height - eye.height) * nearness) as f32, nearness: nearness as f32 }
        } else {
            Far::default()
        };
        // The nearest two samples may be corners only because those before them do not count.
        if far.rise >= out.rise {
            *out = far;
        }
    }
}

/// What each line sees of the first two samples that count.
#[inline(always)]
fn look_just_ahead(
    plan: &Plan,
    [first, last]: [usize; 2],
    samples: &[Sample],
    heights: &[[f32; LANES]],
    out: &mut [Far],
) {
    for step in first..=last {
        let from = plan.samples_between(first, step + FAR_FROM);
        let Some(near) = samples.get(from) else { break };
        let next = if from + 1 < samples.len() { from + 1 } else { from };
        let own = &heights[plan.samples_between(first, step)];
        let (a, b) = (&heights[from], &heights[next]);
        let nearness = [near, &samples[next]].map(|sample| (1.0 / (sample.step - step as f64)) as f32);
        let Some(out) = out[step * LANES..].first_chunk_mut::<LANES>() else { break };
        for lane in 0..LANES {
            let rises = [(a[lane] - own[lane]) * nearness[0], (b[lane] - own[lane]) * nearness[1]];
            let first = rises[0] >= rises[1];
            let rise = if first { rises[0] } else { rises[1] };
            let nearness = if first { nearness[0] } else { nearness[1] };
            out[lane] = Far { rise, nearness };
        }
    }
}

/// Marks the samples that rise above the chord of their neighbours, next and next but one, on each
/// line. No other can be a corner of the hull but at its near end.
#[inline(always)]
fn mark_corners(samples: &[Sample], heights: &[[f32; LANES]], corners: &mut Vec<[u8; LANES]>) {
    corners.clear();
    corners.resize(samples.len(), [1; LANES]);
    for ((samples, heights), corners) in
        samples.windows(5).zip(heights.windows(5)).zip(corners.iter_mut().skip(2))
    {
        let [a, b, own, c, d] = heights else { continue };
        let near = samples[2].share_of(&samples[1], &samples[3]);
        let wide = samples[2].share_of(&samples[0], &samples[4]);
        for lane in 0..LANES {
            let above_near = own[lane] > b[lane] + (c[lane] - b[lane]) * near;
            let above_wide = own[lane] > a[lane] + (d[lane] - a[lane]) * wide;
            corners[lane] = u8::from(above_near & above_wide);
        }
    }
}

/// Lists the samples marked for one line, and the last of all; returns their number.
#[inline(always)]
fn keep(corners: &[[u8; LANES]], lane: usize, kept: &mut Vec<u32>) -> usize {
    kept.resize(corners.len().max(kept.len()), 0);
    let mut count = 0;
    for (at, marks) in corners.iter().enumerate() {
        kept[count] = at as u32;
        count += usize::from(marks[lane]);
    }
    // The end of the line is a corner whatever it is like.
    if count == 0 || kept[count - 1] as usize + 1 != corners.len() {
        kept[count] = corners.len() as u32 - 1;
        count += 1;
    }
    count
}

/// Heights of the bilinear surface at the samples of all lines.
#[inline(always)]
fn heights_of(plan: &Plan, grid: &Grid, line: i64, samples: &[Sample], heights: &mut Vec<[f32; LANES]>) {
    heights.resize(heights.len().max(samples.len()), [0.0; LANES]);
    heights.truncate(samples.len());
    for (heights, sample) in heights.iter_mut().zip(samples) {
        let main = grid.main(plan.main(sample.column));
        column(grid.lanes(main, line + sample.row), sample.row_share, heights);
        if sample.column_share > 0.0 {
            let mut next = [0.0; LANES];
            let main = grid.main(plan.main(sample.column + 1));
            column(grid.lanes(main, line + sample.row), sample.row_share, &mut next);
            for lane in 0..LANES {
                heights[lane] += (next[lane] - heights[lane]) * sample.column_share;
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

/// Adds a point in front of the hull, of which there are `corners`; takes off those that it hides from
/// all before it. Returns how many there are then.
#[inline(always)]
fn push(hull: &mut [Point], mut corners: usize, point: Point) -> usize {
    while corners > 1 && point.sees_past(&hull[corners - 1], &hull[corners - 2]) {
        corners -= 1;
    }
    hull[corners] = point;
    corners + 1
}

/// The corner of a hull that rises most steeply from `eye`, beginning with a guess: what the eye next to
/// this one saw is mostly near it.
#[inline(always)]
fn tangent(hull: &[Point], eye: &Point, guess: usize) -> usize {
    // From near to far the rise grows up to the tangent and falls from there on.
    let rises_after = |at: usize| at > 0 && eye.sees_past(&hull[at], &hull[at - 1]);
    let guess = guess.min(hull.len() - 1);
    // The tangent is the last corner, from the far end on, beyond which it does not rise.
    let (mut low, mut high);
    if rises_after(guess) {
        (low, high) = (0, guess);
        for _ in 0..LINEAR_TRIES {
            if !rises_after(high - 1) {
                return high - 1;
            }
            high -= 1;
        }
    } else {
        (low, high) = (guess, hull.len());
        for _ in 0..LINEAR_TRIES {
            if low + 1 == high || rises_after(low + 1) {
                return low;
            }
            low += 1;
        }
    }
    while high - low > 1 {
        let middle = low.midpoint(high);
        if rises_after(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    low
}

/// Corners looked at one after another before the rest is halved again and again.
const LINEAR_TRIES: u32 = 4;
