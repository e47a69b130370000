//! Time and error side by side: every search, three view angles, two maps.
//!
//! `cargo bench -p heightfield`. Each result is checked against the `f64` oracle before it is timed, and
//! the table at the end has nanoseconds a ray beside the 99th percentile of the error in texels and the
//! share of rays whose true first hit was skipped. All rays and maps come from fixed seeds.
#![allow(clippy::unwrap_used, missing_docs)]

use std::cell::RefCell;
use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput};
use heightfield::{
    Extent, HeightField, MarchOptions, OutputSet, RayArray, Status, Technique, Wrap, march, oracle,
};
use rayon::prelude::*;

const SIZE: usize = 512;
const RAYS: usize = 1 << 16;
/// Points between true and reported hit that are looked at for a skipped surface.
const SAMPLES: u32 = 64;
const ELEVATIONS: [f64; 3] = [90.0, 45.0, 10.0];

/// SplitMix64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Octaves of smoothly interpolated value noise that tile; each is `roughness` times the last.
fn fractal(octaves: u32, roughness: f64) -> HeightField {
    let mut texels = vec![0.0_f64; SIZE * SIZE];
    let mut amplitude = 1.0;
    for octave in 0..octaves {
        let n = 4_usize << octave;
        let mut random = Random(u64::from(octave) + 1);
        let lattice: Vec<f64> = (0..n * n).map(|_| random.next()).collect();
        for (at, texel) in texels.iter_mut().enumerate() {
            let x = (at % SIZE) as f64 * n as f64 / SIZE as f64;
            let y = (at / SIZE) as f64 * n as f64 / SIZE as f64;
            let (i, j) = (x as usize, y as usize);
            let ease = |f: f64| f * f * (3.0 - 2.0 * f);
            let (fx, fy) = (ease(x.fract()), ease(y.fract()));
            let node = |a: usize, b: usize| lattice[(b % n) * n + a % n];
            let top = node(i, j) * (1.0 - fx) + node(i + 1, j) * fx;
            let bottom = node(i, j + 1) * (1.0 - fx) + node(i + 1, j + 1) * fx;
            *texel += amplitude * (top * (1.0 - fy) + bottom * fy);
        }
        amplitude *= roughness;
    }
    let low = texels.iter().copied().fold(f64::INFINITY, f64::min);
    let high = texels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let heights: Vec<f32> = texels.iter().map(|h| ((h - low) / (high - low)) as f32).collect();
    HeightField::new(&heights, SIZE, SIZE, Wrap::Repeat)
        .unwrap()
        .with_extent(Extent { scale: 0.1, ..Extent::default() })
        .unwrap()
}

/// Rays on the lid at one elevation in mesh units, random in place and azimuth.
fn rays(field: &HeightField, elevation: f64) -> (Vec<f32>, Vec<f32>) {
    let extent = field.extent();
    let mut random = Random(elevation.to_bits());
    let mut origins = Vec::with_capacity(3 * RAYS);
    let mut directions = Vec::with_capacity(3 * RAYS);
    let (sin, cos) = elevation.to_radians().sin_cos();
    for _ in 0..RAYS {
        let azimuth = std::f64::consts::TAU * random.next();
        origins.extend([random.next() as f32, random.next() as f32, 1.0]);
        directions.extend([
            (cos * azimuth.cos()) as f32 / extent.tile_size[0],
            (cos * azimuth.sin()) as f32 / extent.tile_size[1],
            -(sin as f32) / extent.scale,
        ]);
    }
    (origins, directions)
}

