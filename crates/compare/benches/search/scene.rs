//! Maps and rays of the bench, from fixed seeds.

use std::fmt;

use bake::Progress;
use compare::Rays;
use compare::rays::{Random, lateral_per_height, planar};
use heightfield::{Extent, HeightField, Technique, Wrap};
use rayon::prelude::*;

/// Elevations of the view, degrees above the mean plane.
pub const ELEVATIONS: [f64; 5] = [90.0, 45.0, 20.0, 10.0, 5.0];
/// Rays that are timed at a time: a picture of 256 x 128.
pub const RAYS: usize = 1 << 15;
const PICTURE_WIDTH: usize = 256;
/// Mesh units between height 0 and 1, for a tile of 1.
const SCALE: f32 = 0.1;

/// What the surface is like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Map {
    /// Value noise of few octaves.
    Smooth,
    /// Octaves down to the texel, each 0.7 times the last.
    Rough,
    /// Walls and needles one texel wide on gentle ground.
    Thin,
}

pub const MAPS: [Map; 3] = [Map::Smooth, Map::Rough, Map::Thin];

impl fmt::Display for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Smooth => "smooth",
            Self::Rough => "rough",
            Self::Thin => "thin",
        })
    }
}

impl Map {
    /// `side * side` heights in 0..1.
    pub fn texels(self, side: usize) -> Vec<f32> {
        match self {
            Self::Smooth => fractal(side, 4, 0.45),
            Self::Rough => fractal(side, side.ilog2() - 2, 0.7),
            Self::Thin => thin(side),
        }
    }
}

/// The field of some texels, with what its searches build when first asked.
pub fn field(texels: &[f32], side: usize) -> HeightField {
    let extent = Extent { scale: SCALE, ..Extent::default() };
    let field = HeightField::new(texels, side, side, Wrap::Repeat).unwrap().with_extent(extent).unwrap();
    field.pyramid();
    // Larger ones would take longer to bake than to bench.
    if side <= 1024 {
        for info in Technique::all() {
            bake::provide_for(&field, info.reads, Progress::none()).unwrap();
        }
    }
    field
}

/// Octaves of smoothly interpolated value noise that tile; each is `roughness` times the last.
fn fractal(side: usize, octaves: u32, roughness: f64) -> Vec<f32> {
    let lattices: Vec<(usize, f64, Vec<f64>)> = (0..octaves)
        .map(|octave| {
            let n = 4_usize << octave;
            let mut random = Random::new(1, u64::from(octave));
            (n, roughness.powi(octave as i32), (0..n * n).map(|_| random.unit()).collect())
        })
        .collect();
    let sum = |at: usize| -> f64 {
        let place = |texel: usize, n: usize| (texel * n) as f64 / side as f64;
        let ease = |f: f64| f * f * (3.0 - 2.0 * f);
        let octave = |(n, amplitude, lattice): &(usize, f64, Vec<f64>)| {
            let (x, y) = (place(at % side, *n), place(at / side, *n));
            let (i, j, fx, fy) = (x as usize, y as usize, ease(x.fract()), ease(y.fract()));
            let node = |a: usize, b: usize| lattice[(b % n) * n + a % n];
            let top = node(i, j) * (1.0 - fx) + node(i + 1, j) * fx;
            let bottom = node(i, j + 1) * (1.0 - fx) + node(i + 1, j + 1) * fx;
            amplitude * (top * (1.0 - fy) + bottom * fy)
        };
        lattices.iter().map(octave).sum()
    };
    let sums: Vec<f64> = (0..side * side).into_par_iter().map(sum).collect();
    let low = sums.par_iter().copied().reduce(|| f64::INFINITY, f64::min);
    let high = sums.par_iter().copied().reduce(|| f64::NEG_INFINITY, f64::max);
    sums.into_par_iter().map(|h| ((h - low) / (high - low)) as f32).collect()
}

fn thin(side: usize) -> Vec<f32> {
    let mut texels: Vec<f32> = fractal(side, 3, 0.5).into_iter().map(|h| 0.3 * h).collect();
    let mut random = Random::new(2, 0);
    let mut below = |n: usize| (random.unit() * n as f64) as usize;
    // A wall for each 16 x 64 texels and a needle for each 16 x 16, whatever the size of the map.
    for _ in 0..side * side / 1024 {
        let (i, j, length, along) = (below(side), below(side), 8 + below(56), below(2));
        for k in 0..length {
            let (x, y) = if along == 0 { (i + k, j) } else { (i, j + k) };
            texels[(y % side) * side + x % side] = 0.8;
        }
    }
    for _ in 0..side * side / 256 {
        texels[below(side) * side + below(side)] = 1.0;
    }
    texels
}

/// How the rays follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Random places and azimuths.
    Random,
    /// Rows of pixels a texel apart, all from one side.
    Image,
}

pub const ORDERS: [Order; 2] = [Order::Random, Order::Image];

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Random => "random",
            Self::Image => "image",
        })
    }
}

impl Order {
    /// `count` rays from the lid down.
    pub fn rays(self, field: &HeightField, elevation: f64, count: usize) -> Rays {
        match self {
            Self::Random => planar(field, elevation, count, 3).unwrap(),
            Self::Image => picture(field, elevation, count),
        }
    }
}

fn picture(field: &HeightField, elevation: f64, count: usize) -> Rays {
    // An azimuth along no axis and no diagonal.
    let [du, dv] = lateral_per_height(field.extent(), 0.61, elevation);
    let mut rays = Rays::default();
    for at in 0..count {
        let (x, y) = ((at % PICTURE_WIDTH) as f32 + 0.3, (at / PICTURE_WIDTH) as f32 + 0.6);
        rays.origins.extend([x / field.width() as f32, y / field.height() as f32, 1.0]);
        rays.directions.extend([du as f32, dv as f32, -1.0]);
    }
    rays
}
