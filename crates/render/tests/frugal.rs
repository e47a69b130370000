//! Only what a technique uses is baked, uploaded and compiled.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::{fbm, field, front, sun};
use glam::Vec3;
use heightfield::{Extent, Wrap};
use mesh::Mesh;
use render::{AovSet, Device, DeviceOptions, Draw, Material, Request, Scene, TechniqueChoice};

#[test]
fn nothing_is_baked_uploaded_or_compiled_in_vain() {
    if common::device().is_none() {
        return;
    }
    // A device of its own: nobody else's maps and pipelines count.
    let device = Device::open(&DeviceOptions::default()).unwrap();
    let mesh = Mesh::quad(1.0).unwrap();
    let material = Material::new(Arc::new(field(fbm, [64, 64], Wrap::Repeat, Extent::default())));
    let scene = Scene {
        draws: vec![Draw::new(&mesh, &material)],
        camera: front(),
        lights: vec![sun(Vec3::NEG_Z)],
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    // Technique; maps baked by it; maps on the device and pipelines afterwards.
    for (name, baked, kept, pipelines) in [
        ("flat", 0, 0, 1),
        ("bump", 0, 1, 2),
        ("normal", 1, 2, 3),
        ("normal", 0, 2, 3),
        ("dot3", 1, 3, 4),
        // The bounds of its ground, which all searches share.
        ("relief", 0, 4, 5),
        ("pom", 0, 4, 6),
        ("exact", 0, 5, 7),
        ("exact", 0, 5, 7),
    ] {
        let request = Request::new(TechniqueChoice::named(name).unwrap(), 32, 32);
        let frame = render::render(&device, &scene, &request).unwrap();
        assert_eq!(frame.stats.maps_baked, baked, "{name}: baked");
        assert_eq!(device.maps_kept(), kept, "{name}: kept");
        assert_eq!(device.pipelines_compiled(), pipelines, "{name}: compiled");
        assert_eq!(frame.stats.pixels_marched > 0, request.technique.displaces(), "{name}: marched");
        assert!(frame.aovs == render::Aovs::default(), "{name}: outputs nobody asked for");
        // The sun stands too high for any of them to be followed.
        let shadow_rays = frame.stats.skipped.of(render::Skips::SHADOW) > 0;
        assert_eq!(frame.stats.shadow_rays, 0, "{name}: shadow rays followed");
        assert_eq!(shadow_rays, request.technique.casts_shadows(), "{name}: shadow rays");
    }
    let request =
        Request { aovs: AovSet::DEPTH, ..Request::new(TechniqueChoice::named("flat").unwrap(), 32, 32) };
    let aovs = render::render(&device, &scene, &request).unwrap().aovs;
    assert!(aovs.depth.is_some() && aovs.uv.is_none() && aovs.normal.is_none());

    // Outside the picture nothing is drawn.
    let mut away = scene.clone();
    away.draws[0].world_from_object = glam::DMat4::from_translation(glam::DVec3::new(50.0, 0.0, 0.0));
    let stats = render::render(&device, &away, &request).unwrap().stats;
    assert_eq!((stats.triangles_drawn, stats.triangles_culled, stats.pixels_covered), (0, 2, 0));

    // With the last of its owners a map leaves the device.
    drop(away);
    drop(scene);
    drop(material);
    assert_eq!(device.maps_kept(), 0);
}
