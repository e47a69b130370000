//! Ambient occlusion and bent normals against a plain sum over the sky, and closed forms.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use bake::{Convention, Kernel, Progress, ao_map, azimuth, bent_normal_map, normal_map};
use common::walk::horizon_sine;
use heightfield::{Extent, HeightField, Wrap};

fn field(texels: &[f32], size: [usize; 2], wrap: Wrap, scale: f32) -> HeightField {
    let extent = Extent { scale, ..Extent::default() };
    HeightField::new(texels, size[0], size[1], wrap).unwrap().with_extent(extent).unwrap()
}

fn ao(field: &HeightField, azimuths: usize) -> Vec<f32> {
    ao_map(field, azimuths, Kernel::Central, Progress::none()).unwrap()
}

fn bent(field: &HeightField, azimuths: usize) -> Vec<f32> {
    bent_normal_map(field, azimuths, Kernel::Central, Convention::OpenGl, Progress::none()).unwrap()
}

fn rough(n: usize) -> Vec<f32> {
    let noise = common::noise(n * n, 9);
    let at = |i: usize, j: usize| noise[j % n * n + i % n];
    let mean = |k: usize| {
        let (i, j) = (k % n, k / n);
        (at(i, j) + at(i + 1, j) + at(i, j + 1) + at(i + 1, j + 1)) / 4.0
    };
    (0..n * n).map(mean).collect()
}

/// Light and mean direction of an even sky at a texel: directions one by one, in `f64`.
fn sky(field: &HeightField, i: usize, j: usize, normal: [f64; 3], azimuths: usize) -> (f64, [f64; 3]) {
    const ELEVATIONS: usize = 400;
    let (mut light, mut mean) = (0.0, [0.0; 3]);
    for k in 0..azimuths {
        let [x, y] = azimuth(k, azimuths);
        let horizon = horizon_sine(field, i, j, [x, y], 1.5);
        for e in 0..ELEVATIONS {
            let (sin, cos) = ((e as f64 + 0.5) / ELEVATIONS as f64 * std::f64::consts::FRAC_PI_2).sin_cos();
            let direction = [x * cos, y * cos, sin];
            let facing: f64 = direction.iter().zip(normal).map(|(d, n)| d * n).sum();
            if sin > horizon && facing > 0.0 {
                light += facing * cos;
                mean = [0, 1, 2].map(|c| mean[c] + direction[c] * cos);
            }
        }
    }
    let weight = 2.0 / azimuths as f64 * std::f64::consts::FRAC_PI_2 / ELEVATIONS as f64;
    let length = mean.iter().map(|c| c * c).sum::<f64>().sqrt();
    (light * weight, mean.map(|c| c / length))
}

/// Measured: occlusion within 0.006, bent normals within 0.6 degrees.
#[test]
fn both_agree_with_a_sum_over_the_sky() {
    let n = 16;
    for wrap in [Wrap::Repeat, Wrap::Clamp] {
        let field = field(&rough(n), [n, n], wrap, 0.15);
        let normals = normal_map(&field, Kernel::Central, Convention::OpenGl, Progress::none()).unwrap();
        let (ao, bent) = (ao(&field, 16), bent(&field, 16));
        let vector = |map: &[f32], at: usize| [0, 1, 2].map(|c| f64::from(map[3 * at + c]));
        let mut bending: f64 = 0.0;
        for (at, &ao) in ao.iter().enumerate() {
            let (light, mean) = sky(&field, at % n, at / n, vector(&normals, at), 16);
            assert!((f64::from(ao) - light).abs() < 0.012, "{wrap:?} {at}: {ao} for {light}");
            let off = common::angle(vector(&bent, at), mean);
            assert!(off < 1.2, "{wrap:?} {at}: {off} degrees");
            bending = bending.max(common::angle(vector(&bent, at), vector(&normals, at)));
        }
        // The comparison would notice if bent normals were just normals.
        assert!(bending > 5.0, "{bending}");
    }
}

#[test]
fn an_open_plain_is_lit_in_full() {
    for azimuths in [1, 5, 32] {
        let flat = field(&[0.3; 20], [5, 4], Wrap::Repeat, 1.0);
        assert!(ao(&flat, azimuths).iter().all(|&ao| (ao - 1.0).abs() < 1e-6));
        let flat = field(&[0.3; 20], [5, 4], Wrap::Mirror, 1.0);
        if azimuths > 1 {
            for texel in bent(&flat, azimuths).chunks(3) {
                assert!((texel[2] - 1.0).abs() < 1e-6, "{texel:?}");
            }
        }
    }
}

/// On the middle of the floor of an endless trench, `half` away from walls of height `depth`, the sky's
/// share is `half / hypot(half, depth)`, by the view factor of a strip.
#[test]
fn a_trench_is_as_dark_as_the_view_factor_says() {
    let (w, h) = (128_usize, 64_usize);
    let (floor, half) = (32_usize, 6_usize);
    let texels: Vec<f32> =
        (0..w * h).map(|at| if (at / w).abs_diff(floor) < half { 0.0 } else { 1.0 }).collect();
    for depth in [0.02_f32, 0.05, 0.1] {
        let field = field(&texels, [w, h], Wrap::Repeat, depth);
        let expected = (half as f64 / h as f64) / (half as f64 / h as f64).hypot(f64::from(depth));
        let got = f64::from(ao(&field, 64)[floor * w + 7]);
        assert!((got - expected).abs() < 0.004, "depth {depth}: {got} for {expected}");
        // Open on both sides alike: the mean direction is straight up.
        let up = &bent(&field, 64)[3 * (floor * w + 7)..][..3];
        assert!(up[2] > 1.0 - 1e-5, "{up:?}");
    }
}

/// A slope that goes on for ever sees the part of the sky above its own plane and the level.
#[test]
fn a_bent_normal_leans_away_from_a_wall() {
    let n = 32;
    let texels: Vec<f32> = (0..n * n).map(|at| if at % n >= 16 { 1.0 } else { 0.0 }).collect();
    let field = field(&texels, [n, n], Wrap::Clamp, 0.3);
    let texel = 10 * n + 12;
    let map = bent(&field, 32);
    let [x, y, z] = [0, 1, 2].map(|c| map[3 * texel + c]);
    assert!(x < -0.2 && y.abs() < 1e-3 && z > 0.5, "{x} {y} {z}");
    let directx =
        bent_normal_map(&field, 32, Kernel::Central, Convention::DirectX, Progress::none()).unwrap();
    for (a, b) in map.chunks(3).zip(directx.chunks(3)) {
        assert_eq!([a[0], -a[1] + 0.0, a[2]], [b[0], b[1], b[2]]);
    }
}
