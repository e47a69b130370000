//! Mip chains, LEAN moments and Toksvig roughness against direct averages and closed forms.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::f64::consts::TAU;

use bake::{
    BakeError, Convention, Kernel, Layer, NormalLength, Progress, covariance, half_vector_density, mip_chain,
    mip_sizes, moments, normal_map, normal_mips, toksvig_roughness,
};
use common::noise;
use heightfield::{Extent, HeightField, Wrap};

const SIZES: [[usize; 2]; 9] =
    [[1, 1], [1, 9], [13, 1], [2, 2], [5, 3], [16, 16], [17, 33], [24, 10], [31, 8]];

/// The mean over the area of texel `(i, j)` of `size`, texel by texel in `f64`.
fn area_mean(
    texels: &[f32],
    channels: usize,
    channel: usize,
    from: [usize; 2],
    size: [usize; 2],
    at: [usize; 2],
) -> f64 {
    let overlap = |axis: usize, texel: usize| {
        let (n, m) = (from[axis] as f64, size[axis] as f64);
        let (low, high) = (at[axis] as f64 * n / m, (at[axis] + 1) as f64 * n / m);
        (high.min(texel as f64 + 1.0) - low.max(texel as f64)).max(0.0) * m / n
    };
    let mut sum = 0.0;
    for j in 0..from[1] {
        for i in 0..from[0] {
            sum += overlap(0, i) * overlap(1, j) * f64::from(texels[(j * from[0] + i) * channels + channel]);
        }
    }
    sum
}

