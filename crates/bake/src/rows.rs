//! The row engine behind every map that needs slopes.
//!
//! Rows run in parallel, some at a time. They are computed strip of columns by strip of columns: a
//! horizontal pass over each row as it comes in, kept for as many rows as a kernel reaches, then a
//! vertical one over what is kept. All that is in between stays in the nearest cache, and each height
//! is read once. The inner loops run over [`CHUNK`] columns, hold no wrap and no branch, and so
//! vectorise; the few columns beyond the border are filled in by the wrap rule before.
//!
//! What limits it is memory: asking for the next row ahead of time is worth a quarter of the time,
//! since the hardware's own prefetcher does not look across the strips.

use heightfield::lanes::{self, Lanes};
use heightfield::{HeightField, Wrap};
use rayon::prelude::*;

use crate::kernel::{Kernel, Taps};
use crate::texels::{RowSource, Texels};
use crate::{BakeError, Progress};

/// Texels between two progress reports.
const BATCH_TEXELS: usize = 1 << 21;
/// Texels one task handles: each begins with rows that its neighbour also needs.
pub(crate) const TASK_TEXELS: usize = 1 << 16;
/// Columns of a strip.
const STRIP: usize = CHUNKS * CHUNK;
/// Chunks of a strip.
const CHUNKS: usize = 8;
/// Columns handled at a time.
pub(crate) const CHUNK: usize = 64;
/// The largest reach of a kernel.
pub(crate) const REACH: usize = 2;
/// The most samples a texel has.
const MOST_SAMPLES: usize = 5;
/// Rows that a kernel looks at.
const RING: usize = 2 * REACH + 1;

/// Some columns of a row with their gradient; those beyond the last column of the map mean nothing.
pub(crate) struct Block<'a> {
    /// `dh/dx`, height per texel.
    pub gx: &'a [f32; CHUNK],
    /// `dh/dy` downwards, height per texel.
    pub gy: &'a [f32; CHUNK],
    /// The heights.
    pub heights: &'a [f32; CHUNK],
}

/// What is made of the gradients. `fill` should be `#[inline(always)]`: it is compiled for several
/// instruction sets.
pub(crate) trait Fill: Sync {
    /// Type of the result.
    type Sample: Copy + Default + Send;
    /// Samples a texel.
    const SAMPLES: usize;

    /// Fills the samples of [`CHUNK`] columns.
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
    for_each_row_of(&Texels::of(field), kernel, target, progress, fill)
}

/// Fills `target`, which has [`Fill::SAMPLES`] a texel, from texels.
pub(crate) fn for_each_row_of<F: Fill>(
    texels: &Texels<'_>,
    kernel: Kernel,
    target: &mut [F::Sample],
    progress: &mut Progress<'_>,
    fill: &F,
) -> Result<(), BakeError> {
    let [width, height] = texels.size();
    let stride = width * F::SAMPLES;
    let task_rows = (TASK_TEXELS / width).max(1);
    let batch_rows = (BATCH_TEXELS / width / task_rows).max(1) * task_rows;
    progress.report(0, height)?;
    for (batch, rows) in target.chunks_mut(batch_rows * stride).enumerate() {
        let first = batch * batch_rows;
        rows.par_chunks_mut(task_rows * stride).enumerate().for_each(|(task, out)| {
            fill_rows(texels, (first + task * task_rows) as i64, kernel, fill, out);
        });
        progress.report((first + batch_rows).min(height), height)?;
    }
    Ok(())
}

/// Fills rows from `first` on, as many as `out` holds, with the best instructions there are. All give
/// the same bits: nothing is fused or reordered.
pub(crate) fn fill_rows<R: RowSource, F: Fill>(
    source: &R,
    first: i64,
    kernel: Kernel,
    fill: &F,
    out: &mut [F::Sample],
) {
    lanes::dispatch(Task { source, first, taps: kernel.taps(), fill, out });
}

/// Rows to be filled; of the lanes it runs with it only takes the instruction set.
struct Task<'a, R, F: Fill> {
    source: &'a R,
    first: i64,
    taps: Taps,
    fill: &'a F,
    out: &'a mut [F::Sample],
}

impl<R: RowSource, F: Fill> lanes::Kernel for Task<'_, R, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        match self.taps.radius {
            0 => self.rows::<0>(),
            1 => self.rows::<1>(),
            _ => self.rows::<2>(),
        }
    }
}

/// Numbers for some columns.
type Columns = [f32; CHUNK];
/// Numbers for the columns of a strip.
type Strip = [Columns; CHUNKS];

/// At the start of a line of the cache: a vector across two of them is read as slowly as two.
#[repr(align(64))]
struct Aligned<T>(T);

/// What the horizontal pass gives for the rows around one, by their number modulo [`RING`].
#[repr(align(64))]
struct Kept {
    /// Smoothed along the row.
    smooth: [Strip; RING],
    /// Differenced along the row.
    difference: [Strip; RING],
}

