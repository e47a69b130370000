//! Horizons, ambient occlusion and distances of 1024 x 1024 maps.
//!
//! `cargo bench -p bake --bench sweep [-- part of a map's name]`. The least of some runs, of the clock and of all
//! threads together.
#![allow(missing_docs, clippy::unwrap_used)]

mod maps;

use std::io::Write;

use bake::{Kernel, Progress, ao_map, distance_map, horizon_map};
use heightfield::HeightField;
use maps::{SIDE, maps, timed, wanted};

const AZIMUTHS: usize = 32;
const DEPTH: usize = 32;
const RUNS: usize = 5;

fn main() {
    println!(
        "{SIDE} x {SIDE}, {} threads; seconds of the clock (of all threads), the least of {RUNS}",
        rayon::current_num_threads()
    );
    println!("{:<22} {:>15} {:>15} {:>15}", "map", "horizon, 32", "ao, 32", "distance, 32");
    for (name, field) in &maps(&wanted()) {
        print!("{name:<22}");
        show(|| horizon(field));
        show(|| ao_map(field, AZIMUTHS, Kernel::Sobel3, Progress::none()).unwrap());
        show(|| distance_map(field, DEPTH, Progress::none()).unwrap());
        println!();
    }
}

fn horizon(field: &HeightField) -> Vec<f32> {
    let map = horizon_map(field, AZIMUTHS, Progress::none()).unwrap();
    // A flat map has none; all others do.
    let flat = field.texels().iter().all(|&height| height == field.texels()[0]);
    assert!(map.len() == SIDE * SIDE * AZIMUTHS && (flat || map.iter().any(|&sine| sine > 0.1)), "not timed");
    map
}

fn show<T>(run: impl Fn() -> T) {
    let (mut clock, mut cpu) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..RUNS {
        let (clock_now, cpu_now, _) = timed(&run);
        (clock, cpu) = (clock.min(clock_now), cpu.min(cpu_now));
    }
    print!(" {clock:>7.2} ({cpu:>5.2})");
    std::io::stdout().flush().unwrap();
}
