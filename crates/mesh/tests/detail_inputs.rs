//! Bad input, interruption, and meshes that people made.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::bakes::{Map, UnitSheet, angle, bake, sheet};
use common::{files, shared};
use glam::{DVec3, Vec3};
use mesh::{DetailOptions, Mesh, MeshError, SkyOptions, bake_detail, tangent_map};

fn options(size: usize) -> DetailOptions {
    DetailOptions {
        width: size,
        height: size,
        front: Some(0.1),
        rear: Some(0.1),
        heights: true,
        ..DetailOptions::default()
    }
}

fn error(plain: &Mesh, detail: &Mesh, options: DetailOptions) -> MeshError {
    bake_detail(plain, detail, None, &options, &mut |_, _| true).unwrap_err()
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let mesh = Mesh::unit_sheet();
    let good = options(8);
    let sky = |sky| DetailOptions { sky: Some(sky), ..good };
    let cases = [
        ("width", DetailOptions { width: 0, ..good }),
        ("height", DetailOptions { height: 1 << 20, ..good }),
        ("samples", DetailOptions { grid: 0, ..good }),
        ("samples", DetailOptions { grid: 9, ..good }),
        ("front", DetailOptions { front: Some(-1.0), ..good }),
        ("rear", DetailOptions { rear: Some(f32::NAN), ..good }),
        ("front + rear", DetailOptions { front: Some(0.0), rear: Some(0.0), ..good }),
        ("rays", sky(SkyOptions { rays: 0, ..SkyOptions::default() })),
        ("distance", sky(SkyOptions { distance: Some(0.0), ..SkyOptions::default() })),
    ];
    for (name, options) in cases {
        let found = error(&mesh, &mesh, options);
        assert!(
            matches!(found, MeshError::Parameter { name: found, .. } if found == name),
            "{name}: {found}"
        );
    }
    assert!(tangent_map(&mesh, 0, 1, 0, &mut |_, _| true).is_err());
}

#[test]
fn coordinates_beyond_reason_are_refused() {
    let mut far = Mesh::unit_sheet();
    far.positions[2].y = 1e20;
    for (plain, detail, who) in
        [(&far, &Mesh::unit_sheet(), "plain mesh"), (&Mesh::unit_sheet(), &far, "detailed mesh")]
    {
        let text = error(plain, detail, options(8)).to_string();
        assert!(text.contains(who) && text.contains("vertex 2"), "{text}");
    }
}

#[test]
fn large_and_small_units_make_no_difference() {
    let build = |unit: f32| {
        let detail =
            sheet(16, |i, j| Vec3::new(i as f32, j as f32, ((i * 5 + j * 3) % 4) as f32 * 0.4) / 16.0 * unit);
        let mut plain = Mesh::unit_sheet();
        plain.positions.iter_mut().for_each(|p| *p *= unit);
        let distance = Some(0.2 * unit);
        bake(&plain, &detail, &DetailOptions { front: distance, rear: distance, ..options(32) })
    };
    let usual = build(1.0);
    assert_eq!(usual.report.missed, 0);
    for unit in [1e-6, 1e6, 1e12] {
        let other = build(unit);
        assert_eq!(other.report.missed, 0, "unit {unit}");
        let (a, b) = (usual.heights.as_ref().unwrap(), other.heights.as_ref().unwrap());
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5), "unit {unit}");
    }
}

#[test]
fn a_bake_stops_at_every_report() {
    let (plain, detail) = (Mesh::unit_sheet(), sheet(8, |i, j| Vec3::new(i as f32, j as f32, 0.1) / 8.0));
    let options = DetailOptions { front: None, rear: None, ..options(512) };
    let mut reports = Vec::new();
    bake_detail(&plain, &detail, None, &options, &mut |done, total| {
        reports.push((done, total));
        true
    })
    .unwrap();
    assert!(reports.is_sorted() && reports.len() > 6, "{reports:?}");
    assert_eq!(reports.last(), Some(&(512, 512)));
    for stop in 0..reports.len() {
        let mut asked = 0;
        let found = bake_detail(&plain, &detail, None, &options, &mut |_, _| {
            asked += 1;
            asked <= stop
        });
        assert!(matches!(found, Err(MeshError::Interrupted)), "{stop}: {found:?}");
        assert_eq!(asked, stop + 1);
    }
    assert!(matches!(tangent_map(&plain, 8, 8, 0, &mut |_, _| false), Err(MeshError::Interrupted)));
}

