//! The row engine behind every map that needs slopes.
//!
//! Rows run in parallel in batches. A row is computed from the five rows around it, block of columns
//! by block of columns, so that all that is in between stays in the nearest cache: a vertical pass
//! over the rows, then a horizontal one over the result, whose few border columns are filled in by
//! the wrap rule. The inner loops hold no wrap and no branch, so they vectorise.

use heightfield::{HeightField, Wrap};
use rayon::prelude::*;

use crate::kernel::{Kernel, Taps};
use crate::{BakeError, Progress};

/// Texels between two progress reports.
const BATCH_TEXELS: usize = 1 << 20;
/// Texels one task handles.
const TASK_TEXELS: usize = 1 << 15;
/// Columns handled at a time.
pub(crate) const BLOCK: usize = 512;
/// The largest reach of a kernel.
pub(crate) const REACH: usize = 2;

/// A row of the height field and its two neighbours on either side, from the one above to the one
/// below; all have the width of the map.
pub(crate) type Rows<'a> = [&'a [f32]; 2 * REACH + 1];

/// Some columns of a row, at most [`BLOCK`], with their gradient.
pub(crate) struct Block<'a> {
    /// `dh/dx`, height per texel.
    pub gx: &'a [f32],
    /// `dh/dy` downwards, height per texel.
    pub gy: &'a [f32],
    /// The heights.
    pub heights: &'a [f32],
}

/// What is made of the gradients. `fill` should be `#[inline(always)]`: it is compiled for several
/// instruction sets.
pub(crate) trait Fill: Sync {
    /// Type of the result.
    type Sample: Send;
    /// Samples a texel.
    const SAMPLES: usize;

