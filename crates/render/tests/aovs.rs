//! Outputs against closed forms on a flat quad, and against the Rust twins of surfaces and searches.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::{fbm, field, front, mesh_of, sun};
use glam::{DMat4, DVec2, DVec3, Quat, Vec2, Vec3};
use heightfield::{Extent, HeightField, Technique, Wrap};
use mesh::Mesh;
use render::surface::{self, SurfaceFrame};
use render::{AovSet, Camera, Draw, Frame, Material, Request, Scene, TechniqueChoice};

fn scene<'a>(mesh: &'a Mesh, material: &'a Material, camera: Camera) -> Scene<'a> {
    Scene {
        draws: vec![Draw::new(mesh, material)],
        camera,
        lights: vec![sun(Vec3::new(0.4, -0.5, -1.0))],
        ambient: [0.1; 3],
        background: [0.0; 4],
    }
}

fn all(technique: &str, width: u32, height: u32) -> Request {
    Request { aovs: AovSet::ALL, ..Request::new(TechniqueChoice::named(technique).unwrap(), width, height) }
}

fn vec3(values: &Option<Vec<f32>>, at: usize) -> Vec3 {
    Vec3::from_slice(&values.as_ref().unwrap()[3 * at..])
}

fn uv(frame: &Frame, at: usize) -> Vec2 {
    Vec2::from_slice(&frame.aovs.uv.as_ref().unwrap()[2 * at..])
}

/// Pixels that show a mesh.
fn covered(frame: &Frame) -> Vec<usize> {
    let mask = frame.aovs.mask.as_ref().unwrap();
    (0..mask.len()).filter(|&at| mask[at] == 1).collect()
}

#[test]
fn a_flat_quad_gives_closed_forms_at_any_width() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    let extent = Extent { scale: 0.2, base: 1.0, tile_size: [1.0, 1.0] };
    let material = Material::new(Arc::new(field(|_, _| 0.25, [8, 8], Wrap::Repeat, extent)));
    let camera = Camera::look_at(DVec3::new(0.7, -0.4, 1.6), DVec3::new(0.05, 0.1, 0.0));
    for technique in ["flat", "bump", "normal", "dot3", "relief", "exact"] {
        // A relief of constant height 0.25, carved in, is a plane 0.15 below the quad.
        let displaced = TechniqueChoice::named(technique).unwrap().displaces();
        let z = if displaced { -0.15 } else { 0.0 };
        for size in [[64, 64], [61, 37], [1, 1], [130, 3]] {
            let frame =
                render::render(&device, &scene(&mesh, &material, camera), &all(technique, size[0], size[1]))
                    .unwrap();
            assert_eq!(frame.color.len(), 4 * (size[0] * size[1]) as usize);
            for at in covered(&frame) {
                let (x, y) = (at as u32 % size[0], at as u32 / size[0]);
                let direction = camera.direction(size, x, y).as_dvec3();
                let t = (z - camera.eye.z) / direction.z;
                let expected = camera.eye + direction * t;
                let position = vec3(&frame.aovs.position, at).as_dvec3();
                let label = format!("{technique} {size:?} pixel {x}, {y}");
                let tolerance = if technique == "relief" { 3e-4 } else { 2e-5 };
                assert!(position.distance(expected) < tolerance, "{label}: {position} expected {expected}");
                let depth = f64::from(frame.aovs.depth.as_ref().unwrap()[at]);
                assert!(
                    (depth - (expected - camera.eye).dot(camera.forward())).abs() < tolerance,
                    "{label}: depth"
                );
                let expected_uv = DVec3::new(expected.x + 0.5, 0.5 - expected.y, 0.0).as_vec3().truncate();
                assert!(
                    uv(&frame, at).distance(expected_uv) < tolerance as f32,
                    "{label}: uv {}",
                    uv(&frame, at)
                );
                assert!(vec3(&frame.aovs.normal, at).distance(Vec3::Z) < 0.01, "{label}: normal");
                let height = frame.aovs.height.as_ref().unwrap()[at];
                let expected_height = if displaced { 0.25 } else { 1.0 };
                assert!((height - expected_height).abs() < 2e-3, "{label}: height {height}");
            }
            if size == [64, 64] {
                assert!(covered(&frame).len() > 600, "{technique}: {} pixels", covered(&frame).len());
                assert_eq!(frame.stats.pixels_covered, covered(&frame).len() as u64);
                let outside = frame.aovs.mask.as_ref().unwrap().iter().position(|m| *m == 0).unwrap();
                assert_eq!(frame.aovs.depth.as_ref().unwrap()[outside], f32::INFINITY);
                assert_eq!(vec3(&frame.aovs.position, outside), Vec3::ZERO);
            }
        }
    }
}

