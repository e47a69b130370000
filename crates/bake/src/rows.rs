//! The row engine behind every map that needs slopes.
//!
//! Rows run in parallel in batches. A row is computed from slices only: a vertical pass over
//! neighbouring rows, then a horizontal pass over the result, whose few border columns are filled
//! in by the wrap rule. The inner loops hold no wrap and no branch, so they vectorise.

use heightfield::HeightField;
use rayon::prelude::*;

use crate::kernel::{Kernel, Taps};
use crate::{BakeError, Progress};

/// Texels between two progress reports.
const BATCH_TEXELS: usize = 1 << 20;
/// Texels one task handles, so that its rows stay in the cache.
const TASK_TEXELS: usize = 1 << 15;
/// The largest reach of a kernel.
const REACH: usize = 2;

/// One row of the height field with its gradient.
pub(crate) struct Row<'a> {
    /// `dh/dx`, height per texel.
    pub gx: &'a [f32],
    /// `dh/dy` downwards, height per texel.
    pub gy: &'a [f32],
    /// The heights.
    pub heights: &'a [f32],
}

/// Working memory of one task.
struct Scratch {
    /// Columns smoothed downwards, and differenced downwards, with `REACH` border columns a side.
    smooth: Vec<f32>,
    difference: Vec<f32>,
    gx: Vec<f32>,
    gy: Vec<f32>,
}

impl Scratch {
    fn new(width: usize) -> Self {
        let padded = vec![0.0; width + 2 * REACH];
        Self { smooth: padded.clone(), difference: padded, gx: vec![0.0; width], gy: vec![0.0; width] }
    }
}

/// Calls `fill(row, out, spare)` for every row of the field; `out` is that row of `target`, `spare`
/// three rows of scratch floats.
pub(crate) fn for_each_row<T: Send>(
    field: &HeightField,
    kernel: Kernel,
    target: &mut [T],
    progress: &mut Progress<'_>,
    fill: impl Fn(&Row<'_>, &mut [T], &mut [Vec<f32>; 3]) + Sync,
) -> Result<(), BakeError> {
    let (width, height) = (field.width(), field.height());
    let stride = target.len() / height;
    let taps = kernel.taps();
    let task_rows = (TASK_TEXELS / width).max(1);
    let batch_rows = (BATCH_TEXELS / width / task_rows).max(1) * task_rows;
    progress.report(0, height)?;
    for (batch, rows) in target.chunks_mut(batch_rows * stride).enumerate() {
        let first = batch * batch_rows;
        rows.par_chunks_mut(task_rows * stride).enumerate().for_each_init(
            || (Scratch::new(width), [0, 1, 2].map(|_| vec![0.0_f32; width])),
            |(scratch, spare), (task, rows)| {
                for (j, out) in rows.chunks_mut(stride).enumerate() {
                    let j = first + task * task_rows + j;
                    gradient(field, &taps, j, scratch);
                    let row = Row { gx: &scratch.gx, gy: &scratch.gy, heights: texel_row(field, j as i64) };
                    fill(&row, out, spare);
                }
            },
        );
        progress.report((first + batch_rows).min(height), height)?;
    }
    Ok(())
}

/// A row of texels; `j` may lie beyond the map.
pub(crate) fn texel_row(field: &HeightField, j: i64) -> &[f32] {
    let first = field.first_texel();
    let row = (field.wrap().index(j, field.height()) as i64 - first) as usize;
    let at = row * (field.cells()[0] + 1) + (-first) as usize;
    &field.corners()[at..at + field.width()]
}

fn gradient(field: &HeightField, taps: &Taps, j: usize, scratch: &mut Scratch) {
    let rows = [-2, -1, 0, 1, 2].map(|k| texel_row(field, j as i64 + k));
    let inner = REACH..REACH + field.width();
    smooth(taps, rows, &mut scratch.smooth[inner.clone()]);
    differ(taps, rows, &mut scratch.difference[inner]);
    for column in [&mut scratch.smooth, &mut scratch.difference] {
        pad(field, column);
    }
    let shifted = |columns| shifts(columns, field.width());
    differ(taps, shifted(&scratch.smooth), &mut scratch.gx);
    smooth(taps, shifted(&scratch.difference), &mut scratch.gy);
}

/// Fills the border columns from inside the row. What runs down a column is the same for a column
/// and for its wrapped image, so no texel is read again.
fn pad(field: &HeightField, columns: &mut [f32]) {
    let width = field.width();
    for k in 1..=REACH as i64 {
        let left = field.wrap().index(-k, width);
        let right = field.wrap().index(width as i64 - 1 + k, width);
        columns[REACH - k as usize] = columns[REACH + left];
        columns[REACH + width - 1 + k as usize] = columns[REACH + right];
    }
}

/// The five views of a padded row, shifted by -2 to +2 texels.
fn shifts(columns: &[f32], width: usize) -> [&[f32]; 5] {
    [0, 1, 2, 3, 4].map(|k| &columns[k..k + width])
}

fn differ(taps: &Taps, rows: [&[f32]; 5], out: &mut [f32]) {
    match taps.radius {
        0 => differ_by::<0>(rows, taps.derivative, out),
        1 => differ_by::<1>(rows, taps.derivative, out),
        _ => differ_by::<2>(rows, taps.derivative, out),
    }
}

fn smooth(taps: &Taps, rows: [&[f32]; 5], out: &mut [f32]) {
    match taps.radius {
        0 => out.copy_from_slice(rows[2]),
        1 => smooth_by::<1>(rows, taps.centre, taps.smoothing, out),
        _ => smooth_by::<2>(rows, taps.centre, taps.smoothing, out),
    }
}

/// Difference across rows with reach `R`; 0 is the one-sided difference.
#[inline]
fn differ_by<const R: usize>(rows: [&[f32]; 5], weights: [f32; 2], out: &mut [f32]) {
    let n = out.len();
    let rows = rows.map(|row| &row[..n]);
    for i in 0..n {
        out[i] = match R {
            0 => rows[3][i] - rows[2][i],
            1 => weights[0] * (rows[3][i] - rows[1][i]),
            _ => weights[0] * (rows[3][i] - rows[1][i]) + weights[1] * (rows[4][i] - rows[0][i]),
        };
    }
}

/// Symmetric smoothing across rows with reach `R`.
#[inline]
fn smooth_by<const R: usize>(rows: [&[f32]; 5], centre: f32, weights: [f32; 2], out: &mut [f32]) {
    let n = out.len();
    let rows = rows.map(|row| &row[..n]);
    for i in 0..n {
        let near = centre * rows[2][i] + weights[0] * (rows[1][i] + rows[3][i]);
        out[i] = if R == 1 { near } else { near + weights[1] * (rows[0][i] + rows[4][i]) };
    }
}
