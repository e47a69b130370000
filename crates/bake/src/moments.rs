//! Slope moments (LEAN) and Toksvig roughness: what of a bump map is left when it is minified.
//!
//! With the slopes of the normal `b = (nx / nz, ny / nz)`, per mesh unit, a texel of [`moments`]
//! holds
//!
//! `bx, by, mxx, mxy, myy`: the means of `bx`, `by`, `bx^2`, `bx by` and `by^2`
//!
//! over its area. All five average linearly, so every level of the chain is exact, and the spread of
//! the normals under a texel is the covariance `mean b b^T - mean b mean b^T` ([`covariance`]).
//! Source: Olano and Baker 2010, "LEAN Mapping".
//!
//! A shader adds its own microsurface, variance `alpha^2 / 2` an axis for Beckmann's distribution of
//! roughness `alpha`, and evaluates a Gaussian of slopes. As a distribution of *half vectors* that
//! Gaussian has to be
//!
//! `D(h) = exp(-(s - m)^T C^-1 (s - m) / 2) / (2 pi sqrt(det C) hz^4)`, `s = (hx, hy) / hz`
//!
//! for the projected area `D(h) hz` to integrate to 1 over the hemisphere: `ds = dw / hz^3` and one
//! more `hz` for the projection. The Gaussian alone, normalised over the plane of slopes, is no such
//! density. [`half_vector_density`] is.
//!
//! [`toksvig_roughness`] is the cheaper way: one number from the length `L` of the averaged unit
//! normal. Toksvig 2005, "Mipmapping normal maps", lowers the exponent `p` of a Blinn-Phong lobe to
//! `p L / (L + p (1 - L))`, that is `1 / p' = 1 / p + (1 - L) / L`: a variance is added. With
//! `p = 2 / alpha^2 - 2` it becomes a map of `alpha`.

use heightfield::HeightField;

use crate::encode::{Range, Rounding};
use crate::maps::{Channel, Form, Kind, Layer, Map, MapInfo, MapOption};
use crate::mips::{mip_chain, plan};
use crate::normal::{self, Factors};
use crate::rows::{Block, Fill, for_each_row};
use crate::{BakeError, Convention, Kernel, Progress, normal_map};

/// LEAN moments.
pub static MOMENTS: Map = Map {
    info: MapInfo {
        name: "moments",
        summary: "mean slopes bx, by and means of bx^2, bx by, by^2 (LEAN), in mip levels",
        source: "Olano and Baker 2010",
        version: 2,
        costly: false,
        form: Form::Levels,
        channels: &[
            Channel::found("bx", Rounding::Nearest),
            Channel::found("by", Rounding::Nearest),
            Channel::found("mxx", Rounding::Nearest),
            Channel::found("mxy", Rounding::Nearest),
            Channel::found("myy", Rounding::Nearest),
        ],
        options: normal::OPTIONS,
    },
    plan: |grid, _| plan(grid),
    bake: |field, options, progress| {
        let (kernel, convention) = normal::settings(options)?;
        moments(field, kernel, convention, progress)
    },
};

/// Toksvig roughness.
pub static TOKSVIG: Map = Map {
    info: MapInfo {
        name: "toksvig",
        summary: "roughness alpha in 0..1 that makes up for averaged normals, in mip levels",
        source: "Toksvig 2005",
        version: 2,
        costly: false,
        form: Form::Levels,
        channels: &[Channel::fixed("alpha", Range::UNIT)],
        options: &[
            normal::OPTIONS[0],
            MapOption {
                name: "roughness",
                summary: "alpha of the surface itself (glTF's roughness squared)",
                kind: Kind::Number { default: 0.25, min: 0.0, max: 1.0 },
            },
        ],
    },
    plan: |grid, _| plan(grid).working(grid.texels() * 12),
    bake: |field, options, progress| {
        let kernel = Kernel::named(options.choice("kernel"))?;
        toksvig_roughness(field, kernel, options.number("roughness") as f32, progress)
    },
};

