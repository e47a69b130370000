//! Stair steps to slopes: heights that were rounded to few levels, made smooth again.
//!
//! Rounding to 8 bits leaves terraces, which a normal map turns into contour lines. What was there
//! before is anywhere within half a quantum; [`dequantise`] takes the smoothest surface in that box,
//! smooth in the sense of a thin plate, but not smoother than the relief itself shows to be, and
//! without bending round real steps. So
//! * rounding the result to the levels of the input gives **exactly the input**, also after storing
//!   it in 16 bits;
//! * terraces become slopes: ramps with terraces 7 to 40 texels wide keep 0.09 to 0.12 quanta of error out
//!   of 0.29, most of it at their creases;
//! * steps of several quanta and flat ground between them stay; a lone step of one quantum cannot be
//!   told from a gentle slope and becomes one.
//!
//! The plate is solved from coarse to fine, for wide terraces need news from afar. Related work: Rudin,
//! Osher, Fatemi 1992 for variational restoration inside a noise bound; Smith and Wessel 1990 for
//! plates through terrain.

use std::collections::HashSet;

use heightfield::{HeightField, Wrap};

use super::grid::Grid;
use super::plate::Plate;
use super::require;
use crate::resample::{area_average, interpolate};
use crate::{BakeError, Progress};

/// Resolutions, each half of the one before.
const LEVELS: usize = 6;
/// Sides are not halved below this.
const LEAST_SIDE: usize = 8;
/// Steps a pass at the finest resolution and at the others, which are cheap.
const STEPS: [usize; 2] = [32, 48];
/// Passes at each resolution: the second one knows how much the relief bends.
const PASSES: usize = 2;
/// Distinct levels beyond which heights are not taken as quantised.
const MOST_LEVELS: usize = 1 << 16;
/// What 16-bit files can tell apart.
const FINEST: f64 = 1.0 / 65535.0;
/// Bytes a texel that the work needs.
const BYTES_PER_TEXEL: u128 = 44;

/// The step between levels when the heights are multiples of one, up to 16 bits; `None` for heights
/// of one level and for those that are not quantised.
///
/// Levels may be missing and may start anywhere, as when a range of metres was stretched to 0..1.
pub fn quantum(texels: &[f32]) -> Option<f64> {
    let mut levels = HashSet::new();
    let mut last = f32::NAN;
    for &height in texels {
        // Neighbours are often alike; comparing them is cheaper than hashing.
        if height.to_bits() != last.to_bits() {
            last = height;
            if levels.insert((height + 0.0).to_bits()) && levels.len() > MOST_LEVELS {
                return None;
            }
        }
    }
    let mut levels: Vec<f64> = levels.into_iter().map(|bits| f64::from(f32::from_bits(bits))).collect();
    levels.sort_by(f64::total_cmp);
    let gaps = || levels.windows(2).map(|pair| pair[1] - pair[0]);
    let least = gaps().min_by(f64::total_cmp)?;
    // A tenth of a step allows for half-precision storage of 8-bit levels.
    let multiple = |gap: f64| (gap / least - (gap / least).round()).abs() < 0.1;
    if least < 0.9 * FINEST || !gaps().all(multiple) {
        return None;
    }
    let steps: f64 = gaps().map(|gap| (gap / least).round()).sum();
    Some((levels[levels.len() - 1] - levels[0]) / steps)
}

