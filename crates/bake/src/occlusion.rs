//! Ambient occlusion and bent normals, from the same sweeps as the horizon, without keeping it.
//!
//! Along one azimuth the sky is open between the horizon's elevation `h` and the zenith. The
//! directions of that slice, weighted by solid angle, add up in closed form to
//!
//! `b = d ((pi/2 - h) - sin h cos h) / 2 + z cos^2 h / 2`,
//!
//! `d` the horizontal direction and `z` up. Summed over the azimuths, `B` is the mean open direction
//! times the open solid angle. The bent normal is `B / |B|` (Landis 2002); the occlusion that a
//! diffuse surface of normal `n` sees under an even sky is `n . B / pi`, 1 for a flat map. Directions
//! below the surface's own tangent plane are left out of both, and so is all below the level mesh.
//!
//! Ville Timonen and Jan Westerholm, Scalable Height Field Self-Shadowing, Computer Graphics Forum
//! 29(2), 2010; Hayden Landis, Production-Ready Global Illumination, SIGGRAPH course notes, 2002.

use heightfield::HeightField;
use rayon::prelude::*;

use crate::encode::Range;
use crate::horizon::{azimuth, azimuths_option, check_azimuths};
use crate::maps::{Channel, Form, Grid, Map, MapInfo, Plan};
use crate::normal::{OPTIONS, settings, single};
use crate::rows::{Block, Fill, for_each_row};
use crate::sweep::{Grids, Lines, RowScratch, Sweep, transposed, working_bytes};
use crate::{BakeError, Convention, Kernel, Progress};

/// Share of the light of an even sky.
pub static AO: Map = Map {
    info: MapInfo {
        name: "ao",
        summary: "ambient occlusion: share of an even sky's light, 0 enclosed to 1 open",
        source: "Timonen and Westerholm 2010",
        version: 4,
        costly: true,
        form: Form::Single,
        channels: &[Channel::fixed("ao", Range::UNIT)],
        options: &[azimuths_option(32), OPTIONS[0]],
    },
    plan: |grid, _| Plan::single(grid).working(sky_bytes(grid)),
    bake: |field, options, progress| {
        let kernel = Kernel::named(options.choice("kernel"))?;
        single(field, ao_map(field, options.whole("azimuths") as usize, kernel, progress)?)
    },
};

/// Mean open direction.
pub static BENT_NORMAL: Map = Map {
    info: MapInfo {
        name: "bent_normal",
        summary: "mean direction of the open sky, unit x, y, z in -1..1",
        source: "Landis 2002; Timonen and Westerholm 2010",
        version: 4,
        costly: true,
        form: Form::Single,
        channels: &[
            Channel::fixed("x", Range::SIGNED),
            Channel::fixed("y", Range::SIGNED),
            Channel::fixed("z", Range::SIGNED),
        ],
        options: &[azimuths_option(32), OPTIONS[0], OPTIONS[1]],
    },
    plan: |grid, _| Plan::single(grid).working(sky_bytes(grid)),
    bake: |field, options, progress| {
        let (kernel, convention) = settings(options)?;
        let azimuths = options.whole("azimuths") as usize;
        single(field, bent_normal_map(field, azimuths, kernel, convention, progress)?)
    },
};

/// Bytes needed besides the map.
fn sky_bytes(grid: Grid) -> u128 {
    working_bytes(grid) + grid.texels() * 2 * size_of::<Sky>() as u128
}

/// What the sky shows at one texel.
#[derive(Debug, Clone, Copy, Default)]
struct Sky {
    /// Slope of the surface in mesh units, x right and y up.
    slope: [f32; 2],
    /// Sum of open directions.
    open: [f32; 3],
}

impl Sky {
    fn normal(&self) -> [f32; 3] {
        let [x, y] = self.slope;
        let inverse = 1.0 / (x * x + y * y + 1.0).sqrt();
        [-x * inverse, -y * inverse, inverse]
    }

    /// `share`: what one azimuth counts, 2 / their number.
    fn occlusion(&self, share: f32) -> f32 {
        let seen: f32 = self.normal().iter().zip(self.open).map(|(n, b)| n * b).sum();
        (seen * share).clamp(0.0, 1.0)
    }

    fn bent_normal(&self, convention: Convention) -> [f32; 3] {
        let [x, y, z] = self.open;
        let length = (x * x + y * y + z * z).sqrt();
        let [x, y, z] = if length > 1e-6 { self.open.map(|c| c / length) } else { self.normal() };
        let y = if convention == Convention::OpenGl { y } else { -y };
        // Adding 0 turns -0 into 0.
        [x + 0.0, y + 0.0, z]
    }
}

/// Ambient occlusion: `height * width` values, 1 open to 0 enclosed.
///
/// `azimuths` slices of the sky are looked at; `kernel` gives the surface's normal.
///
/// # Errors
/// [`BakeError::Option`] for a number of azimuths out of 1..4096, [`BakeError::Interrupted`].
pub fn ao_map(
    field: &HeightField,
    azimuths: usize,
    kernel: Kernel,
    progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    check_azimuths(AO.info.name, azimuths)?;
    let sky = sky(field, azimuths, kernel, progress)?;
    Ok(sky.par_iter().map(|sky| sky.occlusion(2.0 / azimuths as f32)).collect())
}

