//! Slopes, normals and relief maps against closed forms and a plain reference.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::f64::consts::TAU;

use bake::{
    BakeError, Convention, Kernel, Progress, bake, maps::REGISTRY, normal_map, normal_xy, relief_map, slopes,
};
use common::noise;
use heightfield::{Extent, HeightField, HeightFieldError, Wrap};

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];

fn field(texels: &[f32], w: usize, h: usize, wrap: Wrap) -> HeightField {
    HeightField::new(texels, w, h, wrap).unwrap()
}

fn gradients(field: &HeightField, kernel: Kernel) -> Vec<[f32; 2]> {
    slopes(field, kernel, Progress::none()).unwrap()
}

fn normals(field: HeightField, extent: &Extent, kernel: Kernel, convention: Convention) -> Vec<f32> {
    let field = field.with_extent(*extent).unwrap();
    normal_map(&field, kernel, convention, Progress::none()).unwrap()
}

/// Taps from -2 to 2 of the derivative and the smoothing, as the kernel table gives them.
fn table(kernel: Kernel) -> ([f64; 5], [f64; 5]) {
    let central = [0.0, -0.5, 0.0, 0.5, 0.0];
    match kernel {
        Kernel::Forward => ([0.0, 0.0, -1.0, 1.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]),
        Kernel::Central => (central, [0.0, 0.0, 1.0, 0.0, 0.0]),
        Kernel::Sobel3 => (central, [0.0, 0.25, 0.5, 0.25, 0.0]),
        Kernel::Sobel5 => {
            ([-1.0, -2.0, 0.0, 2.0, 1.0].map(|t| t / 8.0), [1.0, 4.0, 6.0, 4.0, 1.0].map(|t| t / 16.0))
        }
        Kernel::Scharr => (central, [0.0, 3.0 / 16.0, 10.0 / 16.0, 3.0 / 16.0, 0.0]),
        Kernel::Prewitt => (central, [0.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 0.0]),
        Kernel::Bilinear => (central, [0.0, 0.125, 0.75, 0.125, 0.0]),
    }
}

