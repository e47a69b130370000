//! Height fields of `SIDE` x `SIDE` texels that the benches share, and their clocks.
#![allow(dead_code, clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::time::Instant;

use heightfield::{HeightField, Wrap};
use rayon::prelude::*;

pub const SIDE: usize = 1024;

/// Rough and smooth, round and straight, all of them tiled; those whose name contains `wanted`.
pub fn maps(wanted: &str) -> Vec<(&'static str, HeightField)> {
    let side = SIDE as f64;
    let folded = |x: f64| 1.0 - (2.0 * x / side - 1.0).abs();
    // Balls that touch, eight a side.
    let ball = |i: usize, j: usize| {
        let [x, y] = [i, j].map(|at| (at % (SIDE / 8)) as f64 / (side / 16.0) - 1.0);
        (1.0 - x * x - y * y).max(0.0).sqrt()
    };
    type Make<'a> = (&'static str, Box<dyn Fn() -> HeightField + 'a>);
    let all: [Make<'_>; 11] = [
        ("white noise", Box::new(|| field(|i, j| random(&mut ((j * SIDE + i) as u64))))),
        ("fractal, 9 octaves", Box::new(|| fractal(8, 0.7))),
        ("fractal, 5 octaves", Box::new(|| fractal(5, 0.5))),
        ("sines, 4 periods", Box::new(|| sines(4.0))),
        ("sines, 1 period", Box::new(|| sines(1.0))),
        ("balls", Box::new(|| field(ball))),
        ("ridge", Box::new(|| field(|i, _| folded(i as f64)))),
        ("slanted ridges", Box::new(|| field(|i, j| folded(((3 * i + 2 * j) % SIDE) as f64)))),
        ("pyramid", Box::new(|| field(|i, j| folded(i as f64).min(folded(j as f64))))),
        (
            "terraces",
            Box::new(|| field(|i, j| (folded((i + 3 * j % SIDE) as f64 % side) * 8.0).floor() / 8.0)),
        ),
        ("flat", Box::new(|| field(|_, _| 0.5))),
    ];
    all.into_iter().filter(|(name, _)| name.contains(wanted)).map(|(name, make)| (name, make())).collect()
}

/// The part of a map's name that the command line asks for.
pub fn wanted() -> String {
    std::env::args().skip(1).find(|argument| !argument.starts_with("--")).unwrap_or_default()
}

/// SplitMix64, in 0..1.
pub fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

fn field(height: impl Fn(usize, usize) -> f64 + Sync) -> HeightField {
    let texels: Vec<f32> = (0..SIDE * SIDE)
        .into_par_iter()
        .map(|at| height(at % SIDE, at / SIDE).clamp(0.0, 1.0) as f32)
        .collect();
    HeightField::new(&texels, SIDE, SIDE, Wrap::Repeat).unwrap()
}

/// Octaves of smoothly interpolated value noise that tile; each is `roughness` times the last.
fn fractal(octaves: u32, roughness: f64) -> HeightField {
    let lattices: Vec<Vec<f64>> = (0..octaves)
        .map(|octave| {
            let mut state = u64::from(octave) + 1;
            (0..(4_usize << octave).pow(2)).map(|_| random(&mut state)).collect()
        })
        .collect();
    let total: f64 = (0..octaves as i32).map(|octave| roughness.powi(octave)).sum();
    field(|i, j| {
        let mut sum = 0.0;
        for (octave, lattice) in lattices.iter().enumerate() {
            let n = 4_usize << octave;
            let (x, y) = (i as f64 * n as f64 / SIDE as f64, j as f64 * n as f64 / SIDE as f64);
            let ease = |f: f64| f * f * (3.0 - 2.0 * f);
            let (fx, fy) = (ease(x.fract()), ease(y.fract()));
            let node = |a: usize, b: usize| lattice[(b % n) * n + a % n];
            let (a, b) = (x as usize, y as usize);
            let top = node(a, b) * (1.0 - fx) + node(a + 1, b) * fx;
            let bottom = node(a, b + 1) * (1.0 - fx) + node(a + 1, b + 1) * fx;
            sum += roughness.powi(octave as i32) * (top * (1.0 - fy) + bottom * fy) / total;
        }
        sum
    })
}

fn sines(periods: f64) -> HeightField {
    let turn = std::f64::consts::TAU * periods / SIDE as f64;
    field(|i, j| 0.5 + 0.25 * (i as f64 * turn).sin() + 0.25 * (j as f64 * turn).sin())
}

/// Seconds that all threads of this process have run.
pub fn cpu_seconds() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Clock and processor seconds of a run, and its result.
pub fn timed<T>(run: impl Fn() -> T) -> (f64, f64, T) {
    let (begin, cpu) = (Instant::now(), cpu_seconds());
    let made = black_box(run());
    (begin.elapsed().as_secs_f64(), cpu_seconds() - cpu, made)
}
