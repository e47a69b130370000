//! What meshes hide of one another is left out, or goes before it is marched, and no pixel tells.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::{Random, sun};
use glam::{DMat4, DQuat, DVec3, Vec3};
use heightfield::{Extent, Wrap};
use mesh::Mesh;
use render::{AovSet, Camera, Draw, Frame, Material, Request, Scene, Skips, TechniqueChoice};

const SIZE: [u32; 2] = [200, 150];
const LIGHT: Vec3 = Vec3::new(-0.5, -0.7, -0.6);

fn picture(draws: &[Draw<'_>], camera: Camera, technique: &str, skips: Skips) -> Option<Frame> {
    let device = common::device()?;
    let lights = vec![sun(LIGHT)];
    let scene = Scene { draws: draws.to_vec(), camera, lights, ambient: [0.1; 3], background: [0.0; 4] };
    let aovs = AovSet::UV | AovSet::DEPTH | AovSet::MASK;
    let technique = TechniqueChoice::named(technique).unwrap();
    let request = Request { aovs, skips, ..Request::new(technique, SIZE[0], SIZE[1]) };
    Some(render::render(&device, &scene, &request).unwrap())
}

/// Twenty things of all shapes, some near ones before the others; turned, stretched and mirrored.
fn scattered<'a>(meshes: &'a [Mesh], materials: &'a [Material], seed: u64) -> Vec<Draw<'a>> {
    let mut numbers = Random(seed);
    (0..20)
        .map(|at| {
            let depth = if at < 4 { numbers.between(-1.0, 0.5) } else { numbers.between(-14.0, -1.5) };
            let reach = 0.35 * (4.0 - depth);
            let place = DVec3::new(numbers.between(-reach, reach), numbers.between(-reach, reach), depth);
            let axis = DVec3::new(numbers.next() - 0.5, numbers.next() - 0.5, numbers.next() - 0.4);
            let turn = DQuat::from_axis_angle(axis.normalize(), numbers.between(0.0, 6.0));
            let mirrored = if numbers.next() < 0.3 { -1.0 } else { 1.0 };
            let size = if at < 4 { 1.9 } else { 0.8 };
            let scale = DVec3::new(size * mirrored, size, numbers.between(0.5, 1.2) * size);
            let world_from_object = DMat4::from_scale_rotation_translation(scale, turn, place);
            let (mesh, material) = (&meshes[at % meshes.len()], &materials[at % materials.len()]);
            Draw { world_from_object, ..Draw::new(mesh, material) }
        })
        .collect()
}

fn compare(seeds: std::ops::Range<u64>, techniques: &[&str]) {
    if common::device().is_none() {
        return;
    }
    let meshes = [
        Mesh::sphere(0.5, 40).unwrap(),
        Mesh::torus(0.45, 0.25, 48, 32).unwrap(),
        Mesh::cube(0.8).unwrap(),
        Mesh::sphere(0.5, 96).unwrap(),
    ];
    // Carved in; half raised, which is never taken to be hidden; shown from both sides.
    let materials = [1.0, 0.5, 1.0].map(|base| {
        let extent = Extent { scale: 0.09, base, tile_size: [1.0; 2] };
        let field = Arc::new(common::field(common::fbm, [64, 64], Wrap::Repeat, extent));
        Material::new(field)
    });
    let [carved, raised, both] = materials;
    let materials = [carved, raised, Material { double_sided: true, ..both }];
    let kinds = [Skips::OCCLUSION, Skips::DEPTH_FIRST];
    let mut counts = [0; 2];
    for seed in seeds {
        let draws = scattered(&meshes, &materials, seed);
        let mut numbers = Random(seed ^ 0x5eed);
        let eye = DVec3::new(numbers.between(-1.0, 1.0), numbers.between(-1.0, 1.0), 4.0);
        let camera = Camera::look_at(eye, DVec3::new(0.0, 0.0, -3.0));
        for technique in techniques {
            let plain = picture(&draws, camera, technique, Skips::NONE).unwrap();
            for (kind, count) in kinds.into_iter().zip(&mut counts) {
                let spared = picture(&draws, camera, technique, kind).unwrap();
                assert_eq!(plain.stats.skipped.of(kind), 0);
                *count += spared.stats.skipped.of(kind);
                let case = format!("{technique}, scene {seed}, {kind:?}");
                assert!(plain.color == spared.color, "{case}: colours differ");
                let same = |a: &Option<Vec<f32>>, b: &Option<Vec<f32>>| a.is_some() && a == b;
                assert!(same(&plain.aovs.uv, &spared.aovs.uv), "{case}: places differ");
                assert!(same(&plain.aovs.depth, &spared.aovs.depth), "{case}: depths differ");
            }
        }
    }
    let [hidden, moved] = counts;
    assert!(hidden > 1000, "only {hidden} triangles were hidden");
    assert!(moved > 10, "only {moved} draws were moved");
}

#[test]
fn no_pixel_tells_what_was_hidden() {
    compare(0..4, &["relief", "normal"]);
}

#[test]
#[ignore = "many scenes"]
fn no_pixel_tells_what_was_hidden_in_any_of_many_scenes() {
    compare(4..150, &["relief", "exact", "flat"]);
}

#[test]
fn what_stands_before_is_never_hidden() {
    let ball = Mesh::sphere(0.5, 48).unwrap();
    let field = Arc::new(common::field(common::fbm, [64, 64], Wrap::Repeat, Extent::default()));
    let material = Material::new(field);
    let at = |place: DVec3| Draw {
        world_from_object: DMat4::from_translation(place) * DMat4::from_scale(DVec3::splat(0.5)),
        ..Draw::new(&ball, &material)
    };
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO);
    let large =
        Draw { world_from_object: DMat4::from_scale(DVec3::splat(2.0)), ..Draw::new(&ball, &material) };
    for (place, hidden) in [(DVec3::new(0.0, 0.0, -2.0), true), (DVec3::new(0.0, 0.0, 1.8), false)] {
        let Some(frame) = picture(&[large.clone(), at(place)], camera, "relief", Skips::OCCLUSION) else {
            return;
        };
        let count = frame.stats.skipped.of(Skips::OCCLUSION);
        assert_eq!(count >= ball.indices.len() as u64, hidden, "{place}: {count} triangles");
    }
}