#[test]
fn every_kernel_and_wrap_matches_the_plain_double_loop() {
    for (w, h) in [(1, 1), (1, 7), (6, 1), (2, 2), (3, 5), (17, 9), (40, 33)] {
        for wrap in WRAPS {
            let field = field(&noise(w * h, 7), w, h, wrap);
            for kernel in Kernel::ALL {
                let (derivative, smoothing) = table(kernel);
                for (at, found) in gradients(&field, kernel).iter().enumerate() {
                    let (i, j) = ((at % w) as i64, (at / w) as i64);
                    let mut expected = [0.0; 2];
                    for y in 0..5 {
                        for x in 0..5 {
                            let height = f64::from(field.texel(i + x as i64 - 2, j + y as i64 - 2));
                            expected[0] += derivative[x] * smoothing[y] * height * w as f64;
                            expected[1] += smoothing[x] * derivative[y] * height * h as f64;
                        }
                    }
                    for axis in 0..2 {
                        let error = (f64::from(found[axis]) - expected[axis]).abs();
                        assert!(
                            error < 1e-6 * (w.max(h) as f64),
                            "{kernel:?} {wrap:?} {w}x{h} at {at}: {error:e}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn a_plane_has_its_slope() {
    let (w, h) = (32, 24);
    // Steps are multiples of 2^-10: no rounding, so the slope must come out to the last bit or two.
    let texels: Vec<f32> = (0..w * h).map(|at| ((at % w) * 8 + (at / w) * 4 + 100) as f32 / 1024.0).collect();
    let field = field(&texels, w, h, Wrap::Clamp);
    for kernel in Kernel::ALL {
        for (at, [u, v]) in gradients(&field, kernel).into_iter().enumerate() {
            let (i, j) = (at % w, at / w);
            if (2..w - 2).contains(&i) && (2..h - 2).contains(&j) {
                assert!((u - 8.0 / 1024.0 * w as f32).abs() < 1e-5, "{kernel:?}");
                assert!((v - 4.0 / 1024.0 * h as f32).abs() < 1e-5, "{kernel:?}");
            }
        }
    }
}

#[test]
fn a_wave_is_damped_by_the_transfer_function_of_the_kernel() {
    let (w, h) = (60, 45);
    for (p, q) in [(1, 0), (0, 3), (5, 2), (7, -4), (14, 11)] {
        let (wx, wy) = (TAU * f64::from(p) / w as f64, TAU * f64::from(q) / h as f64);
        let texels: Vec<f32> = (0..w * h)
            .map(|at| (0.5 + 0.4 * (wx * (at % w) as f64 + wy * (at / w) as f64).sin()) as f32)
            .collect();
        let field = field(&texels, w, h, Wrap::Repeat);
        for kernel in Kernel::ALL {
            let (derivative, smoothing) = table(kernel);
            let pass =
                |omega: f64| (0..5).map(|k| smoothing[k] * (omega * (k as f64 - 2.0)).cos()).sum::<f64>();
            // Response to sin(phase): a cosine part and, for the one-sided kernel, a sine part.
            let response = |omega: f64, phase: f64| {
                (0..5).map(|k| derivative[k] * (phase + omega * (k as f64 - 2.0)).sin()).sum::<f64>()
            };
            for (at, [u, v]) in gradients(&field, kernel).into_iter().enumerate() {
                let phase = wx * (at % w) as f64 + wy * (at / w) as f64;
                let expected_u = 0.4 * w as f64 * response(wx, phase) * pass(wy);
                let expected_v = 0.4 * h as f64 * response(wy, phase) * pass(wx);
                assert!((f64::from(u) - expected_u).abs() < 2e-5, "{kernel:?} {p} {q}");
                assert!((f64::from(v) - expected_v).abs() < 2e-5, "{kernel:?} {p} {q}");
            }
        }
    }
}

#[test]
fn bilinear_is_the_mean_gradient_of_the_marched_surface() {
    let (w, h) = (9, 7);
    for wrap in WRAPS {
        let field = field(&noise(w * h, 3), w, h, wrap);
        for (at, found) in gradients(&field, Kernel::Bilinear).into_iter().enumerate() {
            // The gradient is linear in each quarter of the texel, so its centre gives the mean.
            let mut mean = [0.0; 2];
            for (x, y) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
                let u = ((at % w) as f64 + x) / w as f64;
                let v = ((at / w) as f64 + y) / h as f64;
                let gradient = field.gradient_at(u, v);
                mean[0] += gradient[0] / 4.0;
                mean[1] += gradient[1] / 4.0;
            }
            for axis in 0..2 {
                assert!((f64::from(found[axis]) - mean[axis]).abs() < 1e-5, "{wrap:?} texel {at}");
            }
        }
    }
}

#[test]
fn slopes_are_in_mesh_units_and_green_points_up() {
    // Rises 1 in u and 0.5 in v (downwards) over the tile.
    let (w, h) = (16, 8);
    let texels: Vec<f32> =
        (0..w * h).map(|at| ((at % w) as f32 / w as f32 + 0.5 * (at / w) as f32 / h as f32) * 0.5).collect();
    let field = || field(&texels, w, h, Wrap::Clamp);
    let extent = Extent { scale: 0.4, base: 1.0, tile_size: [2.0, 0.5] };
    let (x, y) = (-0.4 * 0.5 / 2.0, 0.4 * 0.25 / 0.5);
    let length = f64::sqrt(x * x + y * y + 1.0);
    for kernel in Kernel::ALL {
        for (convention, sign) in [(Convention::OpenGl, 1.0), (Convention::DirectX, -1.0)] {
            let map = normals(field(), &extent, kernel, convention);
            let texel = &map[(3 * w + 7) * 3..][..3];
            for (found, expected) in texel.iter().zip([x, sign * y, 1.0]) {
                assert!((f64::from(*found) - expected / length).abs() < 1e-6, "{kernel:?} {convention:?}");
            }
        }
    }
}

#[test]
fn a_mirrored_map_has_mirrored_normals_to_the_bit() {
    let (w, h) = (23, 14);
    let texels = noise(w * h, 11);
    let mirrored: Vec<f32> = (0..w * h).map(|at| texels[at / w * w + w - 1 - at % w]).collect();
    let flipped: Vec<f32> = (0..w * h).map(|at| texels[(h - 1 - at / w) * w + at % w]).collect();
    for wrap in WRAPS {
        for kernel in Kernel::ALL.into_iter().filter(|&kernel| kernel != Kernel::Forward) {
            let bake =
                |texels| normals(field(texels, w, h, wrap), &Extent::default(), kernel, Convention::OpenGl);
            let (plain, mirrored, flipped) = (bake(&texels), bake(&mirrored), bake(&flipped));
            for at in 0..w * h {
                let here = &plain[3 * at..][..3];
                let there = &mirrored[3 * (at / w * w + w - 1 - at % w)..][..3];
                assert_eq!(
                    [here[0], here[1], here[2]],
                    [-there[0], there[1], there[2]],
                    "{kernel:?} {wrap:?}"
                );
                let below = &flipped[3 * ((h - 1 - at / w) * w + at % w)..][..3];
                assert_eq!(
                    [here[0], here[1], here[2]],
                    [below[0], -below[1], below[2]],
                    "{kernel:?} {wrap:?}"
                );
            }
        }
    }
}

#[test]
fn a_turned_map_has_turned_normals() {
    // A quarter turn counter-clockwise: the texel at column i, row j goes to column j, row n-1-i.
    let n = 19;
    let texels = noise(n * n, 5);
    let mut turned = vec![0.0; n * n];
    for j in 0..n {
        for i in 0..n {
            turned[(n - 1 - i) * n + j] = texels[j * n + i];
        }
    }
    for wrap in WRAPS {
        for kernel in Kernel::ALL.into_iter().filter(|&kernel| kernel != Kernel::Forward) {
            let bake =
                |texels| normals(field(texels, n, n, wrap), &Extent::default(), kernel, Convention::OpenGl);
            let (plain, turned) = (bake(&texels), bake(&turned));
            for j in 0..n {
                for i in 0..n {
                    let here = &plain[3 * (j * n + i)..][..3];
                    let there = &turned[3 * ((n - 1 - i) * n + j)..][..3];
                    for (found, expected) in there.iter().zip([-here[1], here[0], here[2]]) {
                        assert!((found - expected).abs() < 1e-6, "{kernel:?} {wrap:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_repeating_map_has_no_seam() {
    let (w, h, dx, dy) = (21, 13, 8, 5);
    let texels = noise(w * h, 2);
    let rolled: Vec<f32> = (0..w * h).map(|at| texels[(at / w + dy) % h * w + (at % w + dx) % w]).collect();
    for kernel in Kernel::ALL {
        let bake = |texels| {
            normals(field(texels, w, h, Wrap::Repeat), &Extent::default(), kernel, Convention::OpenGl)
        };
        let (plain, rolled) = (bake(&texels), bake(&rolled));
        for at in 0..w * h {
            let from = (at / w + dy) % h * w + (at % w + dx) % w;
            assert_eq!(rolled[3 * at..][..3], plain[3 * from..][..3], "{kernel:?}");
        }
    }
}

#[test]
fn constant_maps_are_exactly_flat() {
    for wrap in WRAPS {
        for kernel in Kernel::ALL {
            let map = normals(field(&[0.3; 35], 7, 5, wrap), &Extent::default(), kernel, Convention::DirectX);
            for texel in map.chunks_exact(3) {
                assert_eq!(texel.iter().map(|c| c.to_bits()).collect::<Vec<_>>(), [0, 0, 1.0_f32.to_bits()]);
            }
        }
    }
}

#[test]
fn senseless_extents_are_refused_and_absurd_ones_stay_finite() {
    let field = || field(&noise(64, 1), 8, 8, Wrap::Repeat);
    for extent in [
        Extent { scale: f32::NAN, ..Extent::default() },
        Extent { scale: -1.0, ..Extent::default() },
        Extent { tile_size: [0.0, 1.0], ..Extent::default() },
    ] {
        assert!(matches!(field().with_extent(extent), Err(HeightFieldError::Extent { .. })));
    }
    for (scale, tile) in [(f32::MAX, f32::MIN_POSITIVE), (f32::MIN_POSITIVE, f32::MAX), (0.0, 1.0)] {
        let extent = Extent { scale, base: 0.0, tile_size: [tile; 2] };
        for texel in normals(field(), &extent, Kernel::Sobel5, Convention::OpenGl).chunks_exact(3) {
            let length = texel.iter().map(|c| c * c).sum::<f32>().sqrt();
            assert!((length - 1.0).abs() < 1e-6, "{scale} {tile}: {texel:?}");
        }
    }
}

#[test]
fn relief_and_xy_hold_the_same_normal() {
    let (w, h) = (13, 6);
    let texels = noise(w * h, 9);
    for wrap in WRAPS {
        let field = field(&texels, w, h, wrap);
        let (kernel, convention) = (Kernel::Scharr, Convention::DirectX);
        let normal = normal_map(&field, kernel, convention, Progress::none()).unwrap();
        let xy = normal_xy(&field, kernel, convention, Progress::none()).unwrap();
        let relief = relief_map(&field, kernel, convention, Progress::none()).unwrap();
        for at in 0..w * h {
            assert_eq!(xy[2 * at..][..2], normal[3 * at..][..2]);
            assert_eq!(relief[4 * at..][..3], normal[3 * at..][..3]);
            assert_eq!(relief[4 * at + 3], texels[at]);
        }
    }
}

#[test]
fn progress_rises_to_the_end_and_stops_on_request() {
    let field = field(&vec![0.5; 2048 * 1500], 2048, 1500, Wrap::Repeat);
    for map in REGISTRY.iter().copied().filter(|map| !map.info.costly) {
        let options = map.info.defaults();
        let mut seen = Vec::new();
        let mut note = |done, total| {
            seen.push((done, total));
            true
        };
        bake(&field, map, &options, Progress::new(&mut note)).unwrap();
        assert!(seen.windows(2).all(|pair| pair[0].0 <= pair[1].0), "{}: {seen:?}", map.info.name);
        assert!(seen.len() > 2 && seen.last() == Some(&(1500, 1500)), "{}: {seen:?}", map.info.name);
        let mut calls = 0;
        let mut stop = |_, _| {
            calls += 1;
            calls < 2
        };
        let result = bake(&field, map, &options, Progress::new(&mut stop));
        assert!(matches!(result, Err(BakeError::Interrupted)), "{}", map.info.name);
        assert_eq!(calls, 2, "{}", map.info.name);
    }
}