#[test]
fn bands_make_no_difference() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::sphere(0.7, 32).unwrap();
    let material = Material::new(Arc::new(field(fbm, [64, 64], Wrap::Repeat, Extent::default())));
    let scene = scene(&mesh, &material, front());
    let request = all("relief", 61, 47);
    let whole = render::render(&device, &scene, &request).unwrap();
    for band in [1, 61 * 7, 61 * 40] {
        let banded = render::render_in_bands(&device, &scene, &request, band).unwrap();
        let differing = whole.color.iter().zip(&banded.color).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        assert!(differing < whole.color.len() / 200, "bands of {band} pixels: {differing} differ");
        assert_eq!(whole.stats.pixels_covered, banded.stats.pixels_covered);
    }
}

/// The rays that the pixels marched, searched again on the CPU, end where the picture says.
#[test]
fn pictures_agree_with_the_searches() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    let extent = Extent { scale: 0.15, base: 0.6, tile_size: [1.0, 1.0] };
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let field = Arc::new(field(fbm, [128, 96], wrap, extent));
        let material = Material::new(Arc::clone(&field));
        let camera = Camera::look_at(DVec3::new(0.2, -1.1, 0.7), DVec3::new(0.0, 0.0, 0.0));
        for info in Technique::all() {
            let frame =
                render::render(&device, &scene(&mesh, &material, camera), &all(info.name, 121, 90)).unwrap();
            let technique = Technique::named(info.name).unwrap();
            let mut errors: Vec<f32> = covered(&frame)
                .into_iter()
                .map(|at| {
                    let (start, delta) = (vec3(&frame.aovs.ray_start, at), vec3(&frame.aovs.ray_delta, at));
                    let cosine = field.extent().cos_theta(delta.as_dvec3().to_array());
                    let found = technique.search(&field, start, delta, cosine);
                    let hit = (start + delta * found.tau).truncate();
                    let seen = uv(&frame, at);
                    let off = seen - hit;
                    // Whole periods are taken off the ray.
                    ((off - off.round()) * Vec2::new(128.0, 96.0)).length()
                })
                .collect();
            errors.sort_by(f32::total_cmp);
            let p99 = errors[errors.len() * 99 / 100];
            println!("{} {wrap:?}: {} pixels, p99 {p99} texels", info.name, errors.len());
            assert!(errors.len() > 2000 && p99 < 0.01, "{} {wrap:?}: p99 {p99} texels", info.name);
        }
    }
}

/// A sheared, stretched and turned quad: neither orthogonal nor of the tile's size.
fn sheared() -> (Mesh, SurfaceFrame) {
    let turn = Quat::from_euler(glam::EulerRot::YXZ, 0.4, -0.3, 0.2);
    let (along_u, along_v) = (turn * Vec3::new(1.2, 0.3, 0.0), turn * Vec3::new(0.25, -0.8, 0.0));
    let normal = turn * Vec3::Z;
    let corner = |u: f32, v: f32| along_u * (u - 0.5) + along_v * (v - 0.5);
    let positions = [corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0), corner(1.0, 0.0)];
    let uvs = [Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X];
    let mesh = mesh_of(&positions, &[normal; 4], &uvs, &[[0, 1, 2], [0, 2, 3]]);
    let frame =
        SurfaceFrame { dpdu: along_u.as_dvec3(), dpdv: along_v.as_dvec3(), normal: normal.as_dvec3() };
    (mesh, frame)
}

fn worst_angle(frame: &Frame, mut expected: impl FnMut(usize) -> DVec3) -> f32 {
    let angles = covered(frame)
        .into_iter()
        .map(|at| vec3(&frame.aovs.normal, at).angle_between(expected(at).as_vec3()));
    let mut angles: Vec<f32> = angles.collect();
    assert!(angles.len() > 5000, "{} pixels", angles.len());
    angles.sort_by(f32::total_cmp);
    angles[angles.len() * 999 / 1000].to_degrees()
}

