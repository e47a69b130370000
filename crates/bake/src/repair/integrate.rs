//! Heights from a normal map: the surface whose normals come closest, in least squares of slopes.
//!
//! * A repeating map is solved at once in Fourier space ([`super::fourier`]), with the very slope
//!   [`Kernel`] the normals were baked with, so a baked map comes back as it was, or with true
//!   derivatives ([`Derivative::Spectral`], Frankot and Chellappa 1988) for normals of a smooth
//!   surface. Frequencies that a kernel does not see are kept small instead of blown up.
//! * A map that ends (clamp, mirror) is solved with slopes halfway between texels, each the mean of
//!   its two neighbours', where the edges are free (Horn and Brooks 1986); what the kernel does not
//!   yet explain is then solved as above on the mirrored map.
//!
//! No height has a slope around a closed path: of measured, painted or mixed normals a part cannot be
//! integrated. [`Integrated`] says how large it is.

use heightfield::Wrap;
use rayon::prelude::*;
use rustfft::num_complex::Complex32;

use super::fourier::{Symbol, Transform};
use super::require;
use crate::{BakeError, Convention, Kernel, Progress};

/// How firmly frequencies that a kernel hardly sees are held at 0, against its square.
const DAMPING: f64 = 1e-3;
/// Bytes a texel of the grid that is transformed.
const BYTES_PER_TEXEL: u128 = 24;

/// What a slope in the normal map stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Derivative {
    /// The true slope of a smooth surface at the texel's centre.
    Spectral,
    /// What a kernel makes of neighbouring texels; [`Kernel::Forward`] counts as central.
    Kernel(Kernel),
}

impl Derivative {
    /// All names.
    pub const NAMES: &'static [&'static str] =
        &["spectral", "central", "sobel3", "sobel5", "scharr", "prewitt", "bilinear"];

    /// The derivative of that name: `"spectral"` or a symmetric kernel.
    ///
    /// # Errors
    /// [`BakeError::UnknownName`].
    pub fn named(name: &str) -> Result<Self, BakeError> {
        match (Self::NAMES.contains(&name), name) {
            (true, "spectral") => Ok(Self::Spectral),
            (true, kernel) => Ok(Self::Kernel(Kernel::named(kernel)?)),
            (false, _) => Err(BakeError::UnknownName {
                what: "derivative",
                name: name.to_owned(),
                known: Self::NAMES.join(", "),
            }),
        }
    }

    fn symbol(self, frequency: f64, highest: bool) -> Symbol {
        let (derivative, smoothing) = match self {
            Self::Spectral => (if highest { 0.0 } else { frequency }, 1.0),
            Self::Kernel(kernel) => {
                let kernel = if kernel == Kernel::Forward { Kernel::Central } else { kernel };
                let taps = kernel.taps();
                let sum = |at: [f32; 2], wave: fn(f64) -> f64| -> f64 {
                    at.iter().zip([1.0, 2.0]).map(|(&t, k)| 2.0 * f64::from(t) * wave(k * frequency)).sum()
                };
                (sum(taps.derivative, f64::sin), f64::from(taps.centre) + sum(taps.smoothing, f64::cos))
            }
        };
        let chord = (2.0 * (0.5 * frequency).sin()).powi(2);
        Symbol { derivative, smoothing, square: frequency * frequency, sine: frequency.sin(), chord }
    }
}

/// How a normal map is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Which way green points.
    pub convention: Convention,
    /// What lies beyond the edge.
    pub wrap: Wrap,
    /// Mesh units covered by one tile.
    pub tile_size: [f32; 2],
    /// What its slopes stand for.
    pub derivative: Derivative,
    /// Steepest slope taken, as the tangent of the angle; steeper normals are laid back to it.
    pub steepest: f64,
}

/// Heights and what they do not explain.
#[derive(Debug, Clone, PartialEq)]
pub struct Integrated {
    /// Heights in 0..1, `width * height`.
    pub heights: Vec<f32>,
    /// Mesh units between height 0 and height 1.
    pub scale: f32,
    /// Mean slope `[dz/dx, dz/dy]`, y down, of the normals: what a repeating map cannot have, and
    /// has not in `heights`.
    pub mean_slope: [f64; 2],
    /// Share of the squared slopes, 0..1, that no heights explain, but for the mean slope.
    pub residual: f64,
    /// Mean angle between the normals and those of the heights, in degrees.
    pub mean_error: f64,
    /// Normals laid back: too steep, or pointing in.
    pub clipped: usize,
}

