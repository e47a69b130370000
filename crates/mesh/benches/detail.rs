//! Normal maps of 1024 x 1024 texels from 524 288 triangles: waves on a square and a ball on a plainer ball.
//!
//! `cargo bench -p mesh --bench detail`. The least of some runs on the clock, and their mean of
//! all threads together. The same meshes go through Blender in `make bench-peers PEERS=blender_bake`.
#![allow(missing_docs, clippy::unwrap_used)]

use std::hint::black_box;
use std::time::Instant;

use mesh::{DetailOptions, Mesh, NormalSpace, bake_detail};

const SIDE: usize = 1024;
const RUNS: usize = 9;

fn main() {
    println!(
        "{SIDE} x {SIDE}, {} threads; milliseconds of the clock, the least of {RUNS} (of all threads, the mean)",
        rayon::current_num_threads()
    );
    let square = grid(1, 1, |u, v| [u, 1.0 - v, 0.0]);
    let waves = grid(512, 512, |u, v| [u, 1.0 - v, 0.03 * (37.0 * u).sin() * (29.0 * (1.0 - v)).cos()]);
    show("waves on a square", &square, &waves, NormalSpace::Tangent);
    show("ball on a ball", &ball(64, 32, 0.45), &ball(724, 362, 0.5), NormalSpace::Object);
}

fn ball(columns: usize, rows: usize, radius: f64) -> Mesh {
    use std::f64::consts::{PI, TAU};
    grid(columns, rows, |u, v| {
        let ((east, north), (sin, cos)) = ((TAU * u).sin_cos(), (PI * v).sin_cos());
        [sin * east, cos, sin * north].map(|x| radius * x)
    })
}

/// A grid over the map, v down, counter-clockwise seen from above.
fn grid(columns: usize, rows: usize, place: impl Fn(f64, f64) -> [f64; 3]) -> Mesh {
    let share = |i: usize, n: usize| i as f64 / n as f64;
    let corners: Vec<(f64, f64)> =
        (0..=rows).flat_map(|j| (0..=columns).map(move |i| (share(i, columns), share(j, rows)))).collect();
    let positions: Vec<[f32; 3]> = corners.iter().map(|&(u, v)| place(u, v).map(|x| x as f32)).collect();
    let uvs: Vec<[f32; 2]> = corners.iter().map(|&(u, v)| [u as f32, v as f32]).collect();
    let at = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
    let squares = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    let (lower, upper): (Vec<_>, Vec<_>) = squares
        .map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            ([a, b, c], [a, c, d])
        })
        .unzip();
    Mesh::from_arrays(&positions, &[lower, upper].concat(), &uvs, None, None).unwrap()
}

fn show(name: &str, plain: &Mesh, detail: &Mesh, space: NormalSpace) {
    let options = DetailOptions {
        width: SIDE,
        height: SIDE,
        front: Some(0.1),
        rear: Some(0.1),
        space,
        ..DetailOptions::default()
    };
    let mut clock = f64::INFINITY;
    let spent = cpu_seconds();
    for _ in 0..RUNS {
        let begin = Instant::now();
        let maps = black_box(bake_detail(plain, detail, None, &options, &mut |_, _| true).unwrap());
        clock = clock.min(begin.elapsed().as_secs_f64());
        // A ball's rays reach past its poles; nearly all others meet something.
        assert!(maps.report.missed < maps.report.rays / 50, "not timed: {:?}", maps.report);
    }
    println!("{name:<20} {:>7.1} ({:>5.1})", clock * 1e3, (cpu_seconds() - spent) * 1e3 / RUNS as f64);
}

/// Of all threads so far.
fn cpu_seconds() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}