/// The LEAN moments of all mip levels, finest first; five channels, see the module.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn moments(
    field: &HeightField,
    kernel: Kernel,
    convention: Convention,
    mut progress: Progress<'_>,
) -> Result<Vec<Layer>, BakeError> {
    let factors = Factors::of(field, convention);
    let (width, height) = (field.width(), field.height());
    let mut map = vec![0.0; width * height * 5];
    for_each_row(field, kernel, &mut map, &mut progress, &SlopeMoments { factors })?;
    // The slopes were the work; the chain reads them once more.
    mip_chain(map, width, height, 5, Progress::none())
}

struct SlopeMoments {
    factors: Factors,
}

impl Fill for SlopeMoments {
    type Sample = f32;
    const SAMPLES: usize = 5;

    #[inline(always)]
    fn fill(&self, block: &Block<'_>, out: &mut [f32]) {
        for ((texel, &gx), &gy) in out.as_chunks_mut::<5>().0.iter_mut().zip(block.gx).zip(block.gy) {
            let [x, y] = self.factors.slopes(gx, gy);
            *texel = [x, y, x * x, x * y, y * y];
        }
    }
}

/// Covariance `[xx, xy, yy]` of the slopes under a texel of [`moments`]; `xx` and `yy` not below 0.
pub fn covariance(moments: [f32; 5]) -> [f64; 3] {
    let [x, y, xx, xy, yy] = moments.map(f64::from);
    [(xx - x * x).max(0.0), xy - x * y, (yy - y * y).max(0.0)]
}

/// The density of half vectors, per steradian, of slopes with that mean and covariance `[xx, xy, yy]`.
///
/// `half_vector` is a unit vector; below the horizon the density is 0. The covariance must be
/// positive definite, which it is with a rough microsurface added.
pub fn half_vector_density(mean: [f64; 2], covariance: [f64; 3], half_vector: [f64; 3]) -> f64 {
    let [x, y, z] = half_vector;
    let [xx, xy, yy] = covariance;
    let determinant = xx * yy - xy * xy;
    if z <= 0.0 || determinant <= 0.0 {
        return 0.0;
    }
    let (x, y) = (x / z - mean[0], y / z - mean[1]);
    let distance = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant;
    (-0.5 * distance).exp() / (std::f64::consts::TAU * determinant.sqrt() * z.powi(4))
}

/// Toksvig's roughness of all mip levels, finest first: one channel, `alpha` in 0..1.
///
/// `roughness` is the `alpha` of the surface itself (glTF's roughness squared), taken into 0..1; the
/// finest level has it everywhere.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn toksvig_roughness(
    field: &HeightField,
    kernel: Kernel,
    roughness: f32,
    progress: Progress<'_>,
) -> Result<Vec<Layer>, BakeError> {
    let roughness = roughness.clamp(0.0, 1.0);
    let normals = normal_map(field, kernel, Convention::OpenGl, progress)?;
    let mut layers = mip_chain(normals, field.width(), field.height(), 3, Progress::none())?;
    for (level, layer) in layers.iter_mut().enumerate() {
        layer.texels = if level == 0 {
            // Unit by construction; rounding would make it rough.
            vec![roughness; layer.width * layer.height]
        } else {
            layer.texels.chunks_exact(3).map(|normal| roughened(roughness, normal)).collect()
        };
    }
    Ok(layers)
}

/// The roughness of a lobe of roughness `alpha` spread by normals whose mean is `normal`.
fn roughened(alpha: f32, normal: &[f32]) -> f32 {
    let squared = f64::from(alpha) * f64::from(alpha);
    if squared >= 1.0 {
        return 1.0;
    }
    let length = normal.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>().sqrt().clamp(1e-6, 1.0);
    let inverse_exponent = squared / (2.0 - 2.0 * squared) + (1.0 - length) / length;
    let twice = 2.0 * inverse_exponent;
    (twice / (1.0 + twice)).sqrt() as f32
}
