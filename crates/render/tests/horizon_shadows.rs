//! Self-shadows from horizon maps: the picture against the map's twin on the CPU, and both against rays.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use bake::Progress;
use common::{fbm, field, ridges, sun};
use glam::{DVec3, Vec3};
use heightfield::{Extent, HeightField, HorizonMap, Wrap, oracle};
use mesh::Mesh;
use render::{AovSet, Aovs, Camera, Draw, HorizonShadows, Material, Request, Scene, TechniqueChoice};

const TILE: [f32; 2] = [1.0, 1.0];

fn relief(map: fn(f64, f64) -> f64, wrap: Wrap) -> Arc<HeightField> {
    Arc::new(field(map, [128, 128], wrap, Extent { scale: 0.15, base: 1.0, tile_size: TILE }))
}

fn draw(
    device: &render::Device,
    field: &Arc<HeightField>,
    technique: &str,
    light: Vec3,
    horizon: Option<HorizonShadows>,
) -> Aovs {
    let mesh = Mesh::quad(1.0).unwrap();
    let material = Material::new(Arc::clone(field));
    let scene = Scene {
        draws: vec![Draw::new(&mesh, &material)],
        camera: Camera::look_at(DVec3::new(0.2, -0.9, 1.0), DVec3::ZERO),
        lights: vec![sun(light)],
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    let aovs = AovSet::UV | AovSet::SHADOW | AovSet::NORMAL | AovSet::MASK;
    let request =
        Request { aovs, horizon, ..Request::new(TechniqueChoice::named(technique).unwrap(), 160, 120) };
    let frame = render::render(device, &scene, &request).unwrap();
    assert_eq!(frame.stats.shadow_rays == 0, horizon.is_some() || technique == "bump");
    frame.aovs
}

/// Pixels that face the light: where they are on the map, and how much of it is hidden from them.
fn lit(aovs: &Aovs, light: Vec3) -> Vec<([f32; 2], f32)> {
    let (uv, shadow) = (aovs.uv.as_ref().unwrap(), aovs.shadow.as_ref().unwrap());
    let (normal, mask) = (aovs.normal.as_ref().unwrap(), aovs.mask.as_ref().unwrap());
    (0..mask.len())
        .filter(|&at| mask[at] == 1 && Vec3::from_slice(&normal[3 * at..]).dot(-light) > 0.0)
        .map(|at| ([uv[2 * at], uv[2 * at + 1]], shadow[at]))
        .collect()
}

#[test]
fn the_picture_agrees_with_the_map_on_the_cpu() {
    let Some(device) = common::device() else { return };
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let field = relief(fbm, wrap);
        let sines = bake::horizon_map(&field, 16, Progress::none()).unwrap();
        let map = HorizonMap::new(&field, 16, sines).unwrap();
        let light = Vec3::new(-1.0, 0.4, -0.5);
        for technique in ["bump", "normal", "exact"] {
            for (softness, limit) in [(0.0, 0.01), (0.2, 0.001)] {
                let horizon = HorizonShadows { azimuths: 16, softness };
                let points = lit(&draw(&device, &field, technique, light, Some(horizon)), light);
                let differing = points
                    .iter()
                    .filter(|(uv, hidden)| {
                        let expected = map.hides(*uv, (-light).to_array(), softness);
                        (expected - hidden).abs() > 0.02
                    })
                    .count();
                let share = differing as f64 / points.len() as f64;
                println!("{technique} {wrap:?} softness {softness}: {share:.5} of {} differ", points.len());
                assert!(points.len() > 3000 && share < limit, "{technique} {wrap:?}: {share}");
                // The other side of the sky must not agree.
                let away = |uv| map.hides(uv, [light.x, light.y, -light.z], softness);
                let wrong = points.iter().filter(|(uv, hidden)| (away(*uv) - hidden).abs() > 0.02).count();
                assert!(wrong as f64 > 0.05 * points.len() as f64);
            }
        }
    }
}

/// Lowest and highest of the four texels around a place.
fn texels_around(field: &HeightField, u: f64, v: f64) -> [f32; 2] {
    let [i, j] = [u * field.width() as f64, v * field.height() as f64].map(|x| (x - 0.5).floor() as i64);
    let heights = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| field.texel(i + x, j + y));
    heights.iter().fold([1.0, 0.0], |[low, high], &height| [low.min(height), high.max(height)])
}

