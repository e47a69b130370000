//! Time against error of the searches on the device: one ray a texel of a fractal, three views.
//!
//! `cargo bench -p render`. All are run in turn, round after round, and the best round counts: other work
//! on the machine then disturbs all alike. Ratios are to `relief(32, 8)`. A search is on the front when no
//! other is both faster and less wrong. `ROUNDS` sets the number of rounds.
#![allow(clippy::unwrap_used, missing_docs)]

use heightfield::{HeightField, Technique, Wrap, oracle};
use rayon::prelude::*;

#[path = "common/fractal.rs"]
mod fractal;

use fractal::{SIZE, fractal};

/// Tiles that the rays cross between lid and floor.
const SHIFTS: [f32; 3] = [0.13, 0.65, 3.2];
/// Azimuth of all rays, radians: along no axis and no diagonal.
const AZIMUTH: f32 = 0.5;
/// Part of the depth; farther off, a hit counts as wrong.
const WRONG: f64 = 0.002;

struct Row {
    technique: Technique,
    seconds: f64,
    p99_texels: f64,
    wrong: f64,
}

fn techniques() -> Vec<Technique> {
    let mut all: Vec<_> = Technique::all()
        .iter()
        .filter(|info| matches!(info.reads, heightfield::technique::Reads::Heights) || info.name == "exact")
        .map(|info| Technique::named(info.name).unwrap())
        .collect();
    for linear in [128.0, 512.0] {
        all.push(Technique::named("relief").unwrap().with("linear", linear).unwrap());
    }
    all
}

fn main() {
    let device = match render::device() {
        Ok(device) => device,
        Err(error) => {
            println!("nothing to measure: {error}");
            return;
        }
    };
    let rounds = std::env::var("ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(7_usize);
    let field = HeightField::new(&fractal(), SIZE, SIZE, Wrap::Repeat).unwrap();
    println!("{} ({}), {SIZE} x {SIZE} texels and rays", device.info().name, device.info().driver_info);
    for shift in SHIFTS {
        let centre = |i: usize| (i as f32 + 0.51) / SIZE as f32;
        let origins: Vec<f32> =
            (0..SIZE * SIZE).flat_map(|at| [centre(at % SIZE), centre(at / SIZE), 1.0]).collect();
        let direction = [shift * AZIMUTH.cos(), shift * AZIMUTH.sin(), -1.0];
        let directions = direction.repeat(SIZE * SIZE);
        let truth: Vec<f64> = origins
            .par_chunks(3)
            .map(|o| oracle::exact(&field, [0, 1, 2].map(|k| f64::from(o[k])), direction.map(f64::from)).t)
            .collect();
        let march =
            |technique: &Technique| render::march(&device, &field, technique, &origins, &directions).unwrap();
        let mut rows: Vec<Row> = techniques()
            .into_iter()
            .map(|technique| {
                let t = march(&technique).hits.t.unwrap();
                let mut errors: Vec<f64> =
                    t.iter().zip(&truth).map(|(t, truth)| (f64::from(*t) - truth).abs()).collect();
                errors.sort_by(f64::total_cmp);
                let right = errors.partition_point(|error| *error <= WRONG);
                Row {
                    technique,
                    seconds: f64::INFINITY,
                    p99_texels: errors[errors.len() * 99 / 100] * f64::from(shift) * SIZE as f64,
                    wrong: 1.0 - right as f64 / errors.len() as f64,
                }
            })
            .collect();
        for _ in 0..rounds {
            for row in &mut rows {
                row.seconds = row.seconds.min(march(&row.technique).device_seconds);
            }
        }
        let relief = rows.iter().find(|row| row.technique.to_string() == "relief(linear=32, refine=8)");
        let unit = relief.map_or(1.0, |row| row.seconds);
        println!("\n{shift} tiles between lid and floor");
        println!(
            "{:<42} {:>8} {:>7} {:>11} {:>8}  front",
            "technique", "ms", "ratio", "p99 texels", "wrong %"
        );
        for row in &rows {
            let beaten =
                rows.iter().any(|other| other.seconds < row.seconds && other.p99_texels < row.p99_texels);
            println!(
                "{:<42} {:>8.1} {:>7.2} {:>11.5} {:>8.3}  {}",
                row.technique.to_string(),
                row.seconds * 1e3,
                row.seconds / unit,
                row.p99_texels,
                100.0 * row.wrong,
                if beaten { "" } else { "yes" }
            );
        }
    }
}