/// Bent normals: `height * width * 3` numbers in -1..1, the mean open direction, as normals are given.
///
/// Where nothing is open it is the surface's normal.
///
/// # Errors
/// As [`ao_map`].
pub fn bent_normal_map(
    field: &HeightField,
    azimuths: usize,
    kernel: Kernel,
    convention: Convention,
    progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    check_azimuths(BENT_NORMAL.info.name, azimuths)?;
    let sky = sky(field, azimuths, kernel, progress)?;
    Ok(sky.par_iter().flat_map_iter(|sky| sky.bent_normal(convention)).collect())
}

/// Sums the open directions of all texels.
fn sky(
    field: &HeightField,
    azimuths: usize,
    kernel: Kernel,
    mut progress: Progress<'_>,
) -> Result<Vec<Sky>, BakeError> {
    let (width, height) = (field.width(), field.height());
    let mut sky = vec![Sky::default(); width * height];
    slopes(field, kernel, &mut sky)?;
    let grids = Grids::new(field);
    let mut lines = Lines::default();
    progress.report(0, height)?;
    let mut done = 0;
    // All azimuths of one main axis, then those of the other: the sums are turned twice in all.
    for along_x in [true, false] {
        let cross = if along_x { height } else { width };
        if along_x {
            sky = transposed(&sky, width, height);
        }
        for k in 0..azimuths {
            let sweep = grids.towards(field, azimuth(k, azimuths));
            if sweep.plan.along_x != along_x {
                continue;
            }
            sweep.run(&mut lines);
            sky.par_chunks_mut(cross).enumerate().for_each_init(
                || (RowScratch::default(), vec![0.0; cross]),
                |(scratch, sines), (at, sky)| {
                    sweep.texels(&lines, at, scratch, sines);
                    add_slice(&sweep, sines, sky);
                },
            );
            done += 1;
            progress.report(height * done / azimuths, height)?;
        }
        if along_x {
            sky = transposed(&sky, height, width);
        }
    }
    Ok(sky)
}

/// Mesh-space slopes at the texel centres.
fn slopes(field: &HeightField, kernel: Kernel, sky: &mut [Sky]) -> Result<(), BakeError> {
    let extent = field.extent();
    let factor = |texels: usize, tile: f32| {
        (f64::from(extent.scale) * texels as f64 / f64::from(tile)).min(1e18) as f32
    };
    let x = factor(field.width(), extent.tile_size[0]);
    let y = -factor(field.height(), extent.tile_size[1]);
    for_each_row(field, kernel, sky, &mut Progress::none(), &SkySlopes { x, y })
}

/// Height per texel to mesh-space slopes.
struct SkySlopes {
    x: f32,
    y: f32,
}

impl Fill for SkySlopes {
    type Sample = Sky;
    const SAMPLES: usize = 1;

    #[inline(always)]
    fn fill(&self, block: &Block<'_>, out: &mut [Sky]) {
        for ((sky, gx), gy) in out.iter_mut().zip(block.gx).zip(block.gy) {
            sky.slope = [gx * self.x, gy * self.y];
        }
    }
}

/// Adds one azimuth's open directions to a row of texels.
fn add_slice(sweep: &Sweep<'_>, sines: &[f32], sky: &mut [Sky]) {
    let [dx, dy] = sweep.plan.direction.map(|d| d as f32);
    for (sky, &sine) in sky.iter_mut().zip(sines) {
        let rise = (sky.slope[0] * dx + sky.slope[1] * dy).clamp(0.0, 1e18);
        let sine = sine.max(rise / (1.0 + rise * rise).sqrt());
        let cosine_squared = (1.0 - sine * sine).max(0.0);
        let outwards = 0.5 * (acos(sine) - sine * cosine_squared.sqrt());
        sky.open[0] += dx * outwards;
        sky.open[1] += dy * outwards;
        sky.open[2] += 0.5 * cosine_squared;
    }
}

/// Arc cosine for 0..1, within 1e-7: Hastings' polynomial (Abramowitz and Stegun 4.4.46).
#[inline(always)]
fn acos(x: f32) -> f32 {
    const COEFFICIENTS: [f32; 8] = [
        -0.001_262_491,
        0.006_670_09,
        -0.017_088_126,
        0.030_891_88,
        -0.050_174_303,
        0.088_978_99,
        -0.214_598_8,
        std::f32::consts::FRAC_PI_2,
    ];
    let polynomial = COEFFICIENTS.into_iter().fold(0.0, |sum, c| sum * x + c);
    (1.0 - x).max(0.0).sqrt() * polynomial
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_arc_cosine_is_close() {
        for i in 0..=1000 {
            let x = i as f32 / 1000.0;
            let truth = f64::from(x).acos();
            assert!((f64::from(super::acos(x)) - truth).abs() < 4e-7, "{x}: {} {truth}", super::acos(x));
        }
    }
}
