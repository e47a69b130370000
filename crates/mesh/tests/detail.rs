//! Baking from a detailed mesh, against closed forms.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::needless_range_loop)]

mod common;

use common::bakes::{Map, Sheet, UnitSheet, angle, bake, decoded, object, sheet, texel_centre};
use glam::{DVec2, DVec3, Vec3};
use mesh::{DetailOptions, Mesh, MeshError, NormalSpace, SkyOptions, bake_detail, tangent_map};

fn options(size: usize, front: f32, rear: f32) -> DetailOptions {
    DetailOptions {
        width: size,
        height: size,
        front: Some(front),
        rear: Some(rear),
        heights: true,
        ..DetailOptions::default()
    }
}

/// A wavy surface over the unit square, `z` up, and its normal.
fn wave(p: DVec2) -> (f64, DVec3) {
    let (sx, cx) = (9.0 * p.x).sin_cos();
    let (sy, cy) = (7.0 * p.y).sin_cos();
    (0.05 * sx * cy, DVec3::new(-0.45 * cx * cy, 0.35 * sx * sy, 1.0).normalize())
}

#[test]
fn a_displaced_square_gives_its_height_map_back() {
    // The detailed mesh has a vertex over each texel's centre, at the height of a rough map.
    const N: usize = 64;
    let height = |i: usize, j: usize| ((i * 7919 + j * 104_729) % 1009) as f32 / 1008.0;
    let (front, rear) = (0.03, 0.07);
    let clamped = |i: usize| i.clamp(1, N) - 1;
    let place = |i: usize| (i.clamp(0, N + 1) as f32 - 0.5) / N as f32;
    let z = |i: usize, j: usize| height(clamped(i), clamped(j)) * (front + rear) - rear;
    let detail = sheet(N + 1, |i, j| Vec3::new(place(i), 1.0 - place(j), z(i, j)));
    let maps = bake(&Mesh::unit_sheet(), &detail, &options(N, front, rear));
    assert_eq!(maps.report.missed, 0);
    assert_eq!((maps.report.front, maps.report.rear), (front, rear));
    let heights = maps.heights.unwrap();
    let worst = |dx: usize| {
        (0..N * N).map(|at| (heights[at] - height((at % N + dx) % N, at / N)).abs()).fold(0.0, f32::max)
    };
    assert!(worst(0) < 2e-6, "{}", worst(0));
    assert!(worst(1) > 0.5, "negative control: a map shifted by one texel is not the same");
}

