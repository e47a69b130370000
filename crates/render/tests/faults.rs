//! Senseless input and missing devices give errors that say what is wrong.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::process::Command;
use std::sync::Arc;

use bake::{Image, Samples};
use common::{fbm, field, front, sun};
use glam::{DMat4, DVec3, Vec3};
use heightfield::{Extent, Wrap};
use mesh::Mesh;
use render::{Device, DeviceOptions, Draw, Light, Material, RenderError, Request, Scene, TechniqueChoice};

/// The message of the error that a changed scene gives.
fn message(device: &Device, change: impl FnOnce(&mut Scene<'_>, &mut Request)) -> String {
    let mesh = Mesh::quad(1.0).unwrap();
    let material = Material::new(Arc::new(field(fbm, [16, 16], Wrap::Repeat, Extent::default())));
    let mut scene = Scene {
        draws: vec![Draw::new(&mesh, &material)],
        camera: front(),
        lights: vec![sun(Vec3::NEG_Z)],
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    let mut request = Request::new(TechniqueChoice::named("relief").unwrap(), 16, 16);
    change(&mut scene, &mut request);
    render::render(device, &scene, &request).unwrap_err().to_string()
}

#[test]
fn senseless_scenes_are_named() {
    let Some(device) = common::device() else { return };
    let check = |expected: &str, change: &dyn Fn(&mut Scene<'_>, &mut Request)| {
        let message = message(&device, |scene, request| change(scene, request));
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
    };
    check("0 x 16", &|_, request| request.width = 0);
    check("16 x 0", &|_, request| request.height = 0);
    check("at most", &|_, request| request.width = 10_000_000);
    check("eye", &|scene, _| scene.camera.eye.x = f64::NAN);
    check("target", &|scene, _| scene.camera.target.y = f64::INFINITY);
    check("eye and target", &|scene, _| scene.camera.target = scene.camera.eye);
    check("up", &|scene, _| scene.camera.up = DVec3::ZERO);
    check("up", &|scene, _| scene.camera.up = DVec3::Z);
    check("field of view", &|scene, _| scene.camera.fov_y = f64::NAN);
    check("field of view", &|scene, _| scene.camera.fov_y = 4.0);
    check("light 0: direction", &|scene, _| scene.lights[0] = sun(Vec3::ZERO));
    check("light 0: color", &|scene, _| {
        scene.lights[0] = Light::Point { position: DVec3::ZERO, color: [f32::NAN; 3], intensity: 1.0 };
    });
    check("light 1: position", &|scene, _| {
        scene.lights.push(Light::Point { position: DVec3::NAN, color: [1.0; 3], intensity: 1.0 });
    });
    check("ambient", &|scene, _| scene.ambient[1] = -1.0);
    check("background", &|scene, _| scene.background[3] = 2.0);
    check("triangles", &|scene, _| scene.draws[0].triangles = 1..9);
    check("inverse", &|scene, _| scene.draws[0].world_from_object = DMat4::ZERO);
    check("last row", &|scene, _| scene.draws[0].world_from_object.x_axis.w = 0.5);
    check("inverse", &|scene, _| {
        scene.draws[0].world_from_object = DMat4::from_scale(DVec3::new(1.0, f64::NAN, 1.0))
    });
}

#[test]
fn senseless_materials_and_meshes_are_named() {
    let Some(device) = common::device() else { return };
    let request = Request::new(TechniqueChoice::named("relief").unwrap(), 16, 16);
    let check = |expected: &str, change: &dyn Fn(&mut Mesh, &mut Material)| {
        let mut mesh = Mesh::quad(1.0).unwrap();
        let mut material = Material::new(Arc::new(field(fbm, [16, 16], Wrap::Repeat, Extent::default())));
        change(&mut mesh, &mut material);
        let scene = Scene {
            draws: vec![Draw::new(&mesh, &material)],
            camera: front(),
            lights: vec![],
            ambient: [0.1; 3],
            background: [0.0; 4],
        };
        let message = render::render(&device, &scene, &request).unwrap_err().to_string();
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
    };
    check("4 positions but 3 normals", &|mesh, _| mesh.normals.truncate(3));
    check("vertex 7 of 4", &|mesh, _| mesh.indices[1][2] = 7);
    check("vertex 2", &|mesh, _| mesh.positions[2].y = f32::NAN);
    check("specular", &|_, material| material.specular = 1.5);
    check("shininess", &|_, material| material.shininess = f32::NAN);
    check("albedo factor", &|_, material| material.albedo_factor[0] = f32::INFINITY);
    let grey = || Some(Arc::new(Image::new(1, 1, 1, Samples::U8(vec![1])).unwrap()));
    check("normal map has 1 channels", &|_, material| material.normal = grey());
}

#[test]
fn odd_scenes_are_fine() {
    let Some(device) = common::device() else { return };
    let mut mesh = Mesh::quad(1.0).unwrap();
    // No texture mapping at all, and normals of no length.
    for uv in &mut mesh.uvs {
        *uv = glam::Vec2::ZERO;
    }
    mesh.dpdu.fill(Vec3::ZERO);
    mesh.dpdv.fill(Vec3::ZERO);
    mesh.normals.fill(Vec3::ZERO);
    mesh.tangents.fill(glam::Vec4::ZERO);
    for extent in [
        Extent::default(),
        Extent { scale: 0.0, base: 0.0, tile_size: [1e-6, 1e6] },
        Extent { scale: 1e6, base: 0.5, tile_size: [1.0; 2] },
    ] {
        let material = Material::new(Arc::new(field(fbm, [1, 1], Wrap::Clamp, extent)));
        for technique in TechniqueChoice::names() {
            let scene = Scene {
                draws: vec![Draw::new(&mesh, &material)],
                camera: front(),
                lights: vec![],
                ambient: [0.5; 3],
                background: [0.0; 4],
            };
            let request = Request {
                aovs: render::AovSet::ALL,
                ..Request::new(TechniqueChoice::named(technique).unwrap(), 17, 17)
            };
            let frame = render::render(&device, &scene, &request).unwrap();
            let aovs = &frame.aovs;
            for values in [&aovs.uv, &aovs.position, &aovs.normal, &aovs.height, &aovs.shadow] {
                let bad = values.as_ref().unwrap().iter().position(|value| !value.is_finite());
                assert_eq!(bad, None, "{technique} {extent:?}");
            }
        }
    }
    let empty = Scene {
        draws: vec![],
        camera: front(),
        lights: vec![],
        ambient: [0.0; 3],
        background: [1.0, 0.0, 0.0, 1.0],
    };
    let frame = render::render(&device, &empty, &Request::new(TechniqueChoice::named("flat").unwrap(), 3, 2))
        .unwrap();
    assert_eq!(frame.color, [255, 0, 0, 255].repeat(6));
}

#[test]
fn too_large_maps_are_refused_not_tried() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    let long = field(|u, _| u, [65_536, 1], Wrap::Repeat, Extent::default());
    let material = Material::new(Arc::new(long));
    let scene = Scene {
        draws: vec![Draw::new(&mesh, &material)],
        camera: front(),
        lights: vec![],
        ambient: [0.5; 3],
        background: [0.0; 4],
    };
    match render::render(&device, &scene, &Request::new(TechniqueChoice::named("bump").unwrap(), 8, 8)) {
        Ok(_) => (),
        Err(RenderError::Limit { got, .. }) => assert_eq!(got, 65_536),
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn an_unknown_adapter_or_technique_lists_the_known() {
    if common::device().is_none() {
        return;
    }
    let error =
        Device::open(&DeviceOptions { adapter: Some("no such card".to_owned()), ..Default::default() })
            .unwrap_err();
    let message = error.to_string();
    let first = &render::adapters()[0].name;
    assert!(message.contains("no such card") && message.contains(first), "{message}");
    let message = TechniqueChoice::named("reliefs").unwrap_err().to_string();
    assert!(message.contains("flat, bump") && message.contains("exact"), "{message}");
}

/// Run by the test below in a process that finds no driver.
#[test]
#[ignore = "run by without_a_driver_the_error_says_what_to_install"]
fn child_without_a_driver() {
    println!("answer: {}", render::device().unwrap_err());
}

#[test]
fn without_a_driver_the_error_says_what_to_install() {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "child_without_a_driver", "--nocapture"])
        .env("VK_ICD_FILENAMES", "/nonexistent/driver.json")
        .env("VK_DRIVER_FILES", "/nonexistent/driver.json")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}");
    assert!(
        text.contains("answer: ") && text.contains("apt-get install mesa-vulkan-drivers libvulkan1"),
        "{text}"
    );
}

#[test]
fn many_threads_share_the_device() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    let material = Material::new(Arc::new(field(fbm, [64, 64], Wrap::Repeat, Extent::default())));
    let scene = Scene {
        draws: vec![Draw::new(&mesh, &material)],
        camera: front(),
        lights: vec![sun(Vec3::NEG_Z)],
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    let request = Request::new(TechniqueChoice::named("relief").unwrap(), 40, 40);
    let expected = render::render(&device, &scene, &request).unwrap().color;
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4)
            .map(|_| {
                scope.spawn(|| {
                    (0..5).all(|_| render::render(&device, &scene, &request).unwrap().color == expected)
                })
            })
            .collect();
        for thread in threads {
            assert!(thread.join().unwrap());
        }
    });
}
