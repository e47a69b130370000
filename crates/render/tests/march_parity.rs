//! Every search on the device against its Rust twin.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{Random, fbm, field, ridges};
use heightfield::{Extent, HeightField, MarchOptions, RayArray, Status, Technique, Wrap};
use render::{Device, DeviceOptions};

const RAYS: usize = 20_000;
/// Texels between the two hits at the 99th percentile; measured: below 0.002 for all.
const UV_TOLERANCE: f64 = 0.01;
/// Share of rays that hit on one side and not on the other; measured: 0.
const STATUS_TOLERANCE: f64 = 1e-4;

/// Rays from above the lid down at 2 to 90 degrees, some from far-off tiles.
fn rays(field: &HeightField, seed: u64) -> (Vec<f32>, Vec<f32>) {
    let mut random = Random(seed);
    let extent = field.extent();
    let (mut origins, mut directions) = (Vec::new(), Vec::new());
    for _ in 0..RAYS {
        let elevation = random.between(2.0, 90.0).to_radians();
        let azimuth = random.between(0.0, std::f64::consts::TAU);
        let lateral = elevation.cos();
        origins.extend(
            [random.between(-1.5, 2.5), random.between(-1.5, 2.5), random.between(1.0, 1.4)]
                .map(|x| x as f32),
        );
        directions.extend(
            [
                lateral * azimuth.cos() / f64::from(extent.tile_size[0]),
                lateral * azimuth.sin() / f64::from(extent.tile_size[1]),
                -elevation.sin() / f64::from(extent.scale),
            ]
            .map(|x| x as f32),
        );
    }
    (origins, directions)
}

fn maps() -> Vec<(&'static str, HeightField)> {
    let extent = |scale, u, v| Extent { scale, base: 1.0, tile_size: [u, v] };
    let mut maps = Vec::new();
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        maps.push(("fbm", field(fbm, [128, 128], wrap, extent(0.1, 1.0, 1.0))));
        maps.push(("ridges", field(ridges, [96, 96], wrap, extent(0.2, 1.0, 1.0))));
        maps.push(("flat", field(|_, _| 0.4, [16, 16], wrap, extent(0.1, 1.0, 1.0))));
        maps.push(("non-square", field(fbm, [75, 33], wrap, Extent { base: 0.3, ..extent(0.1, 2.0, 1.0) })));
    }
    maps
}