/// Share of pixels whose shadow bit differs from the exact ray's, on ground and on upright walls. Measured with 32
/// azimuths: at most 0.013 of all on ground, and 0.065 on walls one texel wide: there the horizon is that of the top at
/// one end and that of the foot at the other, and what is between them is neither.
#[test]
fn shadow_bits_are_close_to_those_of_rays() {
    let Some(device) = common::device() else { return };
    type Relief = fn(f64, f64) -> f64;
    for (name, map) in [("fbm", fbm as Relief), ("ridges", ridges)] {
        let field = relief(map, Wrap::Repeat);
        for light in [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, 0.2, -0.3)] {
            let to_light = [-light.x, light.y, -light.z / 0.15].map(f64::from);
            let mut shares = Vec::new();
            for azimuths in [8, 32] {
                let horizon = Some(HorizonShadows { azimuths, softness: 0.0 });
                let points = lit(&draw(&device, &field, "exact", light, horizon), light);
                let mut differing = [0; 2];
                for ([u, v], hidden) in &points {
                    let (u, v) = (f64::from(*u), f64::from(*v));
                    let blocked = oracle::occluded(&field, [u, v, field.height_at(u, v)], to_light);
                    let wall = texels_around(&field, u, v);
                    differing[usize::from(wall[1] - wall[0] > 0.5)] +=
                        usize::from(blocked != (*hidden > 0.5));
                }
                shares.push(differing.map(|n| n as f64 / points.len() as f64));
            }
            println!("{name} {light}: {shares:?} on ground and walls, with 8 and 32 azimuths");
            assert!(shares[1][0] < 0.02 && shares[1][1] < 0.08 && shares[0][0] < 0.1, "{name}: {shares:?}");
        }
    }
}

#[test]
fn a_stretched_mesh_has_the_shadows_of_its_own_relief() {
    let Some(device) = common::device() else { return };
    // On a quad twice as wide as the tile the map was baked for, the relief is half as steep.
    let field = relief(ridges, Wrap::Repeat);
    let stretched = Mesh::quad(2.0).unwrap();
    let material = Material::new(Arc::clone(&field));
    let light = Vec3::new(-1.0, 0.2, -0.12);
    let scene = Scene {
        draws: vec![Draw::new(&stretched, &material)],
        camera: Camera::look_at(DVec3::new(0.2, -1.8, 2.0), DVec3::ZERO),
        lights: vec![sun(light)],
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    let render = |horizon| {
        let aovs = AovSet::UV | AovSet::SHADOW | AovSet::NORMAL | AovSet::MASK;
        let request =
            Request { aovs, horizon, ..Request::new(TechniqueChoice::named("exact").unwrap(), 160, 120) };
        lit(&render::render(&device, &scene, &request).unwrap().aovs, light)
    };
    let (rays, map) = (render(None), render(Some(HorizonShadows { azimuths: 64, softness: 0.0 })));
    let differing = rays.iter().zip(&map).filter(|(a, b)| (a.1 - b.1).abs() > 0.5).count();
    let share = differing as f64 / rays.len() as f64;
    println!("stretched: {share:.4} differ");
    assert!(share < 0.04, "{share}");
}

#[test]
fn what_a_horizon_cannot_do_is_said() {
    let Some(device) = common::device() else { return };
    let field = relief(fbm, Wrap::Repeat);
    let mesh = Mesh::quad(1.0).unwrap();
    let material = Material::new(field);
    let scene = Scene {
        draws: vec![Draw::new(&mesh, &material)],
        camera: Camera::look_at(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO),
        lights: vec![sun(Vec3::new(0.0, 0.0, -1.0))],
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    let request = |technique: &str, azimuths| Request {
        horizon: Some(HorizonShadows { azimuths, softness: 0.0 }),
        ..Request::new(TechniqueChoice::named(technique).unwrap(), 16, 16)
    };
    let frame = render::render(&device, &scene, &request("flat", 8)).unwrap();
    assert!(frame.warnings.iter().any(|text| text.contains("horizon")), "{:?}", frame.warnings);
    assert!(render::render(&device, &scene, &request("bump", 8)).unwrap().warnings.is_empty());
    let error = render::render(&device, &scene, &request("bump", 1 << 20)).unwrap_err().to_string();
    assert!(error.contains("azimuths"), "{error}");
}