/// Slopes `[dz/dx, dz/dy]`, y down, of a normal of any length, no steeper than `steepest`, and whether
/// they were laid back.
pub(super) fn slopes(normal: [f32; 3], convention: Convention, steepest: f64) -> ([f64; 2], bool) {
    let [x, y, z] = normal.map(f64::from);
    let y = if convention == Convention::OpenGl { y } else { -y };
    let lateral = x.hypot(y);
    if lateral == 0.0 {
        return ([0.0, 0.0], z < 0.0);
    }
    let clipped = lateral > steepest * z;
    let factor = if clipped { steepest / lateral } else { 1.0 / z };
    ([-x * factor, y * factor], clipped)
}

/// Integrates `normals`, `width * height * 3` floats, +X right, +Z out; their length does not matter.
///
/// # Errors
/// [`BakeError::Shape`]; [`BakeError::Memory`] before anything is allocated; [`BakeError::Interrupted`].
pub fn integrate(
    normals: &[f32],
    width: usize,
    height: usize,
    reading: &Reading,
    mut progress: Progress<'_>,
) -> Result<Integrated, BakeError> {
    let texels = width.checked_mul(height).filter(|n| *n > 0 && n.checked_mul(3) == Some(normals.len()));
    if texels.is_none() {
        return Err(BakeError::Shape { width, height, channels: 3, got: normals.len() });
    }
    let free = reading.wrap != Wrap::Repeat;
    let size = if free { [2 * width, 2 * height] } else { [width, height] };
    let bytes = size[0] as u128 * size[1] as u128 * BYTES_PER_TEXEL;
    require(&format!("integrating {width} x {height} normals"), bytes)?;
    progress.report(0, height)?;

    // Rise a texel, in mesh units.
    let texel = [reading.tile_size[0] / width as f32, reading.tile_size[1] / height as f32].map(f64::from);
    let read: Vec<([f64; 2], bool)> = normals
        .par_chunks_exact(3)
        .map(|n| slopes([n[0], n[1], n[2]], reading.convention, reading.steepest))
        .collect();
    let clipped = read.iter().filter(|(_, clipped)| *clipped).count();
    let rises: Vec<Complex32> = read
        .par_iter()
        .map(|([p, q], _)| Complex32::new((p * texel[0]) as f32, (q * texel[1]) as f32))
        .collect();
    drop(read);
    let solver = Solver::new(width, height, free, reading.derivative);
    let mut heights = solver.heights(&rises, free);
    progress.report(height / 2, height)?;
    let mut rest = solver.rest(&rises, &heights);
    if free {
        let correction = solver.heights(&rest, false);
        heights.par_iter_mut().zip(&correction).for_each(|(h, c)| *h += c);
        progress.report(3 * (height / 4), height)?;
        rest = solver.rest(&rises, &heights);
    }

    let texels = (width * height) as f64;
    let sum = |of: &(dyn Fn(usize) -> f64 + Sync)| (0..width * height).into_par_iter().map(of).sum::<f64>();
    let (rise, fall) =
        (sum(&|at| f64::from(rises[at].re)) / texels, sum(&|at| f64::from(rises[at].im)) / texels);
    let mean = if free { [0.0, 0.0] } else { [rise, fall] };
    let slope = |rise: Complex32, mean: [f64; 2]| {
        [(f64::from(rise.re) - mean[0]) / texel[0], (f64::from(rise.im) - mean[1]) / texel[1]]
    };
    let square = |[p, q]: [f64; 2]| p * p + q * q;
    let unexplained = sum(&|at| square(slope(rest[at], mean)));
    let all = sum(&|at| square(slope(rises[at], mean)));
    let mean_error = sum(&|at| {
        let (a, b) = (slope(rises[at], [0.0; 2]), slope(rises[at] - rest[at], [0.0; 2]));
        // The angle from sine and cosine: the arc cosine is blunt near 0.
        let dot = a[0] * b[0] + a[1] * b[1] + 1.0;
        let cross = [a[1] - b[1], b[0] - a[0], a[0] * b[1] - a[1] * b[0]];
        cross.iter().map(|c| c * c).sum::<f64>().sqrt().atan2(dot).to_degrees()
    }) / texels;
    let low = heights.par_iter().copied().reduce(|| f32::INFINITY, f32::min);
    let high = heights.par_iter().copied().reduce(|| f32::NEG_INFINITY, f32::max);
    let scale = high - low;
    let unit = if scale > 0.0 { 1.0 / f64::from(scale) } else { 0.0 };
    heights.par_iter_mut().for_each(|h| *h = ((f64::from(*h) - f64::from(low)) * unit).min(1.0) as f32);
    progress.report(height, height)?;
    Ok(Integrated {
        heights,
        scale,
        mean_slope: [rise / texel[0], fall / texel[1]],
        residual: if all > 0.0 { (unexplained / all).min(1.0) } else { 0.0 },
        mean_error,
        clipped,
    })
}