impl<R: RowSource, F: Fill> Task<'_, R, F> {
    #[inline(always)]
    fn rows<const RADIUS: usize>(self) {
        let width = self.source.row(self.first).len();
        let stride = width * F::SAMPLES;
        let rows = (self.out.len() / stride) as i64;
        // The one-sided difference looks at the row below, too.
        let ahead = RADIUS.max(1) as i64;
        let none = [[0.0; CHUNK]; CHUNKS];
        let mut kept = Kept { smooth: [none; RING], difference: [none; RING] };
        let mut spare =
            Spare { heights: [0.0; CHUNK], samples: [[F::Sample::default(); CHUNK]; MOST_SAMPLES] };
        for left in (0..width).step_by(STRIP) {
            let right = (left + STRIP).min(width);
            for step in -2 * ahead..rows {
                let coming = self.first + step + ahead;
                let row = self.source.row(coming);
                let after = self.source.row(if step + 1 < rows { coming + 1 } else { coming });
                let here = self.source.row(self.first + step.max(0));
                let (into, around) = (slot(coming), slots_around(coming - ahead));
                for from in (left..right).step_by(CHUNK) {
                    let (to, at) = ((from + CHUNK).min(right), (from - left) / CHUNK);
                    prefetch(&after[from..to], CHUNK);
                    let mut edge = [0.0; CHUNK + 2 * REACH];
                    let window = window(row, from, self.source.wrap(), &mut edge);
                    smooth_by::<RADIUS>(shifted(window), &self.taps, &mut kept.smooth[into][at]);
                    differ_by::<RADIUS>(shifted(window), &self.taps, &mut kept.difference[into][at]);
                    if step < 0 {
                        continue;
                    }
                    let first = step as usize * stride;
                    if let Some(below) = self.out.get(first + stride..first + 2 * stride) {
                        prefetch(&below[from * F::SAMPLES..], CHUNK * F::SAMPLES);
                    }
                    let (mut gx, mut gy) = (Aligned([0.0; CHUNK]), Aligned([0.0; CHUNK]));
                    smooth_by::<RADIUS>(stacked(&kept.difference, around, at), &self.taps, &mut gx.0);
                    differ_by::<RADIUS>(stacked(&kept.smooth, around, at), &self.taps, &mut gy.0);
                    let out = &mut self.out[first + from * F::SAMPLES..first + to * F::SAMPLES];
                    fill_columns(self.fill, &gx.0, &gy.0, &here[from..to], out, &mut spare);
                }
            }
        }
    }
}

/// Room for columns of which some lie beyond the map.
struct Spare<S> {
    heights: Columns,
    samples: [[S; CHUNK]; MOST_SAMPLES],
}

/// Fills the columns that there are.
#[inline(always)]
fn fill_columns<F: Fill>(
    fill: &F,
    gx: &Columns,
    gy: &Columns,
    heights: &[f32],
    out: &mut [F::Sample],
    spare: &mut Spare<F::Sample>,
) {
    let whole = heights.len() == CHUNK;
    if !whole {
        spare.heights[..heights.len()].copy_from_slice(heights);
    }
    let heights = heights.first_chunk().unwrap_or(&spare.heights);
    let samples = &mut spare.samples.as_flattened_mut()[..CHUNK * F::SAMPLES];
    // One place that fills, for it is compiled in full wherever it stands.
    fill.fill(&Block { gx, gy, heights }, if whole { &mut *out } else { &mut *samples });
    if !whole {
        out.copy_from_slice(&samples[..out.len()]);
    }
}

/// Columns with [`REACH`] more on either side.
type Window = [f32; CHUNK + 2 * REACH];

/// The columns from `from` on. Where they reach over the border they are put together in `edge`: those
/// beyond it by the wrap rule, and what lies beyond those stays.
#[inline(always)]
fn window<'a>(row: &'a [f32], from: usize, wrap: Wrap, edge: &'a mut Window) -> &'a Window {
    if let Some(inside) = from.checked_sub(REACH).and_then(|first| row.get(first..)?.first_chunk()) {
        return inside;
    }
    let width = row.len();
    for (column, height) in (from as i64 - REACH as i64..(width + REACH) as i64).zip(&mut *edge) {
        *height = row[wrap.index(column, width)];
    }
    edge
}

/// The columns of a window, shifted by -2 to 2.
#[inline(always)]
fn shifted(window: &Window) -> [&Columns; RING] {
    [view(window, 0), view(window, 1), view(window, 2), view(window, 3), view(window, 4)]
}

#[inline(always)]
fn view(window: &Window, first: usize) -> &Columns {
    window[first..].first_chunk().unwrap_or(&[0.0; CHUNK])
}

