//! Heights from normals: closed forms, the way there and back, real materials, and fields without heights.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::f64::consts::TAU;

use bake::encode::{Depth, Range, decode, encode};
use bake::repair::{Derivative, Integrated, Reading, integrate};
use bake::{BakeError, Convention, Kernel, Progress, normal_map};
use common::{data_image, noise};
use heightfield::{Extent, HeightField, Wrap};

const SOBEL: Derivative = Derivative::Kernel(Kernel::Sobel3);

fn reading(wrap: Wrap, derivative: Derivative) -> Reading {
    Reading { convention: Convention::OpenGl, wrap, tile_size: [1.0, 1.0], derivative, steepest: 100.0 }
}

fn integrated(normals: &[f32], [w, h]: [usize; 2], reading: &Reading) -> Integrated {
    integrate(normals, w, h, reading, Progress::none()).unwrap()
}

/// The normal, OpenGL, of slopes `p` along x and `q` along y downwards.
fn normal(p: f64, q: f64) -> [f32; 3] {
    let length = (p * p + q * q + 1.0).sqrt();
    [-p / length, q / length, 1.0 / length].map(|c| c as f32)
}

/// Root mean square of the difference, but for its mean, over the range of `truth`.
fn error(found: &Integrated, truth: &[f64]) -> f64 {
    let n = truth.len() as f64;
    let low = truth.iter().copied().fold(f64::INFINITY, f64::min);
    let range = truth.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low;
    let heights = || found.heights.iter().map(|&h| f64::from(h) * f64::from(found.scale));
    let mean = heights().zip(truth).map(|(a, b)| a - b).sum::<f64>() / n;
    let square = heights().zip(truth).map(|(a, b)| (a - b - mean).powi(2)).sum::<f64>() / n;
    square.sqrt() / range
}

#[test]
fn a_wave_comes_back_from_its_true_slopes() {
    // Texels are not square, sizes odd and even; the tile is 2 x 0.5.
    for [w, h] in [[64, 48], [63, 50], [45, 35], [128, 1]] {
        let z = |u: f64, v: f64| 0.1 * (TAU * 2.0 * u).sin() + 0.05 * (TAU * (u + v)).cos();
        let place = |at: usize| (((at % w) as f64 + 0.5) / w as f64, ((at / w) as f64 + 0.5) / h as f64);
        let flat = if h == 1 { 0.0 } else { 1.0 };
        let truth: Vec<f64> = (0..w * h).map(place).map(|(u, v)| z(u, v * flat)).collect();
        let normals: Vec<f32> = (0..w * h)
            .map(place)
            .flat_map(|(u, v)| {
                let both = -0.05 * TAU * (TAU * (u + v * flat)).sin();
                normal((0.1 * TAU * 2.0 * (TAU * 2.0 * u).cos() + both) / 2.0, both * flat / 0.5)
            })
            .collect();
        let tiled = Reading { tile_size: [2.0, 0.5], ..reading(Wrap::Repeat, Derivative::Spectral) };
        let found = integrated(&normals, [w, h], &tiled);
        let wrong = error(&found, &truth);
        assert!(wrong < 1e-3, "{w}x{h}: {wrong}");
        assert!(found.residual < 1e-5 && found.mean_error < 0.1 && found.clipped == 0);
        // Negative control: green read the wrong way.
        let green = Reading { convention: Convention::DirectX, ..tiled };
        let upside = integrated(&normals, [w, h], &green);
        assert!(h == 1 || (upside.residual > 0.3 && error(&upside, &truth) > 0.05));
    }
}