#[test]
fn odd_sizes_are_baked() {
    let detail = Mesh::unit_sheet();
    for (width, height) in [(1, 1), (1, 77), (77, 1), (13, 7), (9, 9)] {
        for grid in [1, 3, 5, 8] {
            let maps = bake(&detail, &detail, &DetailOptions { width, height, grid, ..options(1) });
            assert_eq!(maps.report.texels, width * height);
            assert_eq!(maps.report.rays as usize, width * height * grid * grid);
            assert!(maps.heights.unwrap().iter().all(|h| (h - 0.5).abs() < 1e-6));
        }
    }
}

#[test]
fn a_mesh_baked_on_itself_is_flat() {
    let names = ["obj/meshoptimizer/pirate.obj", "obj/trimesh/fuze.obj", "obj/mikktspace/doomcone.obj"];
    for path in names.iter().filter_map(|name| shared(name)) {
        let mesh = Mesh::open(&path).unwrap();
        let (low, high) = mesh.bounds();
        let far = Some(low.distance(high) * 0.001);
        let maps = bake(&mesh, &mesh, &DetailOptions { front: far, rear: far, ..options(256) });
        let (normal, heights) = (maps.normal.unwrap(), maps.heights.unwrap());
        assert!(maps.report.texels > 5000, "{path:?}: {:?}", maps.report);
        // Where sheets lie closer to each other than the rays are long another one is met.
        let flat = (0..256 * 256)
            .filter(|&at| {
                (heights[at] - 0.5).abs() < 0.01 && angle(Map(&normal, 3).vector(at), DVec3::Z) < 1.0
            })
            .count();
        assert!(flat as f64 > 0.93 * 256.0 * 256.0, "{path:?}: {flat}, {:?}", maps.report);
    }
}

/// Bakes all meshes whose files have a size in some range on themselves; returns how many there are.
fn bake_all(sizes: std::ops::Range<u64>) -> usize {
    let Some(folder) = shared("") else { return usize::MAX };
    let mut baked = 0;
    for path in files(&folder) {
        let kind = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        if !["obj", "glb", "gltf"].contains(&kind) || !sizes.contains(&path.metadata().unwrap().len()) {
            continue;
        }
        let Ok(mesh) = Mesh::open(&path) else { continue };
        let sky = Some(SkyOptions { rays: 2, ..SkyOptions::default() });
        let options = DetailOptions { front: None, rear: None, sky, grid: 2, ..options(16) };
        let found = bake_detail(&mesh, &mesh, None, &options, &mut |_, _| true);
        let unit = |map: &[f32]| map.iter().all(|x| (0.0..=1.0).contains(x));
        match found {
            Ok(maps) => {
                assert!(unit(&maps.heights.unwrap()) && unit(&maps.ao.unwrap()), "{path:?}");
                assert!(maps.normal.unwrap().iter().all(|n| n.abs() <= 1.0 + 1e-6), "{path:?}");
                baked += 1;
            }
            Err(problem) => assert!(matches!(problem, MeshError::Arrays { .. }), "{path:?}: {problem}"),
        }
    }
    baked
}

#[test]
fn every_small_mesh_at_hand_can_be_baked() {
    assert!(bake_all(0..100_000) > 20);
}

#[test]
#[ignore = "some seconds"]
fn every_large_mesh_at_hand_can_be_baked() {
    assert!(bake_all(100_000..u64::MAX) > 5);
}
