//! Maps on which searches have gone wrong before.

use heightfield::{HeightField, Wrap};

use crate::common::Random;
use crate::surface::Surface;

/// A map for the search and the same texels for the judge.
pub struct Map {
    pub name: String,
    pub field: HeightField,
    pub surface: Surface,
}

fn map(name: &str, width: usize, height: usize, wrap: Wrap, f: impl FnMut(usize, usize) -> f32) -> Map {
    let mut f = f;
    let texels: Vec<f32> = (0..width * height).map(|at| f(at % width, at / width)).collect();
    Map {
        name: format!("{name} {width}x{height} {wrap:?}"),
        field: HeightField::new(&texels, width, height, wrap).unwrap(),
        surface: Surface::new(texels, width, height, wrap),
    }
}

/// Midpoint displacement by ever finer noise, tiling.
fn fractal(width: usize, height: usize, levels: u32) -> impl FnMut(usize, usize) -> f32 {
    let mut random = Random(77);
    let lattices: Vec<(usize, Vec<f64>)> = (0..levels)
        .map(|level| {
            let n = 3 << level;
            (n, (0..n * n).map(|_| random.next()).collect())
        })
        .collect();
    move |i, j| {
        let mut height_sum = 0.0;
        let mut weight = 0.5;
        for (n, lattice) in &lattices {
            let (x, y) = ((i * n) as f64 / width as f64, (j * n) as f64 / height as f64);
            let (a, b) = (x as usize, y as usize);
            let node = |a: usize, b: usize| lattice[(b % n) * n + a % n];
            let top = node(a, b) + (node(a + 1, b) - node(a, b)) * x.fract();
            let bottom = node(a, b + 1) + (node(a + 1, b + 1) - node(a, b + 1)) * x.fract();
            height_sum += weight * (top + (bottom - top) * y.fract());
            weight *= 0.5;
        }
        height_sum as f32
    }
}

pub fn maps(wrap: Wrap) -> Vec<Map> {
    let noise = |seed: u64| {
        let mut random = Random(seed);
        move |_: usize, _: usize| random.next() as f32
    };
    let mut quantised = fractal(64, 64, 3);
    let mut waves = |i: usize, j: usize| {
        let (u, v) = (i as f64 / 96.0, j as f64 / 80.0);
        let turn = std::f64::consts::TAU;
        (0.5 + 0.3 * (turn * 2.0 * u).sin() * (turn * (v - u)).cos()) as f32
    };
    vec![
        map("noise", 64, 64, wrap, noise(1)),
        map("noise", 61, 47, wrap, noise(2)),
        map("fractal", 128, 128, wrap, fractal(128, 128, 6)),
        map("fractal", 100, 37, wrap, fractal(100, 37, 4)),
        map("walls", 96, 96, wrap, |i, j| if i % 31 == 7 || j % 43 == 11 { 1.0 } else { 0.0 }),
        map("spikes", 72, 50, wrap, |i, j| if i % 9 == 4 && j % 11 == 3 { 1.0 } else { 0.02 }),
        map("checkerboard", 32, 32, wrap, |i, j| ((i + j) % 2) as f32),
        map("8-bit steps", 64, 64, wrap, move |i, j| (quantised(i, j) * 255.0).round() / 255.0),
        map("waves", 96, 80, wrap, &mut waves),
        map("ramp", 33, 33, wrap, |i, j| (i + j) as f32 / 64.0),
        map("flat 0", 16, 16, wrap, |_, _| 0.0),
        map("flat", 7, 5, wrap, |_, _| 0.3),
        map("flat 1", 16, 16, wrap, |_, _| 1.0),
        map("row", 200, 1, wrap, noise(3)),
        map("column", 1, 77, wrap, noise(4)),
        map("texel", 1, 1, wrap, |_, _| 0.6),
        map("two", 2, 3, wrap, noise(5)),
    ]
}

/// Pyramids of more levels; they take the judge longer.
pub fn large_maps(wrap: Wrap) -> Vec<Map> {
    let mut random = Random(6);
    let mut noise = move |_: usize, _: usize| random.next() as f32;
    vec![
        map("fractal", 512, 512, wrap, fractal(512, 512, 8)),
        map("spikes", 333, 257, wrap, |i, j| if i % 67 == 4 && j % 59 == 3 { 1.0 } else { 0.0 }),
        map("row", 1000, 1, wrap, &mut noise),
    ]
}
