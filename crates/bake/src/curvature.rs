//! Mean and Gaussian curvature of the displaced surface over a flat tile, in mesh units.
//!
//! For `z = f(x, y)` with slopes `p, q` and second derivatives `r = f_xx`, `s = f_xy`, `t = f_yy`
//! (Gauss 1827; do Carmo 1976, section 3-3)
//!
//! * mean: `-((1 + q^2) r - 2 p q s + (1 + p^2) t) / (2 (1 + p^2 + q^2)^(3/2))`
//! * Gaussian: `(r t - s^2) / (1 + p^2 + q^2)^2`
//!
//! The sign of the mean curvature is chosen so that bumps are **positive**: a sphere of radius `R`
//! seen from outside has mean curvature `1 / R` and Gaussian curvature `1 / R^2`, a groove is
//! negative, and so is the Gaussian curvature of a saddle. Units are 1 / mesh unit and its square.
//! Derivatives are central differences over 3 x 3 texels, exact for quadratic surfaces.
//!
//! Second differences enlarge the steps of 8-bit heights: smooth those first
//! ([`crate::repair::dequantise()`]).

use heightfield::HeightField;
use rayon::prelude::*;

use crate::encode::Rounding;
use crate::maps::{Channel, Form, Map, MapInfo, Plan};
use crate::normal::single;
use crate::texels::{RowSource, Texels};
use crate::{BakeError, Progress};

/// Mean and Gaussian curvature.
pub static CURVATURE: Map = Map {
    info: MapInfo {
        name: "curvature",
        summary: "mean (bumps positive) and Gaussian curvature, per mesh unit and its square",
        source: "Gauss 1827; do Carmo 1976",
        version: 1,
        costly: false,
        form: Form::Single,
        channels: &[Channel::found("mean", Rounding::Nearest), Channel::found("gaussian", Rounding::Nearest)],
        options: &[],
    },
    plan: |grid, _| Plan::single(grid),
    bake: |field, _, progress| single(field, curvature(field, progress)?),
};

/// Steepest slope: its powers still fit, so a senseless scale gives no NaN.
const STEEPEST: f64 = 1e18;
/// Rows between two progress reports.
const BATCH_ROWS: usize = 256;

/// The curvature map: `height * width` pairs of mean and Gaussian curvature; see the module.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn curvature(field: &HeightField, mut progress: Progress<'_>) -> Result<Vec<f32>, BakeError> {
    let extent = field.extent();
    let (width, height) = (field.width(), field.height());
    // Texels a mesh unit, and mesh units of height: in f64, where no scale overflows.
    let per_x = width as f64 / f64::from(extent.tile_size[0]);
    let per_y = height as f64 / f64::from(extent.tile_size[1]);
    let scale = f64::from(extent.scale);
    let texels = Texels::of(field);
    let mut map = vec![0.0_f32; width * height * 2];
    progress.report(0, height)?;
    for (batch, rows) in map.chunks_mut(BATCH_ROWS * width * 2).enumerate() {
        rows.par_chunks_mut(width * 2).enumerate().for_each(|(j, out)| {
            let j = (batch * BATCH_ROWS + j) as i64;
            let [above, here, below] = [j - 1, j, j + 1].map(|j| texels.row(j));
            for (i, texel) in out.chunks_exact_mut(2).enumerate() {
                let (left, right) = neighbours(field, i);
                let [a, b, c] = [left, i, right].map(|i| f64::from(above[i]));
                let [d, e, f] = [left, i, right].map(|i| f64::from(here[i]));
                let [g, h, k] = [left, i, right].map(|i| f64::from(below[i]));
                let p = (scale * per_x * 0.5 * (f - d)).clamp(-STEEPEST, STEEPEST);
                let q = (scale * per_y * 0.5 * (h - b)).clamp(-STEEPEST, STEEPEST);
                let r = scale * per_x * per_x * ((f - e) + (d - e));
                let t = scale * per_y * per_y * ((h - e) + (b - e));
                let s = scale * per_x * per_y * 0.25 * ((k - g) - (c - a));
                let [mean, gaussian] = curvatures(p, q, r, s, t);
                texel[0] = mean.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
                texel[1] = gaussian.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
            }
        });
        progress.report(((batch + 1) * BATCH_ROWS).min(height), height)?;
    }
    Ok(map)
}

fn neighbours(field: &HeightField, i: usize) -> (usize, usize) {
    let (wrap, width) = (field.wrap(), field.width());
    let left = if i > 0 { i - 1 } else { wrap.index(-1, width) };
    let right = if i + 1 < width { i + 1 } else { wrap.index(width as i64, width) };
    (left, right)
}

/// Mean (bumps positive) and Gaussian curvature from the derivatives; see the module.
fn curvatures(p: f64, q: f64, r: f64, s: f64, t: f64) -> [f64; 2] {
    let area = 1.0 + p * p + q * q;
    // Adding 0 turns -0 into 0: a flat map has no sign.
    let mean = -((1.0 + q * q) * r - 2.0 * p * q * s + (1.0 + p * p) * t) / (2.0 * area * area.sqrt()) + 0.0;
    [mean, (r * t - s * s) / (area * area)]
}
