//! Cone maps of rough and smooth 1024 x 1024 maps, and the textbook's double loop for the record.
//!
//! `cargo bench -p bake --bench cone [-- part of a map's name]`. Times are of the clock and of all threads
//! together; the brute force runs over a few texels and is extrapolated. The published relaxed cones take minutes on
//! smooth maps: they are timed on every fourth texel of every fourth row.
#![allow(clippy::unwrap_used, missing_docs)]

use std::hint::black_box;
use std::io::Write;
use std::time::Instant;

use bake::{BakeError, ConeMode, Progress, cone_map, relaxed_cone_map};
use heightfield::{HeightField, Wrap};
use rayon::prelude::*;

const SIDE: usize = 1024;
/// Texels of the brute force, spread over the map.
const BRUTE_TEXELS: usize = 128;

/// SplitMix64, in 0..1.
fn random(state: &mut u64) -> f64 {
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

/// Every fourth texel of every fourth row.
fn quarter(field: &HeightField) -> HeightField {
    let (texels, n) = (field.texels(), SIDE / 4);
    let texels: Vec<f32> = (0..n * n).map(|at| texels[at / n * 4 * SIDE + at % n * 4]).collect();
    HeightField::new(&texels, n, n, Wrap::Repeat).unwrap()
}

/// Seconds that all threads of this process have run.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = stat.rsplit(')').next().unwrap_or_default();
    let fields: Vec<f64> = after.split_whitespace().filter_map(|field| field.parse().ok()).collect();
    // The state letter is dropped by the parse: user and system time are fields 11 and 12 after it, in ticks.
    if fields.len() > 11 { (fields[10] + fields[11]) / 100.0 } else { f64::NAN }
}

/// Clock and processor seconds of a run, and its result.
fn timed<T>(run: impl Fn() -> T) -> (f64, f64, T) {
    let (begin, cpu) = (Instant::now(), cpu_seconds());
    let made = black_box(run());
    (begin.elapsed().as_secs_f64(), cpu_seconds() - cpu, made)
}

/// The textbook's loop over all texels, for a few of them; its seconds for the whole map.
fn brute_force(field: &HeightField) -> (f64, Vec<(usize, f32)>) {
    let (begin, n) = (cpu_seconds(), SIDE as i64);
    let texels = field.texels();
    let map: Vec<(usize, f32)> = (0..BRUTE_TEXELS)
        .into_par_iter()
        .map(|k| {
            let at = k * (SIDE * SIDE / BRUTE_TEXELS) + k * 37 % SIDE;
            let (i, j) = ((at % SIDE) as i64, (at / SIDE) as i64);
            let low = texels[at];
            let mut best = 1.0_f32;
            for y in 0..n {
                let dy = ((y - j + n / 2) & (n - 1)) - n / 2;
                for (x, &high) in (0..n).zip(&texels[(y * n) as usize..]) {
                    let dx = ((x - i + n / 2) & (n - 1)) - n / 2;
                    let away = ((dx * dx + dy * dy) as f32).sqrt() / n as f32;
                    if high > low {
                        best = best.min(away / (high - low));
                    }
                }
            }
            (at, best)
        })
        .collect();
    ((cpu_seconds() - begin) * (SIDE * SIDE / BRUTE_TEXELS) as f64, map)
}

fn main() {
    println!(
        "{SIDE} x {SIDE}, {} threads; seconds of the clock (of all threads)",
        rayon::current_num_threads()
    );
    println!(
        "{:<22} {:>15} {:>15} {:>15} {:>15} {:>12}",
        "map", "cone", "cone, texel", "relaxed_cone", "texel, 256^2", "textbook loop"
    );
    let maps = [
        ("white noise", field(|i, j| random(&mut ((j * SIDE + i) as u64)))),
        ("fractal, 9 octaves", fractal(8, 0.7)),
        ("fractal, 5 octaves", fractal(5, 0.5)),
        ("sines, 4 periods", sines(4.0)),
        ("sines, 1 period", sines(1.0)),
        ("flat", field(|_, _| 0.5)),
    ];
    let wanted = std::env::args().skip(1).find(|argument| !argument.starts_with("--")).unwrap_or_default();
    for (name, field) in maps.iter().filter(|(name, _)| name.contains(&wanted)) {
        print!("{name:<22}");
        let show = |clock: f64, cpu: f64| {
            print!(" {clock:>7.2} ({cpu:>5.2})");
            std::io::stdout().flush().unwrap();
        };
        let bake = |make: fn(&HeightField, ConeMode, Progress<'_>) -> Result<Vec<f32>, BakeError>, mode| {
            timed(|| make(field, mode, Progress::none()).unwrap())
        };
        let (clock, cpu, _) = bake(cone_map, ConeMode::Conservative);
        show(clock, cpu);
        let (clock, cpu, map) = bake(cone_map, ConeMode::Texel);
        show(clock, cpu);
        let (clock, cpu, _) = bake(relaxed_cone_map, ConeMode::Conservative);
        show(clock, cpu);
        let small = quarter(field);
        let relaxed = || relaxed_cone_map(&small, ConeMode::Texel, Progress::none()).unwrap();
        let (clock, cpu, _) = timed(relaxed);
        show(clock, cpu);
        let (brute, expected) = brute_force(field);
        println!(" ({brute:>6.0})");
        let worst = expected.iter().map(|&(at, ratio)| (ratio - map[at]).abs()).fold(0.0, f32::max);
        assert!(worst <= 1e-6, "{name}: the search differs from the brute force by {worst}");
    }
}