#[test]
fn free_edges_take_a_plane_and_a_cap() {
    // Neither repeats, and neither is flat at its edges.
    let [w, h] = [80, 61];
    let place =
        |at: usize| (((at % w) as f64 + 0.5) / w as f64 - 0.5, ((at / w) as f64 + 0.5) / h as f64 - 0.5);
    let plane: Vec<f64> = (0..w * h).map(place).map(|(x, y)| 0.3 * x - 0.2 * y).collect();
    let normals: Vec<f32> = (0..w * h).flat_map(|_| normal(0.3, -0.2)).collect();
    let cap = |x: f64, y: f64| (1.0 - x * x - y * y).sqrt();
    let caps: Vec<f64> = (0..w * h).map(place).map(|(x, y)| cap(x, y)).collect();
    let cap_normals: Vec<f32> =
        (0..w * h).map(place).flat_map(|(x, y)| normal(-x / cap(x, y), -y / cap(x, y))).collect();
    for wrap in [Wrap::Clamp, Wrap::Mirror] {
        let found = integrated(&normals, [w, h], &reading(wrap, SOBEL));
        assert!(error(&found, &plane) < 1e-4, "{}", error(&found, &plane));
        assert!((found.mean_slope[0] - 0.3).abs() < 1e-5 && (found.mean_slope[1] + 0.2).abs() < 1e-5);
        assert!(found.residual < 1e-4);
        let found = integrated(&cap_normals, [w, h], &reading(wrap, SOBEL));
        assert!(error(&found, &caps) < 2e-3, "{}", error(&found, &caps));
    }
    // Repeating, a plane has no heights: all of it is the mean slope.
    let found = integrated(&normals, [w, h], &reading(Wrap::Repeat, SOBEL));
    assert!((found.mean_slope[0] - 0.3).abs() < 1e-5 && f64::from(found.scale) < 1e-4);
}

fn smooth_noise(w: usize, h: usize, seed: u64) -> Vec<f32> {
    // A few waves with random phases, and a little of everything.
    let phases = noise(24, seed);
    let rough = noise(w * h, seed + 1);
    (0..w * h)
        .map(|at| {
            let (u, v) = ((at % w) as f64 / w as f64, (at / w) as f64 / h as f64);
            let waves: f64 = (0..12)
                .map(|k| {
                    let (fx, fy) = ((k % 4) as f64, (k / 4) as f64);
                    let phase = f64::from(phases[k]);
                    (TAU * (fx * u + fy * v + phase)).sin() / (1.0 + fx + fy)
                })
                .sum();
            (0.5 + 0.08 * waves + 0.01 * (f64::from(rough[at]) - 0.5)) as f32
        })
        .collect()
}

#[test]
fn a_bake_is_undone() {
    for [w, h] in [[64, 64], [57, 90], [31, 40]] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let extent = Extent { scale: 0.2, base: 0.0, tile_size: [1.5, 1.0] };
            let texels = smooth_noise(w, h, 3);
            let field = HeightField::new(&texels, w, h, wrap).unwrap().with_extent(extent).unwrap();
            let truth: Vec<f64> = texels.iter().map(|&t| 0.2 * f64::from(t)).collect();
            for convention in [Convention::OpenGl, Convention::DirectX] {
                let normals = normal_map(&field, Kernel::Sobel3, convention, Progress::none()).unwrap();
                let how = Reading { convention, tile_size: [1.5, 1.0], ..reading(wrap, SOBEL) };
                let found = integrated(&normals, [w, h], &how);
                let wrong = error(&found, &truth);
                assert!(wrong < 0.012, "{w}x{h} {wrap:?}: {wrong}");
                assert!(
                    found.residual < 0.01 && found.mean_error < 0.5,
                    "{} {}",
                    found.residual,
                    found.mean_error
                );
                // Bytes of 8 bits cost little.
                let signed = [Range::SIGNED; 3];
                let bytes = decode(&encode(&normals, &signed, Depth::U8), &signed);
                let found = integrated(&bytes, [w, h], &how);
                assert!(error(&found, &truth) < 0.015, "{}", error(&found, &truth));
            }
        }
    }
}

#[test]
fn a_field_without_heights_says_so() {
    // Slopes that turn in a circle: p = -dA/dy, q = dA/dx of a potential A have no surface at all.
    let n = 64;
    let whirl: Vec<f32> = (0..n * n)
        .flat_map(|at| {
            let (u, v) = (TAU * (at % n) as f64 / n as f64, TAU * (at / n) as f64 / n as f64);
            normal(-0.5 * u.sin() * v.cos(), 0.5 * u.cos() * v.sin())
        })
        .collect();
    let found = integrated(&whirl, [n, n], &reading(Wrap::Repeat, SOBEL));
    assert!(found.residual > 0.999 && found.mean_error > 10.0, "{} {}", found.residual, found.mean_error);
    assert!(found.scale < 1e-3);
    // Half of it heights: half of it left.
    let half: Vec<f32> = (0..n * n)
        .flat_map(|at| {
            let (u, v) = (TAU * (at % n) as f64 / n as f64, TAU * (at / n) as f64 / n as f64);
            let whirl = [-0.1 * u.sin() * v.cos(), 0.1 * u.cos() * v.sin()];
            normal(whirl[0] + 0.1 * u.cos() * v.sin(), whirl[1] + 0.1 * u.sin() * v.cos())
        })
        .collect();
    let found = integrated(&half, [n, n], &reading(Wrap::Repeat, Derivative::Spectral));
    assert!((found.residual - 0.5).abs() < 0.01, "{}", found.residual);
}