/// The transform of a map, mirrored if its edges are free, with the symbols of its slopes.
struct Solver {
    size: [usize; 2],
    free: bool,
    transform: Transform,
    columns: Vec<Symbol>,
    rows: Vec<Symbol>,
}

impl Solver {
    fn new(width: usize, height: usize, free: bool, derivative: Derivative) -> Self {
        let transform = Transform::new(if free { [2 * width, 2 * height] } else { [width, height] });
        let symbols =
            |axis| transform.symbols(axis, |frequency, highest| derivative.symbol(frequency, highest));
        let (columns, rows) = (symbols(0), symbols(1));
        Self { size: [width, height], free, transform, columns, rows }
    }

    /// The plane, or the four mirror images of one whose parts change sign with the mirrors.
    fn spread(&self, plane: &[Complex32], odd: bool) -> Vec<Complex32> {
        if !self.free {
            return plane.to_vec();
        }
        let [width, height] = self.size;
        let mut whole = vec![Complex32::default(); 4 * plane.len()];
        whole.par_chunks_mut(2 * width).enumerate().for_each(|(j, out)| {
            let below = j >= height;
            let row = &plane[(if below { 2 * height - 1 - j } else { j }) * width..][..width];
            let down = if odd && below { -1.0 } else { 1.0 };
            for (i, value) in row.iter().enumerate() {
                out[i] = Complex32::new(value.re, value.im * down);
                let right = if odd { -1.0 } else { 1.0 };
                out[2 * width - 1 - i] = Complex32::new(value.re * right, value.im * down);
            }
        });
        whole
    }

    /// The first quarter of a mirrored plane, or all of it.
    fn gather<T: Send>(&self, plane: &[Complex32], pick: impl Fn(Complex32) -> T + Sync) -> Vec<T> {
        let width = self.size[0];
        let stride = if self.free { 2 * width } else { width };
        let rows = plane.par_chunks_exact(stride).take(self.size[1]);
        rows.flat_map_iter(|row| row[..width].iter().map(|&value| pick(value))).collect()
    }

    /// Least-squares heights of rises a texel; `halfway` takes slopes between texels.
    fn heights(&self, rises: &[Complex32], halfway: bool) -> Vec<f32> {
        let mut plane = self.spread(rises, true);
        self.transform.filter(&mut plane, |kx, ky| {
            let (x, y) = (self.columns[kx], self.rows[ky]);
            let (a, b, below) = if halfway {
                (x.sine, y.sine, x.chord + y.chord)
            } else {
                let (a, b) = (x.derivative * y.smoothing, y.derivative * x.smoothing);
                (a, b, a * a + b * b + DAMPING * (x.square + y.square).powi(2))
            };
            // Only the mean has nothing below, and no slopes either.
            let below = if kx == 0 && ky == 0 { 1.0 } else { below };
            Complex32::new((-b / below) as f32, (-a / below) as f32)
        });
        self.gather(&plane, |value| value.re)
    }

    /// What the kernel finds in the heights taken from the rises; nothing along free edges.
    fn rest(&self, rises: &[Complex32], heights: &[f32]) -> Vec<Complex32> {
        let heights: Vec<Complex32> = heights.iter().map(|&h| Complex32::new(h, 0.0)).collect();
        let mut plane = self.spread(&heights, false);
        drop(heights);
        self.transform.filter(&mut plane, |kx, ky| {
            let (x, y) = (self.columns[kx], self.rows[ky]);
            let (a, b) = (x.derivative * y.smoothing, y.derivative * x.smoothing);
            Complex32::new(-b as f32, a as f32)
        });
        let mut found = self.gather(&plane, |value| value);
        let [width, height] = self.size;
        found.par_iter_mut().zip(rises).enumerate().for_each(|(at, (found, rise))| {
            let (i, j) = (at % width, at / width);
            let ends = |i: usize, n: usize| n > 1 && (i == 0 || i + 1 == n);
            let edge = ends(i, width) || ends(j, height);
            *found = if self.free && edge { Complex32::default() } else { rise - *found };
        });
        found
    }
}
