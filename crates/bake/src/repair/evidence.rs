//! A normal map against the height map beside it.

use heightfield::HeightField;
use rayon::prelude::*;

use super::check::Axes;
use crate::{BakeError, Convention, Kernel, Progress, slopes};

/// Least correlation along an axis for a verdict.
const RELATED: f64 = 0.25;
/// Texels at most that the search for the best scale looks at.
const SAMPLE: usize = 1 << 17;
/// How far from the least-squares scale the best one is looked for, as a factor, and in how many steps.
const SEARCH: (f64, usize) = (4.0, 24);

/// What normals and heights say about each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Against {
    /// Correlation of the slopes read as OpenGL with those of the heights: along x, along y; then the
    /// slope along y with the heights' along x, and the other way round.
    pub correlation: [f64; 4],
    /// The reading that fits best.
    pub best: Axes,
    /// Whether the heights are upside down (depths), or both axes of the normals turned round.
    pub inverted: bool,
    /// The lower of the two correlations of that reading, 0..1.
    pub confidence: f64,
    /// Mesh units between height 0 and height 1 at which the heights' normals come closest.
    pub scale: f64,
    /// Mean angle between the normals and those of the heights at that scale, in degrees.
    pub mean_error: f64,
    /// Mean angle between the normals and (0, 0, 1): what no height map at all would give.
    pub flat_error: f64,
}

impl Against {
    /// Whether these normals belong to these heights.
    pub fn decides(&self) -> bool {
        self.confidence >= RELATED
    }
}

/// Compares normals as stored, and their slopes read as OpenGL, with a field of the same size. `None`
/// when one of them is flat.
pub(super) fn against_heights(
    normals: &[f32],
    read: &[[f64; 2]],
    field: &HeightField,
) -> Result<Option<Against>, BakeError> {
    let tile = field.extent().tile_size.map(f64::from);
    // Rise of height 0..1 a mesh unit.
    let rises: Vec<[f64; 2]> = slopes(field, Kernel::Sobel3, Progress::none())?
        .par_iter()
        .map(|&[u, v]| [f64::from(u) / tile[0], f64::from(v) / tile[1]])
        .collect();
    let pair = |k: usize, l: usize| {
        let sums = rises
            .par_iter()
            .zip(read)
            .map(|(rise, slope)| [rise[k] * slope[l], rise[k] * rise[k], slope[l] * slope[l]]);
        let [product, a, b] = sums.reduce(|| [0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
        if a > 0.0 && b > 0.0 { product / (a * b).sqrt() } else { 0.0 }
    };
    let correlation = [pair(0, 0), pair(1, 1), pair(0, 1), pair(1, 0)];
    let [xx, yy, xy, yx] = correlation;
    let swapped = xy.abs() + yx.abs() > xx.abs() + yy.abs();
    // Slopes of the swapped reading are the negatives of the stored ones.
    let (x, y) = if swapped { (-xy, -yx) } else { (xx, yy) };
    if x == 0.0 && y == 0.0 {
        return Ok(None);
    }
    let convention = if x * y >= 0.0 { Convention::OpenGl } else { Convention::DirectX };
    let best = Axes { convention, swapped };
    let inverted = if x == 0.0 { y < 0.0 } else { x < 0.0 };
    let sign = if inverted { -1.0 } else { 1.0 };
    let [product, square] = rises
        .par_iter()
        .zip(read)
        .map(|(rise, &slope)| {
            let [p, q] = best.slopes(slope);
            [rise[0] * p + rise[1] * q, rise[0] * rise[0] + rise[1] * rise[1]]
        })
        .reduce(|| [0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    let fitted = (sign * product / square).max(f64::MIN_POSITIVE);

    let error = |scale: f64, stride: usize| {
        let texels = rises.len().div_ceil(stride);
        let one = |at: usize| {
            let normal = &normals[3 * at * stride..][..3];
            let [p, q] = rises[at * stride].map(|rise| sign * scale * rise);
            let stored = [f64::from(normal[0]), f64::from(normal[1]), f64::from(normal[2])];
            angle(stored, best.normal(p, q))
        };
        (0..texels).into_par_iter().map(one).sum::<f64>() / texels as f64
    };
    // An odd stride meets all columns of maps whose width is a power of two.
    let stride = (rises.len() / SAMPLE).max(1) | 1;
    let scale = lowest(fitted, |scale| error(scale, stride));
    Ok(Some(Against {
        correlation,
        best,
        inverted,
        confidence: x.abs().min(y.abs()),
        scale,
        mean_error: error(scale, 1),
        flat_error: error(0.0, 1),
    }))
}

impl Axes {
    /// The normal, of any length, as this reading stores it for slopes `p`, `q` (y down).
    fn normal(self, p: f64, q: f64) -> [f64; 3] {
        let y = if self.convention == Convention::OpenGl { q } else { -q };
        if self.swapped { [y, -p, 1.0] } else { [-p, y, 1.0] }
    }
}

/// Angle between two vectors in degrees; 0 for one without length.
fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    cross.iter().map(|c| c * c).sum::<f64>().sqrt().atan2(dot).to_degrees()
}

/// Where `f` is lowest around `near`: golden section over the logarithm (Kiefer 1953).
fn lowest(near: f64, f: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = ((near / SEARCH.0).ln(), (near * SEARCH.0).ln());
    let at = |x: f64| f(x.exp());
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_a, mut at_b) = (at(a), at(b));
    for _ in 0..SEARCH.1 {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - golden * (high - low);
            at_a = at(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + golden * (high - low);
            at_b = at(b);
        }
    }
    (0.5 * (low + high)).exp()
}
