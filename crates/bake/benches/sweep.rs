//! Horizons, ambient occlusion and distances of 1024 x 1024 height fields, smooth and rough.

use std::hint::black_box;

use bake::{Kernel, Progress, ao_map, distance_map, horizon_map};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use heightfield::{HeightField, Wrap};

const SIDE: usize = 1024;
const AZIMUTHS: usize = 32;
const DEPTH: usize = 32;

/// Waves, and the same with every texel shaken.
fn fields() -> [(&'static str, HeightField); 2] {
    let wave = |i: usize, periods: f32| (i as f32 * periods * std::f32::consts::TAU / SIDE as f32).sin();
    let mut state = 1_u32;
    let mut noise = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let smooth: Vec<f32> = (0..SIDE * SIDE)
        .map(|at| 0.5 + 0.2 * wave(at % SIDE, 3.0) * wave(at / SIDE, 2.0) + 0.2 * wave(at / SIDE + at, 5.0))
        .collect();
    let rough: Vec<f32> = smooth.iter().map(|h| 0.7 * h + 0.3 * noise()).collect();
    [("smooth", smooth), ("rough", rough)].map(|(name, texels)| {
        match HeightField::new(&texels, SIDE, SIDE, Wrap::Repeat) {
            Ok(field) => (name, field),
            Err(error) => unreachable!("{error}"),
        }
    })
}

fn sweeps(criterion: &mut Criterion) {
    let fields = fields();
    let texels = (SIDE * SIDE) as u64;
    let mut group = criterion.benchmark_group("sweep_1024");
    group.sample_size(10);
    for (name, field) in &fields {
        let horizon = || horizon_map(field, AZIMUTHS, Progress::none()).unwrap_or_default();
        let first = horizon();
        assert!(first.len() == SIDE * SIDE * AZIMUTHS && first.iter().any(|&sine| sine > 0.1), "not timed");
        group.throughput(Throughput::Elements(texels * AZIMUTHS as u64));
        group.bench_function(format!("horizon/{name}"), |bencher| bencher.iter(|| black_box(horizon())));
        group.bench_function(format!("ao/{name}"), |bencher| {
            bencher.iter(|| black_box(ao_map(field, AZIMUTHS, Kernel::Sobel3, Progress::none())));
        });
        group.throughput(Throughput::Elements(texels * DEPTH as u64));
        group.bench_function(format!("distance/{name}"), |bencher| {
            bencher.iter(|| black_box(distance_map(field, DEPTH, Progress::none())));
        });
    }
    group.finish();
}

criterion_group!(benches, sweeps);
criterion_main!(benches);