/// 99th percentile of the error in texels, and the share of rays that skipped the true first hit.
fn errors(field: &HeightField, technique: &Technique, origins: &[f32], directions: &[f32]) -> (f64, f64) {
    let hits = run(field, technique, origins, directions, OutputSet::T | OutputSet::STATUS);
    let (t, status) = (hits.t.unwrap(), hits.status.unwrap());
    let results: Vec<(f64, bool)> = (0..RAYS)
        .into_par_iter()
        .map(|i| {
            let (o, d) = (RayArray::F32(origins).get(i), RayArray::F32(directions).get(i));
            let truth = oracle::exact(field, o, d);
            assert_eq!((truth.status, status[i]), (Status::Hit, Status::Hit as u8));
            let late = f64::from(t[i]) - truth.t;
            // Late inside the same solid is inaccurate; out in the air again after it, a hit was skipped.
            let skipped = late > 0.0
                && (1..SAMPLES).any(|k| {
                    let t = truth.t + late * f64::from(k) / f64::from(SAMPLES);
                    let [u, v, z] = [0, 1, 2].map(|axis| o[axis] + t * d[axis]);
                    z - field.height_at(u, v) > 1e-6
                });
            (late.abs() * (d[0] * SIZE as f64).hypot(d[1] * SIZE as f64), skipped)
        })
        .collect();
    let missed = results.iter().filter(|(_, skipped)| *skipped).count() as f64 / RAYS as f64;
    let mut texels: Vec<f64> = results.into_iter().map(|(texels, _)| texels).collect();
    texels.sort_by(f64::total_cmp);
    (texels[RAYS * 99 / 100], missed)
}

fn run(
    field: &HeightField,
    technique: &Technique,
    origins: &[f32],
    directions: &[f32],
    outputs: OutputSet,
) -> heightfield::Hits {
    let options = MarchOptions { outputs, ..MarchOptions::default() };
    march(field, technique, RayArray::F32(origins), RayArray::F32(directions), &options).unwrap()
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(600))
        .configure_from_args();
    let table = RefCell::new(Vec::new());
    for (map, field) in [("smooth", fractal(4, 0.45)), ("rough", fractal(7, 0.7))] {
        field.pyramid();
        for elevation in ELEVATIONS {
            let (origins, directions) = rays(&field, elevation);
            let mut group = criterion.benchmark_group(format!("{map} {elevation} deg"));
            group.throughput(Throughput::Elements(RAYS as u64));
            for info in Technique::all() {
                let technique = Technique::named(info.name).unwrap();
                let (p99, missed) = errors(&field, &technique, &origins, &directions);
                let spent = RefCell::new((Duration::ZERO, 0));
                group.bench_function(BenchmarkId::from_parameter(technique), |bencher| {
                    bencher.iter_custom(|iterations| {
                        let begin = Instant::now();
                        for _ in 0..iterations {
                            black_box(run(&field, &technique, &origins, &directions, OutputSet::T));
                        }
                        let elapsed = begin.elapsed();
                        let mut spent = spent.borrow_mut();
                        spent.0 += elapsed;
                        spent.1 += iterations;
                        elapsed
                    });
                });
                let (elapsed, iterations) = spent.into_inner();
                if iterations > 0 {
                    let nanoseconds = elapsed.as_secs_f64() * 1e9 / (iterations as f64 * RAYS as f64);
                    table.borrow_mut().push((
                        map,
                        elevation,
                        technique.to_string(),
                        nanoseconds,
                        p99,
                        missed,
                    ));
                }
            }
            group.finish();
        }
    }
    criterion.final_summary();
    let threads = rayon::current_num_threads();
    println!("\n{SIZE} x {SIZE} texels, {RAYS} rays, {threads} threads");
    println!(
        "{:<7} {:>9} {:<42} {:>8} {:>10} {:>12} {:>9}",
        "map", "elevation", "technique", "ns/ray", "Mrays/s", "p99 texels", "missed %"
    );
    for (map, elevation, technique, nanoseconds, p99, missed) in table.into_inner() {
        println!(
            "{map:<7} {elevation:>9} {technique:<42} {nanoseconds:>8.1} {:>10.2} {p99:>12.5} {:>9.3}",
            1e3 / nanoseconds,
            100.0 * missed
        );
    }
}