fn compare(device: &Device, technique: &Technique, name: &str, field: &HeightField) {
    let (origins, directions) = rays(field, 7);
    let ours = render::march(device, field, technique, &origins, &directions).unwrap();
    let options = MarchOptions::default();
    let twin =
        heightfield::march(field, technique, RayArray::F32(&origins), RayArray::F32(&directions), &options)
            .unwrap();
    let (ours_status, twin_status) = (ours.hits.status.unwrap(), twin.status.unwrap());
    let hit = Status::Hit as u8;
    let differing =
        ours_status.iter().zip(&twin_status).filter(|(a, b)| (**a == hit) != (**b == hit)).count();
    let (ours_uv, twin_uv) = (ours.hits.uv.unwrap(), twin.uv.unwrap());
    let mut errors: Vec<f64> = (0..RAYS)
        .filter(|&i| ours_status[i] == hit && twin_status[i] == hit)
        .map(|i| {
            let du = f64::from(ours_uv[2 * i] - twin_uv[2 * i]) * field.width() as f64;
            let dv = f64::from(ours_uv[2 * i + 1] - twin_uv[2 * i + 1]) * field.height() as f64;
            du.hypot(dv)
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    let p99 = errors[errors.len() * 99 / 100];
    let label = format!("{technique} on {name} {:?}", field.wrap());
    println!("{label}: p99 {p99:.6} texels, worst {:.6}, differing {differing}", errors.last().unwrap());
    assert!(errors.len() > RAYS / 2, "{label}: only {} rays hit", errors.len());
    assert!(p99 <= UV_TOLERANCE, "{label}: p99 {p99} texels");
    assert!(differing as f64 <= STATUS_TOLERANCE * RAYS as f64, "{label}: {differing} of {RAYS} differ");
}

#[test]
fn every_search_agrees_with_its_twin() {
    let Some(device) = common::device() else { return };
    for (name, field) in maps() {
        for info in Technique::all() {
            compare(&device, &Technique::named(info.name).unwrap(), name, &field);
        }
    }
}

#[test]
fn parameters_reach_the_device() {
    let Some(device) = common::device() else { return };
    let field = field(fbm, [64, 64], Wrap::Repeat, Extent::default());
    for linear in [1.0, 7.0, 100.0] {
        let technique = Technique::named("relief").unwrap().with("linear", linear).unwrap();
        compare(&device, &technique, "fbm", &field);
    }
}

#[test]
fn a_device_without_filtering_agrees_too() {
    if common::device().is_none() {
        return;
    }
    let options = DeviceOptions { manual_bilinear: true, ..DeviceOptions::default() };
    let device = Device::open(&options).unwrap();
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let field = field(fbm, [75, 33], wrap, Extent::default());
        for name in ["relief", "steep_linear", "exact"] {
            compare(&device, &Technique::named(name).unwrap(), "fbm", &field);
        }
    }
}

#[test]
fn shadow_rays_agree() {
    let Some(device) = common::device() else { return };
    for (name, field) in maps() {
        let mut random = Random(11);
        let (mut origins, mut directions) = (Vec::new(), Vec::new());
        for _ in 0..RAYS {
            let (u, v) = (random.between(0.0, 1.0), random.between(0.0, 1.0));
            // Lifted as the renderer lifts its own, so that rounding at the start does not count.
            let z = (field.height_at(u, v) + 1.0 / 65536.0).min(1.0);
            origins.extend([u as f32, v as f32, z as f32]);
            let (x, y) = (random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            directions.extend([x as f32, y as f32, random.between(0.2, 5.0) as f32]);
        }
        for info in Technique::all().iter().filter(|info| info.casts_shadows) {
            let technique = Technique::named(info.name).unwrap();
            let ours = render::occluded(&device, &field, &technique, &origins, &directions).unwrap();
            let period = heightfield::march::period(field.wrap());
            let differing = (0..RAYS)
                .filter(|&i| {
                    let at = |values: &[f32]| [0, 1, 2].map(|axis| f64::from(values[3 * i + axis]));
                    let (origin, direction) = (at(&origins), at(&directions));
                    let cosine = field.extent().cos_theta(direction);
                    let twin = heightfield::Segment::clip(origin, direction, cosine, period).is_some_and(
                        |segment| technique.occluded(&field, segment.start, segment.delta, segment.cos_theta),
                    );
                    ours[i] != twin
                })
                .count();
            println!("{} shadows on {name} {:?}: {differing} differ", info.name, field.wrap());
            assert!(differing <= RAYS / 1000, "{}: {differing} of {RAYS} shadow rays differ", info.name);
        }
    }
}

#[test]
fn rays_are_checked_and_none_is_fine() {
    let Some(device) = common::device() else { return };
    let field = field(fbm, [8, 8], Wrap::Repeat, Extent::default());
    let exact = Technique::named("exact").unwrap();
    assert_eq!(render::march(&device, &field, &exact, &[], &[]).unwrap().hits.t.unwrap().len(), 0);
    assert!(render::march(&device, &field, &exact, &[0.0, 0.0, f32::NAN], &[0.0, 0.0, -1.0]).is_err());
    assert!(render::march(&device, &field, &exact, &[0.0, 0.0, 1.0], &[0.0; 3]).is_err());
    // Upwards from the lid, and along it.
    let answer = render::march(&device, &field, &exact, &[0.0, 0.0, 2.0], &[0.0, 0.0, 1.0]).unwrap();
    assert_eq!(answer.hits.t.unwrap(), [f32::INFINITY]);
}
