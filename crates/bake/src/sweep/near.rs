//! The first steps of an azimuth, texel by texel.

use super::plan::Sample;
use super::{Grid, Plan, larger};

/// The steepest rise within the near steps, height per step and at least 0, for the row of texels
/// `step` steps along.
#[inline(always)]
pub(super) fn rises(plan: &Plan, grid: &Grid, step: i64, out: &mut [f32]) {
    let n = out.len();
    let own = &row(plan, grid, step, 0)[..n];
    out.fill(0.0);
    if let [middle, end, ..] = plan.near.as_slice() {
        // Up to the first row or column the surface is a parabola along the line; its slope at the
        // texel follows from three heights.
        let scale = (1.0 / end.step) as f32;
        let (a, b) = (rows(plan, grid, step, middle), rows(plan, grid, step, end));
        for (j, rise) in out.iter_mut().enumerate() {
            let (half, whole) = (at(middle, a, j) - own[j], at(end, b, j) - own[j]);
            *rise = larger(*rise, (4.0 * half - whole) * scale);
        }
    }
    for sample in &plan.near {
        let inverse = (1.0 / sample.step) as f32;
        let rows = rows(plan, grid, step, sample);
        let (near, next) = (&rows.0[..=n], &rows.1[..=n]);
        if sample.column_share == 0.0 {
            for (j, rise) in out.iter_mut().enumerate() {
                let height = near[j] + (near[j + 1] - near[j]) * sample.row_share;
                *rise = larger(*rise, (height - own[j]) * inverse);
            }
        } else if sample.row_share == 0.0 {
            for (j, rise) in out.iter_mut().enumerate() {
                let height = near[j] + (next[j] - near[j]) * sample.column_share;
                *rise = larger(*rise, (height - own[j]) * inverse);
            }
        } else {
            for (j, rise) in out.iter_mut().enumerate() {
                *rise = larger(*rise, (at(sample, (near, next), j) - own[j]) * inverse);
            }
        }
    }
}

/// Heights of the texels before, at and after each texel of a row on the cross axis.
#[inline(always)]
pub(super) fn neighbours<'a>(plan: &Plan, grid: &'a Grid, step: i64) -> (&'a [f32], &'a [f32], &'a [f32]) {
    (row(plan, grid, step, -1), row(plan, grid, step, 0), row(plan, grid, step, 1))
}

/// The rows before and after a sample.
#[inline(always)]
fn rows<'a>(plan: &Plan, grid: &'a Grid, step: i64, sample: &Sample) -> (&'a [f32], &'a [f32]) {
    let near = row(plan, grid, step + sample.column, sample.row);
    if sample.column_share > 0.0 {
        (near, row(plan, grid, step + sample.column + 1, sample.row))
    } else {
        (near, near)
    }
}

#[inline(always)]
fn row<'a>(plan: &Plan, grid: &'a Grid, step: i64, from: i64) -> &'a [f32] {
    grid.row(grid.main(plan.main(step)), from)
}

/// Height of the bilinear surface at a sample of texel `j`.
#[inline(always)]
fn at(sample: &Sample, (near, next): (&[f32], &[f32]), j: usize) -> f32 {
    let near = near[j] + (near[j + 1] - near[j]) * sample.row_share;
    let next = next[j] + (next[j + 1] - next[j]) * sample.row_share;
    near + (next - near) * sample.column_share
}
