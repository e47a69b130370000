//! Curvature against closed forms.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use bake::{Progress, curvature};
use common::noise;
use heightfield::{Extent, HeightField, Wrap};

/// Mean and Gaussian curvature of `f(x, y)`, `y` up, over a tile of that size, and where: `(x, y)`
/// from the tile's middle.
fn curvatures(
    [width, height]: [usize; 2],
    [wide, high]: [f64; 2],
    f: impl Fn(f64, f64) -> f64,
) -> Vec<([f64; 2], [f64; 2])> {
    let place = |i: usize, j: usize| {
        let x = ((i as f64 + 0.5) / width as f64 - 0.5) * wide;
        let y = (0.5 - (j as f64 + 0.5) / height as f64) * high;
        [x, y]
    };
    let values: Vec<f64> =
        (0..width * height).map(|at| place(at % width, at / width)).map(|[x, y]| f(x, y)).collect();
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let scale = values.iter().map(|v| v - low).fold(0.0, f64::max);
    let texels: Vec<f32> = values.iter().map(|v| ((v - low) / scale.max(1e-30)) as f32).collect();
    let extent = Extent { scale: scale as f32, base: 0.0, tile_size: [wide as f32, high as f32] };
    let field = HeightField::new(&texels, width, height, Wrap::Clamp).unwrap().with_extent(extent).unwrap();
    let map = curvature(&field, Progress::none()).unwrap();
    let mut found = Vec::new();
    for j in 1..height - 1 {
        for i in 1..width - 1 {
            let at = 2 * (j * width + i);
            found.push((place(i, j), [f64::from(map[at]), f64::from(map[at + 1])]));
        }
    }
    found
}

#[test]
fn a_sphere_cap_has_its_radius() {
    let radius = 2.0;
    let cap = |x: f64, y: f64| (radius * radius - x * x - y * y).sqrt();
    // Texels that are not square, a tile that is not either.
    for ([_, _], [mean, gaussian]) in curvatures([96, 64], [1.2, 1.0], cap) {
        assert!((mean - 1.0 / radius).abs() < 2e-3, "{mean}");
        assert!((gaussian - 1.0 / (radius * radius)).abs() < 2e-3, "{gaussian}");
    }
    // A bowl is negative, and its Gaussian curvature is the cap's.
    for (_, [mean, gaussian]) in curvatures([64, 64], [1.0, 1.0], |x, y| -cap(x, y)) {
        assert!((mean + 1.0 / radius).abs() < 2e-3 && gaussian > 0.24);
    }
}

#[test]
fn a_cylinder_bends_one_way() {
    // Its axis lies across the grid at 30 degrees.
    let (sin, cos) = 30.0_f64.to_radians().sin_cos();
    let radius = 1.5;
    let cylinder = |x: f64, y: f64| (radius * radius - (cos * x + sin * y).powi(2)).sqrt();
    for (_, [mean, gaussian]) in curvatures([80, 80], [1.0, 1.0], cylinder) {
        assert!((mean - 0.5 / radius).abs() < 2e-3, "{mean}");
        assert!(gaussian.abs() < 2e-3, "{gaussian}");
    }
}

#[test]
fn a_saddle_has_none_in_the_mean_and_a_negative_product() {
    // z = x y / a: K = -1 / (a^2 w^2), H = x y / (a^3 w^(3/2)) with bumps positive, w = 1 + (x^2 + y^2) / a^2.
    let a = 0.8;
    for ([x, y], [mean, gaussian]) in curvatures([64, 64], [1.0, 1.0], |x, y| x * y / a) {
        let w = 1.0 + (x * x + y * y) / (a * a);
        assert!((gaussian + 1.0 / (a * a * w * w)).abs() < 3e-3, "{gaussian}");
        assert!((mean - x * y / (a * a * a * w.powf(1.5))).abs() < 3e-3, "{mean}");
    }
}

#[test]
fn a_plane_has_none() {
    for (_, [mean, gaussian]) in curvatures([40, 30], [1.0, 2.0], |x, y| 0.3 * x - 0.2 * y) {
        assert!(mean.abs() < 1e-3 && gaussian.abs() < 1e-3, "{mean} {gaussian}");
    }
    let flat = HeightField::new(&[0.5; 12], 4, 3, Wrap::Repeat).unwrap();
    assert!(curvature(&flat, Progress::none()).unwrap().iter().all(|&v| v == 0.0));
}

#[test]
fn a_wrong_scale_is_noticed() {
    // Negative control: the radius seen with texels taken for 10 % larger ones.
    let cap = |x: f64, y: f64| (4.0 - x * x - y * y).sqrt();
    let worst = curvatures([64, 64], [1.1, 1.1], |x, y| cap(x / 1.1, y / 1.1))
        .iter()
        .map(|(_, [mean, _])| (mean - 0.5).abs())
        .fold(0.0, f64::max);
    assert!(worst > 0.05);
}

#[test]
fn every_size_and_wrap_is_the_same_surface_seen_from_its_neighbours() {
    for (w, h) in [(1, 1), (1, 7), (6, 1), (2, 2), (5, 4)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let field = HeightField::new(&noise(w * h, 3), w, h, wrap).unwrap();
            let map = curvature(&field, Progress::none()).unwrap();
            let scale = f64::from(field.extent().scale);
            for (at, found) in map.chunks_exact(2).enumerate() {
                let (i, j) = ((at % w) as i64, (at / w) as i64);
                let z = |x, y| scale * f64::from(field.texel(i + x, j + y));
                let (fw, fh) = (w as f64, h as f64);
                let p = fw * (z(1, 0) - z(-1, 0)) / 2.0;
                let q = fh * (z(0, 1) - z(0, -1)) / 2.0;
                let r = fw * fw * (z(1, 0) - 2.0 * z(0, 0) + z(-1, 0));
                let t = fh * fh * (z(0, 1) - 2.0 * z(0, 0) + z(0, -1));
                let s = fw * fh * (z(1, 1) - z(-1, 1) - z(1, -1) + z(-1, -1)) / 4.0;
                let w2 = 1.0 + p * p + q * q;
                let gaussian = (r * t - s * s) / (w2 * w2);
                let trace = (1.0 + q * q) * r - 2.0 * p * q * s + (1.0 + p * p) * t;
                let mean = -trace / (2.0 * w2.powf(1.5));
                let close = |a: f32, b: f64| (f64::from(a) - b).abs() < 1e-5 * (1.0 + b.abs());
                assert!(close(found[0], mean) && close(found[1], gaussian), "{w}x{h} {wrap:?} {at}");
            }
        }
    }
}

#[test]
fn a_senseless_scale_gives_numbers() {
    let extent = Extent { scale: f32::MAX, base: 0.0, tile_size: [f32::MIN_POSITIVE; 2] };
    let field = HeightField::new(&noise(64, 1), 8, 8, Wrap::Repeat).unwrap().with_extent(extent).unwrap();
    assert!(curvature(&field, Progress::none()).unwrap().iter().all(|v| v.is_finite()));
}