#[test]
fn surfaces_agree_with_their_twins() {
    let Some(device) = common::device() else { return };
    let (mesh, frame_of_mesh) = sheared();
    let camera = Camera::look_at(DVec3::new(0.1, 0.1, 1.5), DVec3::ZERO);
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let extent = Extent { scale: 0.1, base: 1.0, tile_size: [1.0, 1.0] };
        let field: Arc<HeightField> = Arc::new(field(|u, v| fbm(u * 0.8, v), [32, 24], wrap, extent));
        let slopes = bake::slopes(&field, bake::Kernel::Central, bake::Progress::none()).unwrap();
        let material = Material::new(Arc::clone(&field));
        let scene = scene(&mesh, &material, camera);
        let picture = |technique| render::render(&device, &scene, &all(technique, 151, 131)).unwrap();

        let flat = picture("flat");
        let worst = worst_angle(&flat, |_| surface::flat(&frame_of_mesh));
        assert!(worst < 0.1, "flat {wrap:?}: {worst} degrees");

        let reach = Vec2::new(1.0 / 32.0, 1.0 / 24.0);
        // The quad is flat: what bends with the mesh is tested on sphere and torus.
        let bend = [DVec3::ZERO; 2];
        let twins: [(&str, &dyn Fn(Vec2) -> DVec3); 5] = [
            ("bump", &|uv| surface::bump(&field, &frame_of_mesh, uv, reach)),
            ("bump_forward", &|uv| surface::bump_forward(&field, &frame_of_mesh, uv, reach)),
            ("bump_orthogonal", &|uv| surface::bump_orthogonal(&field, &frame_of_mesh, uv, reach)),
            ("bump_blinn", &|uv| surface::bump_blinn(&field, &frame_of_mesh, uv, reach)),
            ("bump_exact", &|uv| surface::bump_exact(&field, &frame_of_mesh, bend, uv, reach)),
        ];
        for (technique, twin) in twins {
            let frame = picture(technique);
            let worst = worst_angle(&frame, |at| twin(uv(&frame, at)));
            println!("{technique} {wrap:?}: {worst} degrees");
            assert!(worst < 0.1, "{technique} {wrap:?}: {worst} degrees");
        }
        // Any two derivatives along the surface will do: those of a screen that is the mapping itself.
        let axes = [frame_of_mesh.dpdu, frame_of_mesh.dpdv];
        let screen = surface::ScreenDerivatives { position: axes, uv: [DVec2::X, DVec2::Y] };
        let frame = picture("bump_derivative");
        let normal = frame_of_mesh.normal;
        let worst = worst_angle(&frame, |at| {
            surface::bump_derivative(&field, normal, &screen, uv(&frame, at), reach)
        });
        println!("bump_derivative {wrap:?}: {worst} degrees");
        assert!(worst < 0.1, "bump_derivative {wrap:?}: {worst} degrees");
        // Negative control: the twin of another formula is told apart.
        let wrong =
            worst_angle(&frame, |at| surface::bump_orthogonal(&field, &frame_of_mesh, uv(&frame, at), reach));
        assert!(wrong > 0.5, "{wrong} degrees");

        for technique in ["normal", "exact"] {
            let frame = picture(technique);
            let worst =
                worst_angle(&frame, |at| surface::normal(&field, &slopes, &frame_of_mesh, uv(&frame, at)));
            println!("{technique} {wrap:?}: {worst} degrees");
            assert!(worst < 0.25, "{technique} {wrap:?}: {worst} degrees");
        }
    }
}

#[test]
fn dot3_agrees_with_its_twin() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    let field = Arc::new(field(fbm, [32, 32], Wrap::Repeat, Extent::default()));
    let material = Material::new(Arc::clone(&field));
    let camera = front();
    let mut scene = scene(&mesh, &material, camera);
    scene.ambient = [0.0; 3];
    scene.lights = vec![render::Light::Directional {
        direction: Vec3::new(0.5, -0.7, -1.0),
        color: [1.0; 3],
        intensity: 1.0,
    }];
    let frame = render::render(&device, &scene, &all("dot3", 200, 200)).unwrap();
    let to_light = -Vec3::new(0.5, -0.7, -1.0).normalize();
    for at in covered(&frame) {
        let normal = vec3(&frame.aovs.normal, at);
        let expected = surface::dot3(0.5 * normal + 0.5, 0.5 * to_light + 0.5);
        let shown = render::texture::linear_from_srgb(f32::from(frame.color[4 * at]) / 255.0);
        // Filtered 8-bit normals are shorter than 1, and each of three registers is rounded.
        assert!((shown - expected).abs() < 0.03, "pixel {at}: {shown} expected {expected}");
    }
}

#[test]
fn far_from_the_origin_nothing_changes() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    let material = Material::new(Arc::new(field(fbm, [64, 64], Wrap::Repeat, Extent::default())));
    let near = scene(&mesh, &material, front());
    let mut far = near.clone();
    let offset = DVec3::new(16_777_216.0, -8_388_608.0, 4_194_304.0);
    far.draws[0].world_from_object = DMat4::from_translation(offset);
    far.camera.eye += offset;
    far.camera.target += offset;
    let request = all("relief", 96, 96);
    let (near, far) =
        (render::render(&device, &near, &request).unwrap(), render::render(&device, &far, &request).unwrap());
    assert_eq!(near.color, far.color);
    // The mesh's own coordinates may be far off as well.
    let mut shifted = Mesh::quad(1.0).unwrap();
    let offset = DVec3::new(65536.0, -32768.0, 16384.0);
    for position in &mut shifted.positions {
        *position += offset.as_vec3();
    }
    let mut moved = scene(&shifted, &material, front());
    moved.camera.eye += offset;
    moved.camera.target += offset;
    let moved = render::render(&device, &moved, &request).unwrap();
    let differing = near.color.iter().zip(&moved.color).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(differing < near.color.len() / 100, "{differing} differ");
}
