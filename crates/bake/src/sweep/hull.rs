//! The sweep over a block of lines: what rises beyond the nearest steps.

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
    /// The hull ahead of the point at hand, farthest first.
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

/// Sweeps `LANES` lines, the first starting at `line` on the cross axis, into `out`, `[step][line]`;
/// steps beside the map are left as they are.
pub(super) fn sweep_lines(plan: &Plan, grid: &Grid, line: i64, scratch: &mut Scratch, out: &mut [Far]) {
    let mut ranges = [None; LANES];
    for (lane, range) in ranges.iter_mut().enumerate() {
        let line = line + lane as i64;
        if line < plan.first_line + plan.line_count as i64 {
            *range = plan.receivers(line).map(|(first, last)| (first, last, plan.end(line, last)));
        }
    }
    let used = || ranges.iter().flatten();
    let (Some(first), Some(end)) = (used().map(|r| r.0).min(), used().map(|r| r.2).max()) else {
        return;
    };
    let samples = plan.samples(first, end);
    let Scratch { heights, corners, kept, hull } = scratch;
    heights.clear();
    heights.extend(samples.iter().map(|sample| heights_at(plan, grid, line, sample)));
    mark_corners(samples, heights, corners);
    for (lane, range) in ranges.into_iter().enumerate() {
        let Some((lane_first, last, lane_end)) = range else { continue };
        let lane_samples = plan.samples_between(first, lane_end) + 1;
        let mut waiting = keep(&corners[..lane_samples], lane, kept);
        hull.clear();
        for step in (lane_first..=last).rev() {
            let height = heights[plan.samples_between(first, step)][lane];
            let eye = Point { step: step as f64, height: f64::from(height) };
            let from = step + FAR_FROM;
            if from > lane_end {
                out[step * LANES + lane] = Far::default();
                continue;
            }
            let from = plan.samples_between(first, from);
            while waiting > 0 && kept[waiting - 1] as usize >= from {
                waiting -= 1;
                let at = kept[waiting] as usize;
                push(hull, Point { step: samples[at].step, height: f64::from(heights[at][lane]) });
            }
            let mut far = look(hull, &eye);
            // The nearest two may be corners only because those before them do not count.
            let ahead = samples[from..lane_samples].iter().zip(&heights[from..lane_samples]).take(2);
            for (sample, heights) in ahead {
                let nearness = 1.0 / (sample.step - eye.step) as f32;
                let rise = (heights[lane] - height) * nearness;
                if rise > far.rise {
                    far = Far { rise, nearness };
                }
            }
            out[step * LANES + lane] = far;
        }
    }
}

/// Marks the samples that rise above the chord of their neighbours, next and next but one, on each
/// line. No other can be a corner of the hull but at its near end.
fn mark_corners(samples: &[Sample], heights: &[[f32; LANES]], corners: &mut Vec<[u8; LANES]>) {
    corners.clear();
    corners.resize(samples.len(), [1; LANES]);
    let share = |before: usize, at: usize, after: usize| {
        let (start, end) = (samples[before].step, samples[after].step);
        ((samples[at].step - start) / (end - start)) as f32
    };
    for at in 2..samples.len().saturating_sub(2) {
        let near = share(at - 1, at, at + 1);
        let wide = share(at - 2, at, at + 2);
        let [a, b, own, c, d] = [-2_isize, -1, 0, 1, 2].map(|k| &heights[at.wrapping_add_signed(k)]);
        for (lane, corner) in corners[at].iter_mut().enumerate() {
            let above_near = own[lane] > b[lane] + (c[lane] - b[lane]) * near;
            let above_wide = own[lane] > a[lane] + (d[lane] - a[lane]) * wide;
            *corner = u8::from(above_near & above_wide);
        }
    }
}

/// Lists the samples marked for one line, and the last of all; returns their number.
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

/// Heights of the bilinear surface at one sample of all lines.
#[inline(always)]
fn heights_at(plan: &Plan, grid: &Grid, line: i64, sample: &Sample) -> [f32; LANES] {
    let column = |at: i64| {
        let run = grid.lanes(grid.main(plan.main(at)), line + sample.row);
        let mut heights = [0.0; LANES];
        for lane in 0..LANES {
            heights[lane] = run[lane] + (run[lane + 1] - run[lane]) * sample.row_share;
        }
        heights
    };
    let mut heights = column(sample.column);
    if sample.column_share > 0.0 {
        let next = column(sample.column + 1);
        for lane in 0..LANES {
            heights[lane] += (next[lane] - heights[lane]) * sample.column_share;
        }
    }
    heights
}

/// Adds a point in front of the hull; takes off those that it hides from all before it.
#[inline(always)]
fn push(hull: &mut Vec<Point>, point: Point) {
    while let [.., behind, top] = hull.as_slice() {
        if !point.sees_past(top, behind) {
            break;
        }
        hull.pop();
    }
    hull.push(point);
}

/// The steepest rise from `eye` to the hull ahead of it.
#[inline(always)]
fn look(hull: &[Point], eye: &Point) -> Far {
    if hull.is_empty() {
        return Far::default();
    }
    // From near to far the rise grows up to the tangent and falls from there on. Mostly it is near;
    // on a round hill it may be many corners away.
    let rises_after = |at: usize| at > 0 && eye.sees_past(&hull[at], &hull[at - 1]);
    let mut at = hull.len() - 1;
    let mut tries = 0;
    while rises_after(at) {
        at -= 1;
        tries += 1;
        if tries == LINEAR_TRIES {
            let mut low = 0;
            while low < at {
                let middle = low.midpoint(at + 1);
                if rises_after(middle) {
                    at = middle - 1;
                } else {
                    low = middle;
                }
            }
        }
    }
    let steepest = &hull[at];
    let nearness = 1.0 / (steepest.step - eye.step);
    Far { rise: ((steepest.height - eye.height) * nearness) as f32, nearness: nearness as f32 }
}

/// Corners looked at one after another before the rest is halved again and again.
const LINEAR_TRIES: u32 = 4;