#[test]
fn normals_of_a_fine_mesh_are_those_of_the_surface() {
    let detail = sheet(256, |i, j| {
        let p = DVec2::new(i as f64 / 256.0, j as f64 / 256.0);
        Vec3::new(p.x as f32, p.y as f32, wave(p).0 as f32)
    });
    let maps = bake(&Mesh::unit_sheet(), &detail, &options(128, 0.1, 0.1));
    let normal = maps.normal.unwrap();
    let mut errors: Vec<f64> = (0..128 * 128)
        .map(|at| {
            let [x, y] = texel_centre(at, 128);
            angle(Map(&normal, 3).vector(at), wave(DVec2::new(x, 1.0 - y)).1)
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    // Smooth normals of a mesh of this fineness; the border has only half its neighbours.
    assert!(errors[errors.len() * 98 / 100] < 0.05, "{}", errors[errors.len() * 98 / 100]);
    assert!(errors[errors.len() / 2] < 0.02, "{}", errors[errors.len() / 2]);
}

#[test]
fn a_ball_on_a_square_is_met_where_geometry_says() {
    // A ball of radius 0.4 around the middle of the square, rays straight down.
    let detail = Mesh::sphere(0.4, 256).unwrap();
    let plain = Mesh::quad(1.0).unwrap();
    let maps = bake(&plain, &detail, &DetailOptions { grid: 1, padding: 0, ..options(64, 0.5, 0.1) });
    let (normal, heights) = (maps.normal.unwrap(), maps.heights.unwrap());
    let (mut inside, mut outside) = (0, 0);
    for at in 0..64 * 64 {
        let [u, v] = texel_centre(at, 64);
        let (x, y) = (u - 0.5, 0.5 - v);
        let square = 0.16 - x * x - y * y;
        if square > 0.01 {
            let z = square.sqrt();
            assert!((f64::from(heights[at]) - (z + 0.1) / 0.6).abs() < 5e-4, "texel {at}");
            assert!(angle(Map(&normal, 3).vector(at), DVec3::new(x, y, z)) < 0.1, "texel {at}");
            inside += 1;
        } else if square < -0.001 {
            assert_eq!(Map(&normal, 3).vector(at), DVec3::Z);
            assert!((f64::from(heights[at]) - 0.1 / 0.6).abs() < 1e-6);
            outside += 1;
        }
    }
    assert!(inside > 1500 && outside > 1500);
    assert!(maps.report.missed as usize >= outside && maps.report.empty >= outside);
    assert!(maps.report.warnings.iter().any(|w| w.contains("met nothing")), "{:?}", maps.report.warnings);
}

#[test]
fn a_larger_sphere_on_a_smaller_one_is_flat_and_of_even_height() {
    let (plain, detail) = (Mesh::sphere(0.4, 256).unwrap(), Mesh::sphere(0.5, 256).unwrap());
    let maps = bake(&plain, &detail, &DetailOptions { height: 64, ..options(128, 0.2, 0.1) });
    let (normal, heights) = (maps.normal.unwrap(), maps.heights.unwrap());
    assert_eq!(maps.report.missed, 0);
    for at in 0..128 * 64 {
        assert!(angle(Map(&normal, 3).vector(at), DVec3::Z) < 0.25, "texel {at}");
        assert!((heights[at] - 0.2 / 0.3).abs() < 2e-3, "texel {at}: {}", heights[at]);
    }
}

#[test]
fn object_space_normals_are_those_of_the_detailed_mesh() {
    let (plain, detail) = (Mesh::sphere(0.4, 64).unwrap(), Mesh::sphere(0.5, 256).unwrap());
    let options = DetailOptions { space: NormalSpace::Object, ..options(128, 0.2, 0.1) };
    let normal = bake(&plain, &detail, &options).normal.unwrap();
    for at in 0..128 * 128 {
        let [u, v] = texel_centre(at, 128);
        let expected = mesh::generate::sphere_point(1.0, u, v).normal;
        // The plain sphere's facets are flat: a texel's point is not exactly at its longitude.
        assert!(angle(Map(&normal, 3).vector(at), expected) < 0.3, "texel {at}");
    }
}

#[test]
fn mirrored_charts_decode_to_the_same_surface() {
    // Two halves of a square, the right one with its image mirrored and turned.
    let plain = Sheet::halves(|p| p, |p| DVec2::new(1.0 - p.x, p.y));
    let detail = sheet(256, |i, j| {
        let p = DVec2::new(i as f64 / 128.0 - 1.0, j as f64 / 256.0);
        Vec3::new(p.x as f32, p.y as f32, wave(p).0 as f32)
    });
    for grid in [1, 2] {
        let maps = bake(&plain.mesh, &detail, &DetailOptions { grid, ..options(128, 0.1, 0.1) });
        let normal = maps.normal.unwrap();
        let mut checked = [0; 2];
        for at in 0..128 * 128 {
            let Some((place, frame)) = plain.at(texel_centre(at, 128)) else { continue };
            let found = decoded(&frame, Map(&normal, 3).vector(at));
            let expected = wave(place.truncate()).1;
            if place.x.abs() < 0.98 && (place.y - 0.5).abs() < 0.48 {
                assert!(angle(found, expected) < 0.2, "texel {at} at {place}: {found} for {expected}");
                checked[usize::from(frame.w < 0.0)] += 1;
            }
        }
        assert!(checked[0] > 3000 && checked[1] > 3000, "{checked:?}");
        // Negative control: with the other handedness the same texels decode to another surface.
        let wrong = (0..128 * 128).filter_map(|at| {
            let (place, mut frame) = plain.at(texel_centre(at, 128))?;
            frame.w = -frame.w;
            Some(angle(decoded(&frame, Map(&normal, 3).vector(at)), wave(place.truncate()).1))
        });
        assert!(wrong.fold(0.0, f64::max) > 10.0);
    }
}

#[test]
fn green_points_down_when_asked() {
    let detail = sheet(32, |i, j| Vec3::new(i as f32 / 32.0, j as f32 / 32.0, j as f32 / 320.0));
    let up = bake(&Mesh::unit_sheet(), &detail, &options(16, 0.2, 0.1)).normal.unwrap();
    let down = DetailOptions { green_down: true, ..options(16, 0.2, 0.1) };
    let down = bake(&Mesh::unit_sheet(), &detail, &down).normal.unwrap();
    let slope = DVec3::new(0.0, -0.1, 1.0).normalize();
    for at in 0..256 {
        assert!(angle(Map(&up, 3).vector(at), slope) < 0.01);
        assert!(angle(Map(&down, 3).vector(at), slope * DVec3::new(1.0, -1.0, 1.0)) < 0.01);
    }
}

#[test]
fn a_cage_at_a_distance_is_that_distance() {
    let plain = Mesh::sphere(0.4, 64).unwrap();
    let detail = object(0.45);
    let mut cage = plain.clone();
    for (p, n) in cage.positions.iter_mut().zip(&plain.normals) {
        *p += *n * 0.1;
    }
    let options = DetailOptions { height: 64, ..options(128, 0.1, 0.1) };
    let by_cage = bake_detail(&plain, &detail, Some(&cage), &options, &mut |_, _| true).unwrap();
    let by_distance = bake(&plain, &detail, &options);
    assert!((by_cage.report.front - 0.1).abs() < 1e-6);
    let (a, b) = (by_cage.heights.unwrap(), by_distance.heights.unwrap());
    let (c, d) = (by_cage.normal.unwrap(), by_distance.normal.unwrap());
    for at in 0..128 * 64 {
        // The cage's facets cut corners, as those of the plain mesh do.
        assert!((a[at] - b[at]).abs() < 2e-3, "texel {at}: {} and {}", a[at], b[at]);
        assert!(angle(Map(&c, 3).vector(at), Map(&d, 3).vector(at)) < 1.0, "texel {at}");
    }
}

#[test]
fn a_cage_that_leans_finds_what_straight_rays_miss() {
    // A plate that hangs 0.5 to the right of the square, and a cage that leans over to it.
    let plain = Mesh::unit_sheet();
    let plate = sheet(2, |i, j| Vec3::new(0.5 + i as f32 / 2.0, j as f32 / 2.0, 0.5));
    let mut cage = plain.clone();
    cage.positions.iter_mut().for_each(|p| *p += Vec3::new(1.0, 0.0, 1.0));
    let options = DetailOptions { padding: 0, ..options(32, 1.0, 0.0) };
    let straight = bake(&plain, &plate, &options);
    let leaning = bake_detail(&plain, &plate, Some(&cage), &options, &mut |_, _| true).unwrap();
    assert_eq!(straight.report.missed, 512);
    assert_eq!(leaning.report.missed, 0);
    let length = 2.0_f32.sqrt();
    assert!(leaning.heights.unwrap().iter().all(|h| (h * length - 0.5 * length).abs() < 1e-5));
}

#[test]
fn a_cage_of_other_triangles_is_refused() {
    let found = bake_detail(
        &Mesh::unit_sheet(),
        &Mesh::unit_sheet(),
        Some(&Mesh::cube(1.0).unwrap()),
        &options(8, 0.1, 0.1),
        &mut |_, _| true,
    );
    assert!(matches!(found, Err(MeshError::Arrays { .. })), "{found:?}");
}

#[test]
fn distances_are_measured_when_none_are_given() {
    let detail = sheet(64, |i, j| {
        let p = DVec2::new(i as f64 / 64.0, j as f64 / 64.0);
        Vec3::new(p.x as f32, p.y as f32, wave(p).0 as f32 + 0.02)
    });
    let options = DetailOptions { front: None, rear: None, ..options(64, 0.0, 0.0) };
    let maps = bake(&Mesh::unit_sheet(), &detail, &options);
    let DetailOptions { width, .. } = options;
    let report = maps.report;
    assert_eq!(report.missed, 0);
    let (low, high) = report.met.unwrap();
    assert!(report.front >= high && report.front < 1.4 * high, "{report:?}");
    assert!(report.rear >= -low && report.rear < 1.4 * -low, "{report:?}");
    let heights = maps.heights.unwrap();
    for at in 0..width * width {
        let [x, y] = texel_centre(at, width);
        let z = f64::from(heights[at] * (report.front + report.rear) - report.rear);
        assert!((z - 0.02 - wave(DVec2::new(x, 1.0 - y)).0).abs() < 5e-4, "texel {at}");
    }
}

#[test]
fn the_back_of_a_mesh_is_not_met_unless_asked() {
    let mut detail = sheet(8, |i, j| Vec3::new(i as f32 / 8.0, j as f32 / 8.0, 0.05));
    detail.indices.iter_mut().for_each(|t| t.swap(1, 2));
    let maps = bake(&Mesh::unit_sheet(), &detail, &options(16, 0.1, 0.1));
    assert_eq!((maps.report.missed, maps.report.averted, maps.report.empty), (256, 256, 256));
    assert!(maps.report.warnings.iter().any(|w| w.contains("from behind")), "{:?}", maps.report.warnings);
    let both = DetailOptions { back_faces: true, ..options(16, 0.1, 0.1) };
    let maps = bake(&Mesh::unit_sheet(), &detail, &both);
    assert_eq!(maps.report.missed, 0);
    assert!(maps.heights.unwrap().iter().all(|h| (h - 0.75).abs() < 1e-6));
    // The normals given are those of the other side; seen from behind they are turned over.
    assert!(maps.normal.unwrap().chunks(3).all(|n| n[2].abs() > 0.99));
}

#[test]
fn samples_are_averaged_over_the_texel() {
    let detail = object(0.45);
    let plain = Mesh::sphere(0.4, 32).unwrap();
    let coarse = bake(&plain, &detail, &DetailOptions { grid: 4, height: 32, ..options(64, 0.2, 0.1) });
    let fine = bake(&plain, &detail, &DetailOptions { height: 128, ..options(256, 0.2, 0.1) });
    let (coarse_h, fine_h) = (coarse.heights.unwrap(), fine.heights.unwrap());
    let (coarse_n, fine_n) = (coarse.normal.unwrap(), fine.normal.unwrap());
    // Not the rows at the poles, where half of the map belongs to no triangle.
    for at in 64 * 2..64 * 30 {
        let inside = |k: usize| (at / 64 * 4 + k / 4) * 256 + at % 64 * 4 + k % 4;
        let height = (0..16).map(|k| f64::from(fine_h[inside(k)])).sum::<f64>() / 16.0;
        assert!((height - f64::from(coarse_h[at])).abs() < 1e-5, "texel {at}");
        let normal: DVec3 = (0..16).map(|k| Map(&fine_n, 3).vector(inside(k))).sum();
        assert!(angle(Map(&coarse_n, 3).vector(at), normal) < 0.05, "texel {at}");
    }
}

#[test]
fn equal_bakes_are_equal_whatever_the_number_of_threads() {
    let plain = Mesh::sphere(0.4, 32).unwrap();
    let options = DetailOptions {
        height: 24,
        sky: Some(SkyOptions { rays: 9, ..SkyOptions::default() }),
        ..options(48, 0.2, 0.1)
    };
    let run = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let sky = options.sky.map(|sky| SkyOptions { seed, ..sky });
        pool.install(|| bake(&plain, &object(0.45), &DetailOptions { sky, ..options }))
    };
    let one = run(1, 0);
    assert_eq!(one, run(3, 0));
    assert_ne!(one.ao, run(1, 1).ao, "another seed");
}

#[test]
fn tangent_maps_hold_the_frame() {
    let plain = Sheet::halves(|p| p, |p| DVec2::new(1.0 - p.x, p.y));
    let map = tangent_map(&plain.mesh, 64, 64, 2, &mut |_, _| true).unwrap();
    for at in 0..64 * 64 {
        let Some((_, frame)) = plain.at(texel_centre(at, 64)) else { continue };
        assert!(angle(Map(&map, 4).vector(at), frame.tangent) < 1e-3, "texel {at}");
        assert_eq!(f64::from(map[4 * at + 3]), frame.w, "texel {at}");
    }
}