#[test]
fn odd_normals_are_laid_back_and_counted() {
    // Pointing in, lying flat, of no length, and far from unit length: never a NaN.
    let mut normals: Vec<f32> = (0..64).flat_map(|_| [0.0, 0.0, 1.0]).collect();
    for (at, odd) in [[1.0, 0.0, 0.0], [0.1, 0.1, -0.5], [0.0; 3], [0.0, 0.0, -1.0]].into_iter().enumerate() {
        normals[30 * (at + 1)..30 * (at + 1) + 3].copy_from_slice(&odd);
    }
    for wrap in [Wrap::Repeat, Wrap::Clamp] {
        let found = integrated(&normals, [8, 8], &reading(wrap, SOBEL));
        assert_eq!(found.clipped, 3);
        assert!(found.heights.iter().all(|h| (0.0..=1.0).contains(h)) && found.scale.is_finite());
    }
    let long: Vec<f32> = (0..64).flat_map(|_| normal(0.2, 0.1).map(|c| 7.0 * c)).collect();
    assert!((integrated(&long, [8, 8], &reading(Wrap::Clamp, SOBEL)).mean_slope[0] - 0.2).abs() < 1e-5);
}

#[test]
fn every_size_works_and_wrong_ones_are_refused() {
    for size in [[1, 1], [1, 5], [7, 1], [2, 2], [3, 11]] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let normals: Vec<f32> = noise(size[0] * size[1] * 3, 6).iter().map(|c| c - 0.3).collect();
            for derivative in Derivative::NAMES {
                let found =
                    integrated(&normals, size, &reading(wrap, Derivative::named(derivative).unwrap()));
                assert!(found.heights.iter().all(|h| (0.0..=1.0).contains(h)));
            }
        }
    }
    for (w, h, n) in [(2, 2, 11), (0, 1, 0), (usize::MAX, 2, 6)] {
        let refused = integrate(&vec![0.5; n], w, h, &reading(Wrap::Repeat, SOBEL), Progress::none());
        assert!(matches!(refused, Err(BakeError::Shape { .. })));
    }
    assert!(Derivative::named("forward").unwrap_err().to_string().contains("scharr"));
}

#[test]
fn real_materials_come_back() {
    // Bake the normals of a real height map in 8 bits, integrate, and look how far off the heights are.
    for (file, scale, most) in [
        ("ambientcg/rock058/displacement.jpg", 0.04, 0.01),
        ("bevy/parallax_example/cube_depth.png", 0.05, 0.01),
        ("playcanvas/seaside-rocks01-height.jpg", 0.012, 0.03),
        ("panda3d/layingrock-h.jpg", 0.14, 0.01),
    ] {
        let Some(image) = data_image(file) else { continue };
        let texels = image.channel_f32(0).unwrap();
        let (w, h) = (image.width, image.height);
        let extent = Extent { scale, ..Extent::default() };
        let field = HeightField::new(&texels, w, h, Wrap::Repeat).unwrap().with_extent(extent).unwrap();
        let normals = normal_map(&field, Kernel::Sobel3, Convention::OpenGl, Progress::none()).unwrap();
        let signed = [Range::SIGNED; 3];
        let bytes = decode(&encode(&normals, &signed, Depth::U8), &signed);
        let found = integrated(&bytes, [w, h], &reading(Wrap::Repeat, SOBEL));
        let truth: Vec<f64> = texels.iter().map(|&t| f64::from(t) * f64::from(scale)).collect();
        let wrong = error(&found, &truth);
        println!(
            "{file}: rms {:.3} % of the range, {:.3} degrees, residual {:.2e}",
            100.0 * wrong,
            found.mean_error,
            found.residual
        );
        assert!(wrong < most, "{file}: {wrong}");
    }
}