/// Smooth heights within half a `quantum` of those of the field; see the module.
///
/// A quantum that 16 bits cannot split leaves the heights as they are.
///
/// # Errors
/// [`BakeError::Memory`] before anything is allocated, [`BakeError::Interrupted`].
pub fn dequantise(
    field: &HeightField,
    quantum: f64,
    mut progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let (width, height) = (field.width(), field.height());
    let texels = width as u128 * height as u128;
    require(&format!("smoothing {width} x {height} heights"), texels * BYTES_PER_TEXEL)?;
    let heights = field.texels();
    // Half a quantum less what rounding to 16 bits adds: the nearest level stays the nearest.
    let half = 0.5 - 0.5 * FINEST / quantum;
    if half.is_nan() || half <= 0.0 {
        progress.report(height, height)?;
        return Ok(heights);
    }
    let (step, range) = (1.0 / quantum, [0.0, (1.0 / quantum) as f32]);
    let quanta: Vec<f32> = heights.iter().map(|&h| (f64::from(h) * step) as f32).collect();
    let grid = Grid { size: [width, height], periodic: field.wrap() == Wrap::Repeat };
    let levels = coarser(quanta, grid, range);

    // Progress counts texel steps, told in rows.
    let steps_at = |level: usize| STEPS[usize::from(level > 0)];
    let total: usize =
        levels.iter().enumerate().map(|(k, level)| PASSES * steps_at(k) * level.texels()).sum();
    let mut done = 0_usize;
    progress.report(0, height)?;
    let mut smooth: Vec<f32> = Vec::new();
    for (k, level) in levels.iter().enumerate().rev() {
        let plate = level.plate(grid.periodic, half as f32, range);
        let below = levels.get(k + 1);
        smooth = below.map_or_else(|| level.quanta.clone(), |below| finer(&plate, below, &smooth));
        let relief = [plate.relief(0), plate.relief(1)];
        for pass in 0..PASSES {
            let known = (below.is_some() || pass > 0).then_some(&smooth[..]);
            let stiffness = plate.stiffness(&relief, known);
            plate.relax(&stiffness, &mut smooth, steps_at(k), || {
                done += level.texels();
                progress.report(((done as f64 / total as f64) * (height - 1) as f64) as usize, height)
            })?;
        }
    }
    let (half, quanta) = (half * quantum, &levels[0].quanta);
    let moved = smooth.iter().zip(quanta).map(|(s, q)| f64::from(s - q) * quantum);
    let result = heights.iter().zip(moved).map(|(&height, moved)| within(height, moved, half)).collect();
    progress.report(height, height)?;
    Ok(result)
}

/// The heights at one resolution.
struct Resolution {
    size: [usize; 2],
    /// In quanta.
    quanta: Vec<f32>,
    /// Where no real step runs through; known below the finest resolution.
    clear: Option<Vec<f32>>,
}

impl Resolution {
    fn texels(&self) -> usize {
        self.size[0] * self.size[1]
    }

    fn plate(&self, periodic: bool, half: f32, range: [f32; 2]) -> Plate<'_> {
        let grid = Grid { size: self.size, periodic };
        Plate { grid, quantised: &self.quanta, half, range, clear: self.clear.as_deref() }
    }
}

/// `height + change` as a float in 0..1 that is truly no further than `half` from `height`.
fn within(height: f32, change: f64, half: f64) -> f32 {
    let exact = f64::from(height);
    let (low, high) = ((exact - half).max(0.0), (exact + half).min(1.0));
    let moved = (exact + change).clamp(low, high) as f32;
    if f64::from(moved) < low {
        moved.next_up()
    } else if f64::from(moved) > high {
        moved.next_down()
    } else {
        moved
    }
}

/// The heights and their averages over ever larger blocks, finest first.
fn coarser(quanta: Vec<f32>, grid: Grid, range: [f32; 2]) -> Vec<Resolution> {
    let mut levels = vec![Resolution { size: grid.size, quanta, clear: None }];
    let steps = levels[0].plate(grid.periodic, 0.5, range).steps();
    while levels.len() < LEVELS {
        let last = &levels[levels.len() - 1];
        let size = last.size.map(|n| if n >= 2 * LEAST_SIDE { n / 2 } else { n });
        if size == last.size {
            break;
        }
        let quanta = area_average(&last.quanta, last.size, 1, size);
        // A step that crosses a block of n x n texels is seen by at least n of them.
        let side = (0..2).map(|axis| grid.size[axis] / size[axis]).max().unwrap_or(1) as f32;
        let mut clear = area_average(&steps, grid.size, 1, size);
        clear.iter_mut().for_each(|share| *share = (1.0 - *share * side).max(0.0));
        levels.push(Resolution { size, quanta, clear: Some(clear) });
    }
    levels
}

/// A start at a finer resolution: the coarse surface where it fits the box, else the data moved by
/// what the coarse surface moved it; the data alone where steps blur the coarse surface.
fn finer(plate: &Plate<'_>, coarse: &Resolution, smooth: &[f32]) -> Vec<f32> {
    let Grid { size, periodic } = plate.grid;
    let up = |plane: &[f32]| interpolate(plane, coarse.size, size, periodic);
    let moved: Vec<f32> = smooth.iter().zip(&coarse.quanta).map(|(s, q)| s - q).collect();
    let (mut start, moved, clear) = (up(smooth), up(&moved), coarse.clear.as_deref().map(up));
    let [low, high] = plate.range;
    for (at, start) in start.iter_mut().enumerate() {
        let quantised = plate.quantised[at];
        let mut change = *start - quantised;
        if change.abs() > plate.half {
            change = moved[at].clamp(-plate.half, plate.half);
        }
        let clear = clear.as_ref().map_or(1.0, |clear| clear[at]);
        *start = (quantised + change * clear).clamp(low, high);
    }
    start
}