#[test]
fn every_level_is_the_area_mean_of_the_finest() {
    for [w, h] in SIZES {
        let texels = noise(w * h * 2, 5);
        let layers = mip_chain(texels.clone(), w, h, 2, Progress::none()).unwrap();
        assert_eq!(layers.iter().map(|l| [l.width, l.height]).collect::<Vec<_>>(), mip_sizes(w, h));
        assert_eq!(layers[0].texels, texels);
        let last = layers.last().unwrap();
        assert_eq!([last.width, last.height], [1, 1]);
        for layer in &layers {
            for j in 0..layer.height {
                for i in 0..layer.width {
                    for channel in 0..2 {
                        let expected =
                            area_mean(&texels, 2, channel, [w, h], [layer.width, layer.height], [i, j]);
                        let found = f64::from(layer.texels[(j * layer.width + i) * 2 + channel]);
                        assert!(
                            (found - expected).abs() < 1e-6,
                            "{w}x{h} -> {}x{}",
                            layer.width,
                            layer.height
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn the_usual_reduction_is_told_apart() {
    // Negative control: pairs, the odd texel dropped.
    let layers = mip_chain(vec![0.0, 0.0, 1.0], 3, 1, 1, Progress::none()).unwrap();
    assert!((layers[1].texels[0] - 1.0 / 3.0).abs() < 1e-7);
}

#[test]
fn sizes_halve_and_round_down() {
    assert_eq!(mip_sizes(5, 1), [[5, 1], [2, 1], [1, 1]]);
    assert_eq!(mip_sizes(3, 16), [[3, 16], [1, 8], [1, 4], [1, 2], [1, 1]]);
    assert_eq!(mip_sizes(1, 1), [[1, 1]]);
    for (w, h, n) in [(0, 4, 0), (2, 2, 3), (usize::MAX, 2, 4)] {
        let error = mip_chain(vec![0.0; n], w, h, 1, Progress::none()).unwrap_err();
        assert!(matches!(error, BakeError::Shape { .. }), "{error}");
    }
}

fn rough(w: usize, h: usize, scale: f32) -> HeightField {
    let extent = Extent { scale, base: 0.5, tile_size: [1.0, 1.5] };
    HeightField::new(&noise(w * h, 9), w, h, Wrap::Repeat).unwrap().with_extent(extent).unwrap()
}

fn length(normal: &[f32]) -> f64 {
    normal.iter().map(|&c| f64::from(c).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn normals_keep_their_mean_or_their_length() {
    for [w, h] in SIZES {
        let field = rough(w, h, 0.1);
        let normals = normal_map(&field, Kernel::Central, Convention::OpenGl, Progress::none()).unwrap();
        let mean = normal_mips(normals.clone(), w, h, NormalLength::Mean, Progress::none()).unwrap();
        let unit = normal_mips(normals.clone(), w, h, NormalLength::Unit, Progress::none()).unwrap();
        for (mean, unit) in mean.iter().zip(&unit) {
            for (at, (m, u)) in mean.texels.chunks_exact(3).zip(unit.texels.chunks_exact(3)).enumerate() {
                let (i, j) = (at % mean.width, at / mean.width);
                for (c, &found) in m.iter().enumerate() {
                    let expected = area_mean(&normals, 3, c, [w, h], [mean.width, mean.height], [i, j]);
                    assert!((f64::from(found) - expected).abs() < 1e-6);
                }
                assert!(length(m) < 1.0 + 1e-6);
                assert!((length(u) - 1.0).abs() < 1e-6);
                let dot: f64 = m.iter().zip(u).map(|(a, b)| f64::from(a * b)).sum();
                assert!((dot - length(m)).abs() < 1e-6, "same direction");
            }
        }
    }
}

#[test]
fn opposite_normals_point_out() {
    let layers = normal_mips(vec![1.0, 0.0, 0.0, -1.0, 0.0, 0.0], 2, 1, NormalLength::Unit, Progress::none());
    assert_eq!(layers.unwrap()[1].texels, [0.0, 0.0, 1.0]);
}

fn moment_layers(field: &HeightField) -> Vec<Layer> {
    moments(field, Kernel::Sobel3, Convention::OpenGl, Progress::none()).unwrap()
}

fn five(texel: &[f32]) -> [f32; 5] {
    texel.try_into().unwrap()
}

#[test]
fn moments_are_those_of_the_normals_below() {
    for [w, h] in SIZES {
        let field = rough(w, h, 0.05);
        let normals = normal_map(&field, Kernel::Sobel3, Convention::OpenGl, Progress::none()).unwrap();
        let slopes: Vec<[f64; 2]> = normals
            .chunks_exact(3)
            .map(|n| [f64::from(n[0]) / f64::from(n[2]), f64::from(n[1]) / f64::from(n[2])])
            .collect();
        let products: Vec<f32> =
            slopes.iter().flat_map(|&[x, y]| [x, y, x * x, x * y, y * y].map(|v| v as f32)).collect();
        for layer in moment_layers(&field) {
            for (at, found) in layer.texels.chunks_exact(5).enumerate() {
                let (i, j) = (at % layer.width, at / layer.width);
                for (channel, &found) in found.iter().enumerate() {
                    let size = [layer.width, layer.height];
                    let expected = area_mean(&products, 5, channel, [w, h], size, [i, j]);
                    let close = (f64::from(found) - expected).abs() < 1e-5 * (1.0 + expected.abs());
                    assert!(close, "{w}x{h} channel {channel}: {found} {expected}");
                }
                let [xx, xy, yy] = covariance(five(found));
                assert!(
                    xx >= 0.0 && yy >= 0.0 && xy * xy <= xx * yy + 1e-4 * (1.0 + xx * yy),
                    "{xx} {yy} {xy}"
                );
            }
        }
    }
}

#[test]
fn a_sine_has_its_variance() {
    // h = sin(2 pi u) / 2 + 1/2: slope variance of the whole tile is (pi S)^2 / 2, and none across.
    let n = 256;
    let texels: Vec<f32> =
        (0..n * n).map(|at| (0.5 + 0.5 * (TAU * ((at % n) as f64 + 0.5) / n as f64).sin()) as f32).collect();
    let extent = Extent { scale: 0.1, base: 0.0, tile_size: [1.0, 1.0] };
    let field = HeightField::new(&texels, n, n, Wrap::Repeat).unwrap().with_extent(extent).unwrap();
    let layers = moment_layers(&field);
    let [xx, xy, yy] = covariance(five(&layers.last().unwrap().texels));
    let expected = (std::f64::consts::PI * 0.1_f64).powi(2) / 2.0;
    assert!((xx - expected).abs() < 1e-4 && yy < 1e-9 && xy.abs() < 1e-9, "{xx} {expected}");
    // Level 0 has no spread of its own.
    assert!(layers[0].texels.chunks_exact(5).all(|t| covariance(five(t))[0] < 1e-6));
}

#[test]
fn half_vectors_cover_the_projected_hemisphere_once() {
    // Midpoint rule over the hemisphere of D(h) hz.
    let integral = |density: &dyn Fn([f64; 3]) -> f64| {
        let (rings, sectors) = (600, 600);
        let mut sum = 0.0;
        for ring in 0..rings {
            // Rings of equal solid angle.
            let z = (ring as f64 + 0.5) / rings as f64;
            let r = (1.0 - z * z).sqrt();
            for sector in 0..sectors {
                let (sin, cos) = (TAU * (sector as f64 + 0.5) / sectors as f64).sin_cos();
                sum += density([r * cos, r * sin, z]) * z;
            }
        }
        sum * TAU / (rings * sectors) as f64
    };
    for (mean, covariance) in
        [([0.0, 0.0], [0.1, 0.0, 0.1]), ([0.3, -0.2], [0.2, 0.05, 0.1]), ([-0.5, 0.1], [0.5, -0.2, 0.3])]
    {
        let found = integral(&|h| half_vector_density(mean, covariance, h));
        assert!((found - 1.0).abs() < 2e-3, "{found}");
        // Negative control: the Gaussian of slopes alone, without the powers of hz.
        let printed = integral(&|h| half_vector_density(mean, covariance, h) * h[2].powi(4));
        assert!((printed - 1.0).abs() > 0.1, "{printed}");
    }
    assert_eq!(half_vector_density([0.0; 2], [0.1, 0.0, 0.1], [0.0, 0.6, -0.8]), 0.0);
    // Beckmann's distribution is the case without relief: exp(-tan^2 / alpha^2) / (pi alpha^2 cos^4).
    let (alpha, z) = (0.3_f64, 0.9_f64);
    let tan2 = (1.0 - z * z) / (z * z);
    let beckmann = (-tan2 / (alpha * alpha)).exp() / (std::f64::consts::PI * alpha * alpha * z.powi(4));
    let variance = alpha * alpha / 2.0;
    let found = half_vector_density([0.0; 2], [variance, 0.0, variance], [(1.0 - z * z).sqrt(), 0.0, z]);
    assert!((found / beckmann - 1.0).abs() < 1e-12);
}

#[test]
fn toksvig_adds_the_variance_of_the_normals() {
    let alpha = 0.1_f64;
    let field = rough(64, 64, 0.002);
    let layers = toksvig_roughness(&field, Kernel::Sobel3, alpha as f32, Progress::none()).unwrap();
    assert!(layers[0].texels.iter().all(|&a| a == 0.1));
    // Gentle relief: 1 / exponent grows by half the trace of the LEAN covariance.
    let top = f64::from(layers.last().unwrap().texels[0]);
    let lean = moment_layers(&field);
    let [xx, _, yy] = covariance(five(&lean.last().unwrap().texels));
    let inverse_exponent = |alpha: f64| alpha * alpha / (2.0 - 2.0 * alpha * alpha);
    let added = inverse_exponent(top) - inverse_exponent(alpha);
    let expected = 0.5 * (xx + yy);
    assert!((added / expected - 1.0).abs() < 0.05, "{added} {expected}");
    // A mirror gets rough as well; the roughest stays.
    let ends = |alpha: f32| toksvig_roughness(&field, Kernel::Sobel3, alpha, Progress::none()).unwrap();
    assert!(ends(0.0).last().unwrap().texels[0] > 0.0);
    assert!(ends(1.0).iter().flat_map(|layer| &layer.texels).all(|&a| a == 1.0));
    for layer in ends(0.0) {
        assert!(layer.texels.iter().all(|a| (0.0..=1.0).contains(a)));
    }
}
