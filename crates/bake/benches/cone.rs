//! Cone maps of rough and smooth 1024 x 1024 maps, and the textbook's double loop for the record.
//!
//! `cargo bench -p bake --bench cone [-- part of a map's name]`. Times are of the clock and of all threads
//! together; the brute force runs over a few texels and is extrapolated.
#![allow(clippy::unwrap_used, missing_docs)]

mod maps;

use std::io::Write;

use bake::{BakeError, ConeMode, Progress, cone_map, relaxed_cone_map};
use heightfield::HeightField;
use maps::{SIDE, cpu_seconds, maps, timed, wanted};
use rayon::prelude::*;

/// Texels of the brute force, spread over the map.
const BRUTE_TEXELS: usize = 128;

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
        "map", "cone", "cone, texel", "relaxed_cone", "relaxed, texel", "textbook loop"
    );
    for (name, field) in &maps(&wanted()) {
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
        let (clock, cpu, _) = bake(relaxed_cone_map, ConeMode::Texel);
        show(clock, cpu);
        let (brute, expected) = brute_force(field);
        println!(" ({brute:>6.0})");
        let worst = expected.iter().map(|&(at, ratio)| (ratio - map[at]).abs()).fold(0.0, f32::max);
        assert!(worst <= 1e-6, "{name}: the search differs from the brute force by {worst}");
    }
}