    /// Fills the samples of some columns.
    fn fill(&self, block: &Block<'_>, out: &mut [Self::Sample]);
}

/// Fills `target`, which has [`Fill::SAMPLES`] a texel, from the field.
pub(crate) fn for_each_row<F: Fill>(
    field: &HeightField,
    kernel: Kernel,
    target: &mut [F::Sample],
    progress: &mut Progress<'_>,
    fill: &F,
) -> Result<(), BakeError> {
    let (width, height) = (field.width(), field.height());
    let stride = width * F::SAMPLES;
    let taps = kernel.taps();
    let task_rows = (TASK_TEXELS / width).max(1);
    let batch_rows = (BATCH_TEXELS / width / task_rows).max(1) * task_rows;
    progress.report(0, height)?;
    for (batch, rows) in target.chunks_mut(batch_rows * stride).enumerate() {
        let first = batch * batch_rows;
        rows.par_chunks_mut(task_rows * stride).enumerate().for_each(|(task, rows)| {
            for (j, out) in rows.chunks_mut(stride).enumerate() {
                let j = (first + task * task_rows + j) as i64;
                let rows = [-2, -1, 0, 1, 2].map(|k| texel_row(field, j + k));
                fill_row(rows, field.wrap(), &taps, fill, out);
            }
        });
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

/// Fills the samples of one row, with the best instructions there are. All give the same bits:
/// nothing is fused or reordered.
pub(crate) fn fill_row<F: Fill>(rows: Rows<'_>, wrap: Wrap, taps: &Taps, fill: &F, out: &mut [F::Sample]) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        if has!("avx512f") && has!("avx512bw") && has!("avx512dq") && has!("avx512vl") && has!("avx512vbmi") {
            #[allow(unsafe_code)]
            // SAFETY: the processor has the instructions, asked on the line above.
            unsafe {
                fill_row_avx512(rows, wrap, taps, fill, out);
            }
            return;
        }
        if has!("avx2") {
            #[allow(unsafe_code)]
            // SAFETY: the processor has the instructions, asked on the line above.
            unsafe {
                fill_row_avx2(rows, wrap, taps, fill, out);
            }
            return;
        }
    }
    fill_row_here(rows, wrap, taps, fill, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx512vbmi")]
fn fill_row_avx512<F: Fill>(rows: Rows<'_>, wrap: Wrap, taps: &Taps, fill: &F, out: &mut [F::Sample]) {
    fill_row_here(rows, wrap, taps, fill, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn fill_row_avx2<F: Fill>(rows: Rows<'_>, wrap: Wrap, taps: &Taps, fill: &F, out: &mut [F::Sample]) {
    fill_row_here(rows, wrap, taps, fill, out);
}

#[inline(always)]
fn fill_row_here<F: Fill>(rows: Rows<'_>, wrap: Wrap, taps: &Taps, fill: &F, out: &mut [F::Sample]) {
    match taps.radius {
        0 => fill_row_by::<F, 0>(rows, wrap, taps, fill, out),
        1 => fill_row_by::<F, 1>(rows, wrap, taps, fill, out),
        _ => fill_row_by::<F, 2>(rows, wrap, taps, fill, out),
    }
}

/// Columns of a block with `REACH` more on either side.
type Columns = [f32; BLOCK + 2 * REACH];

#[inline(always)]
fn fill_row_by<F: Fill, const R: usize>(
    rows: Rows<'_>,
    wrap: Wrap,
    taps: &Taps,
    fill: &F,
    out: &mut [F::Sample],
) {
    let (mut smooth, mut difference): (Columns, Columns) = ([0.0; _], [0.0; _]);
    let (mut gx, mut gy) = ([0.0_f32; BLOCK], [0.0_f32; BLOCK]);
    for (block, out) in out.chunks_mut(BLOCK * F::SAMPLES).enumerate() {
        let (first, n) = (block * BLOCK, out.len() / F::SAMPLES);
        down::<R>(rows, wrap, taps, first, n, &mut smooth, &mut difference);
        differ_by::<R>(shifts(&smooth, n), taps, &mut gx[..n]);
        smooth_by::<R>(shifts(&difference, n), taps, &mut gy[..n]);
        fill.fill(&Block { gx: &gx[..n], gy: &gy[..n], heights: &rows[REACH][first..first + n] }, out);
    }
}

/// The vertical pass: columns `first - REACH .. first + n + REACH`, smoothed and differenced downwards.
#[inline(always)]
fn down<const R: usize>(
    rows: Rows<'_>,
    wrap: Wrap,
    taps: &Taps,
    first: usize,
    n: usize,
    smooth: &mut Columns,
    difference: &mut Columns,
) {
    let width = rows[REACH].len();
    let (from, to) = (first.saturating_sub(REACH), (first + n + REACH).min(width));
    // Column `x` of the map is at `x + REACH - first`.
    let mut pass = |from: usize, to: usize, at: usize| {
        let part = rows.map(|row| &row[from..to]);
        smooth_by::<R>(part, taps, &mut smooth[at..at + to - from]);
        differ_by::<R>(part, taps, &mut difference[at..at + to - from]);
    };
    pass(from, to, from + REACH - first);
    // What runs down a column is the same for a column and for its wrapped image.
    let beyond = (first as i64 - REACH as i64..0).chain(width as i64..(first + n + REACH) as i64);
    for x in beyond {
        let inside = wrap.index(x, width);
        pass(inside, inside + 1, (x + REACH as i64 - first as i64) as usize);
    }
}

/// The five views of padded columns, shifted by -2 to +2 texels.
#[inline(always)]
fn shifts(columns: &Columns, n: usize) -> Rows<'_> {
    [0, 1, 2, 3, 4].map(|k| &columns[k..k + n])
}

/// Difference across rows with reach `R`; 0 is the one-sided difference.
#[inline(always)]
fn differ_by<const R: usize>(rows: Rows<'_>, taps: &Taps, out: &mut [f32]) {
    let (n, weights) = (out.len(), taps.derivative);
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
#[inline(always)]
fn smooth_by<const R: usize>(rows: Rows<'_>, taps: &Taps, out: &mut [f32]) {
    let (n, centre, weights) = (out.len(), taps.centre, taps.smoothing);
    let rows = rows.map(|row| &row[..n]);
    for i in 0..n {
        let near = centre * rows[2][i] + weights[0] * (rows[1][i] + rows[3][i]);
        out[i] = match R {
            0 => rows[2][i],
            1 => near,
            _ => near + weights[1] * (rows[0][i] + rows[4][i]),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Convention;
    use crate::normal::{Factors, Normals};
    use heightfield::Extent;

    #[test]
    fn all_instructions_give_the_same_bits() {
        let width = 2 * BLOCK + 37;
        let mut state = 1_u32;
        let mut row = || -> Vec<f32> {
            (0..width)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 8) as f32 / 16_777_216.0
                })
                .collect()
        };
        let rows = [row(), row(), row(), row(), row()];
        let rows: Rows<'_> = [0, 1, 2, 3, 4].map(|k| rows[k].as_slice());
        let extent = Extent { scale: 0.01, ..Extent::default() };
        let factors = Factors::new([width, width], &extent, Convention::OpenGl);
        for kernel in Kernel::ALL {
            let taps = kernel.taps();
            let bytes = Normals::<u8, 3>::new(factors);
            let (mut plain, mut best) = (vec![0; 3 * width], vec![0; 3 * width]);
            fill_row_here(rows, Wrap::Mirror, &taps, &bytes, &mut plain);
            fill_row(rows, Wrap::Mirror, &taps, &bytes, &mut best);
            assert_eq!(plain, best, "{kernel:?}");
            let floats = Normals::<f32, 4>::new(factors);
            let (mut plain, mut best) = (vec![0.0; 4 * width], vec![0.0; 4 * width]);
            fill_row_here(rows, Wrap::Repeat, &taps, &floats, &mut plain);
            fill_row(rows, Wrap::Repeat, &taps, &floats, &mut best);
            assert_eq!(plain, best, "{kernel:?}");
            #[cfg(target_arch = "x86_64")]
            if std::arch::is_x86_feature_detected!("avx2") {
                #[allow(unsafe_code)]
                // SAFETY: the processor has the instructions, asked on the line above.
                unsafe {
                    fill_row_avx2(rows, Wrap::Repeat, &taps, &floats, &mut best);
                }
                assert_eq!(plain, best, "{kernel:?}");
            }
        }
    }
}
