//! Normal map of a 4096 x 4096 height field, by kernel.

use std::hint::black_box;

use bake::encode::Depth;
use bake::maps::{Map, bake_encoded};
use bake::{Convention, Kernel, Progress, normal_map};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use heightfield::{Extent, HeightField, Wrap};
use rayon::prelude::*;

const SIDE: usize = 4096;

/// Sines along both axes: every texel differs from its neighbours and the normal is known.
fn waves() -> HeightField {
    let wave = |i: usize, periods: f32| (i as f32 * periods * std::f32::consts::TAU / SIDE as f32).sin();
    let texels: Vec<f32> = (0..SIDE * SIDE)
        .map(|at| 0.5 + 0.25 * wave(at % SIDE, 31.0) + 0.25 * wave(at / SIDE, 17.0))
        .collect();
    let extent = Extent { scale: 0.01, ..Extent::default() };
    match HeightField::new(&texels, SIDE, SIDE, Wrap::Repeat).and_then(|field| field.with_extent(extent)) {
        Ok(field) => field,
        Err(error) => unreachable!("{error}"),
    }
}

fn normals(criterion: &mut Criterion) {
    let field = waves();
    let bake = |kernel| normal_map(&field, kernel, Convention::OpenGl, Progress::none()).unwrap_or_default();
    let map = bake(Kernel::Central);
    let slope = 0.01 * 0.25 * 31.0 * std::f32::consts::TAU;
    assert!((-map[0] / map[2] - slope).abs() < 1e-3 * slope, "wrong result: do not time it");
    let mut group = criterion.benchmark_group("normal_4096");
    group.throughput(Throughput::Elements((SIDE * SIDE) as u64)).sample_size(10);
    // What the memory alone costs: the same fresh output, written once from as many threads.
    group.bench_function("memory_only", |bencher| {
        bencher.iter(|| {
            let mut map = vec![0.0_f32; SIDE * SIDE * 3];
            map.par_chunks_mut(SIDE * 3).for_each(|row| row.fill(1.0));
            black_box(map)
        });
    });
    for kernel in Kernel::ALL {
        group.bench_function(kernel.name(), |bencher| bencher.iter(|| black_box(bake(kernel))));
    }
    let Ok(normal) = Map::named("normal") else { unreachable!("normal is a map") };
    let options = normal.info.defaults();
    for (name, depth) in [("rgb8", Depth::U8), ("rgb16", Depth::U16)] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| black_box(bake_encoded(&field, normal, &options, depth, Progress::none())));
        });
    }
    group.finish();
}

criterion_group!(benches, normals);
criterion_main!(benches);