/// The columns of chunk `at` in the rows kept in those slots.
#[inline(always)]
fn stacked(kept: &[Strip; RING], [a, b, c, d, e]: [usize; RING], at: usize) -> [&Columns; RING] {
    [&kept[a][at], &kept[b][at], &kept[c][at], &kept[d][at], &kept[e][at]]
}

/// Where a row is kept, and the two before and after it.
#[inline(always)]
fn slots_around(row: i64) -> [usize; RING] {
    [slot(row - 2), slot(row - 1), slot(row), slot(row + 1), slot(row + 2)]
}

#[inline(always)]
fn slot(row: i64) -> usize {
    row.rem_euclid(RING as i64) as usize
}

/// Asks for `count` numbers that are needed soon, and maybe for some behind the slice: nothing is read.
#[inline(always)]
fn prefetch<T>(soon: &[T], count: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        const LINE: usize = 64;
        let start = soon.as_ptr().cast::<i8>();
        for line in 0..count * size_of::<T>() / LINE {
            #[allow(unsafe_code)]
            // SAFETY: every x86-64 processor has the instruction, which never faults and changes nothing.
            unsafe {
                _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(line * LINE));
            }
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (soon, count);
}

/// Difference across rows, or columns, with reach `RADIUS`; 0 is the one-sided difference.
#[inline(always)]
fn differ_by<const RADIUS: usize>(across: [&Columns; RING], taps: &Taps, out: &mut Columns) {
    let ([a, b, c, d, e], weights) = (across, taps.derivative);
    for i in 0..CHUNK {
        out[i] = match RADIUS {
            0 => d[i] - c[i],
            1 => weights[0] * (d[i] - b[i]),
            _ => weights[0] * (d[i] - b[i]) + weights[1] * (e[i] - a[i]),
        };
    }
}

/// Symmetric smoothing across rows, or columns, with reach `RADIUS`.
#[inline(always)]
fn smooth_by<const RADIUS: usize>(across: [&Columns; RING], taps: &Taps, out: &mut Columns) {
    let ([a, b, c, d, e], centre, weights) = (across, taps.centre, taps.smoothing);
    for i in 0..CHUNK {
        let near = centre * c[i] + weights[0] * (b[i] + d[i]);
        out[i] = match RADIUS {
            0 => c[i],
            1 => near,
            _ => near + weights[1] * (a[i] + e[i]),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Convention;
    use crate::normal::{Factors, Normals};
    use heightfield::Extent;
    use heightfield::lanes::{Level, dispatch_at};

    const SIZE: [usize; 2] = [STRIP + CHUNK + 37, 6];

    fn noise() -> Vec<f32> {
        let mut state = 1_u32;
        let next = |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        (0..SIZE[0] * SIZE[1]).map(next).collect()
    }

    fn filled<F: Fill>(level: Level, texels: &Texels<'_>, kernel: Kernel, fill: &F) -> Vec<F::Sample> {
        let mut out = vec![F::Sample::default(); SIZE[0] * SIZE[1] * F::SAMPLES];
        dispatch_at(level, Task { source: texels, first: 0, taps: kernel.taps(), fill, out: &mut out });
        out
    }

    #[test]
    fn all_instructions_give_the_same_bits() {
        let heights = noise();
        let extent = Extent { scale: 0.01, ..Extent::default() };
        let factors = Factors::new(SIZE, &extent, Convention::OpenGl);
        let (bytes, floats) = (Normals::<u8, 3>::new(factors), Normals::<f32, 4>::new(factors));
        for kernel in Kernel::ALL {
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                let texels = Texels::new(&heights, SIZE, wrap).unwrap();
                let plain = filled(Level::Baseline, &texels, kernel, &bytes);
                let plain_floats = filled(Level::Baseline, &texels, kernel, &floats);
                for &level in Level::available() {
                    let at = level.name();
                    assert_eq!(plain, filled(level, &texels, kernel, &bytes), "{kernel:?} {wrap:?} {at}");
                    assert_eq!(plain_floats, filled(level, &texels, kernel, &floats), "{kernel:?} {at}");
                }
            }
        }
    }

    /// Rows one by one, in pieces and at once; a task begins anywhere.
    #[test]
    fn where_a_task_begins_does_not_matter() {
        let heights = noise();
        let texels = Texels::new(&heights, SIZE, Wrap::Repeat).unwrap();
        let fill = Normals::<u16, 3>::new(Factors::new(SIZE, &Extent::default(), Convention::DirectX));
        for kernel in Kernel::ALL {
            let mut whole = vec![0; SIZE[0] * SIZE[1] * 3];
            fill_rows(&texels, 0, kernel, &fill, &mut whole);
            for rows in [1, 4] {
                let mut pieces = vec![0; whole.len()];
                for (at, out) in pieces.chunks_mut(rows * SIZE[0] * 3).enumerate() {
                    fill_rows(&texels, (at * rows) as i64, kernel, &fill, out);
                }
                assert_eq!(whole, pieces, "{kernel:?} {rows}");
            }
        }
    }
}
