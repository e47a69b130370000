//! What pictures must show: right side up, not mirrored, lit from where the light is.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use bake::{Image, Samples};
use common::{fbm, field, front, mesh_of, sun};
use glam::{DMat4, DVec3, Vec2, Vec3};
use heightfield::{Extent, Wrap};
use mesh::Mesh;
use render::{AovSet, Camera, Draw, Frame, Light, Material, Request, Scene, TechniqueChoice};

const SIDE: u32 = 96;

fn dome() -> Material {
    let height = |u: f64, v: f64| {
        let d2 = (u - 0.5).powi(2) + (v - 0.5).powi(2);
        (1.0 - d2 / 0.09).max(0.0).sqrt() * 0.8
    };
    Material::new(Arc::new(field(
        height,
        [128, 128],
        Wrap::Repeat,
        Extent { scale: 0.2, base: 1.0, tile_size: [1.0; 2] },
    )))
}

fn scene<'a>(mesh: &'a Mesh, material: &'a Material, light: Vec3) -> Scene<'a> {
    Scene {
        draws: vec![Draw::new(mesh, material)],
        camera: front(),
        lights: vec![sun(light)],
        ambient: [0.02; 3],
        background: [0.0, 0.0, 0.0, 1.0],
    }
}

fn shot(device: &render::Device, scene: &Scene<'_>, technique: &str) -> Frame {
    let request = Request {
        shadows: Some(false),
        aovs: AovSet::MASK | AovSet::POSITION,
        ..Request::new(TechniqueChoice::named(technique).unwrap(), SIDE, SIDE)
    };
    render::render(device, scene, &request).unwrap()
}

/// Mean brightness of the pixels for which `which(x, y)`, x and y in 0..1 from the upper left.
fn brightness(frame: &Frame, which: impl Fn(f32, f32) -> bool) -> f32 {
    let (mut sum, mut count) = (0.0, 0.0);
    for at in 0..(frame.width * frame.height) as usize {
        let x = (at % frame.width as usize) as f32 / frame.width as f32;
        let y = (at / frame.width as usize) as f32 / frame.height as f32;
        if which(x, y) {
            sum += f32::from(frame.color[4 * at])
                + f32::from(frame.color[4 * at + 1])
                + f32::from(frame.color[4 * at + 2]);
            count += 3.0;
        }
    }
    sum / count
}

#[test]
fn a_dome_is_bright_where_the_light_comes_from() {
    let Some(device) = common::device() else { return };
    let (mesh, material) = (Mesh::quad(1.2).unwrap(), dome());
    for technique in TechniqueChoice::names().filter(|name| *name != "flat") {
        let near = |x: f32, y: f32| (x - 0.5).hypot(y - 0.5) < 0.14;
        let left = shot(&device, &scene(&mesh, &material, Vec3::new(1.0, 0.0, -0.5)), technique);
        let (l, r) = (
            brightness(&left, |x, y| near(x, y) && x < 0.45),
            brightness(&left, |x, y| near(x, y) && x > 0.55),
        );
        assert!(l > r + 20.0, "{technique}: lit from the left, {l} left and {r} right");
        let above = shot(&device, &scene(&mesh, &material, Vec3::new(0.0, -1.0, -0.5)), technique);
        let (t, b) = (
            brightness(&above, |x, y| near(x, y) && y < 0.45),
            brightness(&above, |x, y| near(x, y) && y > 0.55),
        );
        assert!(t > b + 20.0, "{technique}: lit from above, {t} on top and {b} below");
    }
}

#[test]
fn the_albedo_is_upright_and_not_mirrored() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.2).unwrap();
    // Red, green over blue, white.
    let texels = vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    let mut material = Material::new(Arc::new(field(|_, _| 1.0, [4, 4], Wrap::Repeat, Extent::default())));
    material.albedo = Some(Arc::new(Image::new(2, 2, 3, Samples::U8(texels)).unwrap()));
    for technique in TechniqueChoice::names() {
        let frame = shot(&device, &scene(&mesh, &material, Vec3::NEG_Z), technique);
        let pixel = |x: u32, y: u32| {
            let at = 4 * (y * SIDE + x) as usize;
            [0, 1, 2].map(|c| frame.color[at + c] > 128)
        };
        // The quad fills 0.14..0.86 of the picture; texel centres are at a quarter of it.
        let (low, high) = (31, 65);
        assert_eq!(pixel(low, low), [true, false, false], "{technique}: upper left");
        assert_eq!(pixel(high, low), [false, true, false], "{technique}: upper right");
        assert_eq!(pixel(low, high), [false, false, true], "{technique}: lower left");
        assert_eq!(pixel(high, high), [true, true, true], "{technique}: lower right");
    }
}

#[test]
fn mirrored_charts_and_transforms_keep_light_and_relief_in_place() {
    let Some(device) = common::device() else { return };
    let (mesh, material) = (Mesh::quad(1.2).unwrap(), dome());
    let uvs: Vec<Vec2> = mesh.uvs.iter().map(|uv| Vec2::new(1.0 - uv.x, uv.y)).collect();
    let mirrored = mesh_of(&mesh.positions, &mesh.normals, &uvs, &mesh.indices);
    let light = Vec3::new(1.0, -0.4, -0.7);
    for technique in TechniqueChoice::names() {
        let plain = shot(&device, &scene(&mesh, &material, light), technique);
        let chart = shot(&device, &scene(&mirrored, &material, light), technique);
        let mut turned = scene(&mesh, &material, light);
        turned.draws[0].world_from_object = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let transform = shot(&device, &turned, technique);
        for (name, frame) in [("chart", chart), ("transform", transform)] {
            // The dome is symmetric, so all pictures are the same but for rounding at its rim.
            let differing = plain.color.iter().zip(&frame.color).filter(|(a, b)| a.abs_diff(**b) > 6).count();
            // Forward differences look half a texel to the right, in the mirror to the left.
            let share = if technique == "bump_forward" { 20 } else { 60 };
            assert!(
                differing < plain.color.len() / share,
                "{technique}, mirrored {name}: {differing} differ"
            );
            assert_eq!(plain.stats.pixels_covered, frame.stats.pixels_covered, "{technique} {name}");
        }
    }
}

#[test]
fn texel_density_of_the_mesh_makes_no_difference() {
    let Some(device) = common::device() else { return };
    let material = dome();
    // Half the quad's uvs: the dome is twice as wide, so its slopes are half as steep.
    let mesh = Mesh::quad(1.2).unwrap();
    let uvs: Vec<Vec2> = mesh.uvs.iter().map(|uv| (*uv - 0.5) * 0.5 + 0.5).collect();
    let wide = mesh_of(&mesh.positions, &mesh.normals, &uvs, &mesh.indices);
    let request = |name| Request {
        aovs: AovSet::NORMAL | AovSet::UV | AovSet::MASK,
        ..Request::new(TechniqueChoice::named(name).unwrap(), 64, 64)
    };
    for (mesh, tile) in [(&mesh, 1.2), (&wide, 2.4)] {
        let scene = scene(mesh, &material, Vec3::NEG_Z);
        for technique in ["bump", "normal", "exact"] {
            let frame = render::render(&device, &scene, &request(technique)).unwrap();
            let (uv, normal) = (frame.aovs.uv.unwrap(), frame.aovs.normal.unwrap());
            let mask = frame.aovs.mask.unwrap();
            for at in (0..mask.len()).filter(|&at| mask[at] == 1) {
                let (u, v) = (uv[2 * at] - 0.5, uv[2 * at + 1] - 0.5);
                let d2 = u * u + v * v;
                if d2 > 0.05 || technique == "exact" && d2 > 0.04 {
                    continue;
                }
                let slope = -0.8 * 0.2 / 0.09 / (1.0 - d2 / 0.09).sqrt() / tile;
                let expected = Vec3::new(-slope * u, slope * v, 1.0).normalize();
                let angle = Vec3::from_slice(&normal[3 * at..]).angle_between(expected).to_degrees();
                assert!(angle < 1.5, "{technique} tile {tile} at {u}, {v}: {angle} degrees");
            }
        }
    }
}

/// A relief with a base in the middle against a quad that cuts through it.
#[test]
fn reliefs_intersect_other_geometry() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.2).unwrap();
    let steps = field(
        |u, _| if u < 0.5 { 0.1 } else { 0.9 },
        [64, 64],
        Wrap::Clamp,
        Extent { scale: 0.4, base: 1.0, tile_size: [1.2; 2] },
    );
    let relief = Material::new(Arc::new(steps));
    let flat_field =
        Arc::new(field(|_, _| 1.0, [4, 4], Wrap::Repeat, Extent { scale: 0.0, ..Extent::default() }));
    let red = Material { albedo_factor: [1.0, 0.0, 0.0, 1.0], ..Material::new(flat_field) };
    for order in [[0, 1], [1, 0]] {
        let draws = [
            Draw::new(&mesh, &relief),
            // 0.2 below the mesh: between the two levels of the relief.
            Draw {
                world_from_object: DMat4::from_translation(DVec3::new(0.0, 0.0, -0.2)),
                ..Draw::new(&mesh, &red)
            },
        ];
        let mut scene = scene(&mesh, &relief, Vec3::NEG_Z);
        scene.draws = order.map(|i| draws[i].clone()).to_vec();
        let frame = shot(&device, &scene, "exact");
        let pixel = |x: u32| frame.color[4 * (48 * SIDE + x) as usize + 1];
        assert!(pixel(30) < 20, "the red quad shows above the low part, got green {}", pixel(30));
        assert!(pixel(66) > 100, "the high part hides the red quad, got green {}", pixel(66));
    }
}

#[test]
fn shadows_fall_away_from_the_light() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.2).unwrap();
    let wall = field(
        |u, _| if (u - 0.5).abs() < 0.05 { 1.0 } else { 0.0 },
        [128, 128],
        Wrap::Clamp,
        Extent { scale: 0.15, base: 1.0, tile_size: [1.2; 2] },
    );
    let material = Material::new(Arc::new(wall));
    let scene = scene(&mesh, &material, Vec3::new(1.0, 0.0, -1.0));
    for technique in ["steep", "relief", "pom", "interval", "exact"] {
        let request = |shadows| Request {
            shadows,
            aovs: AovSet::SHADOW,
            ..Request::new(TechniqueChoice::named(technique).unwrap(), SIDE, SIDE)
        };
        let with = render::render(&device, &scene, &request(None)).unwrap();
        let without = render::render(&device, &scene, &request(Some(false))).unwrap();
        assert!(with.stats.shadow_rays > 1000 && without.stats.shadow_rays == 0, "{technique}");
        // The light travels to +X: the shadow is 0.15 wide and lies to the right of the wall.
        let right = brightness(&with, |x, y| (0.57..0.60).contains(&x) && (0.4..0.6).contains(&y));
        let left = brightness(&with, |x, y| (0.38..0.42).contains(&x) && (0.4..0.6).contains(&y));
        assert!(right < 50.0 && left > 120.0, "{technique}: {right} right and {left} left of the wall");
        // No acne: away from wall and shadow nothing is dark.
        let shadow = with.aovs.shadow.unwrap();
        let dark = (0..shadow.len()).filter(|&at| {
            let x = (at % SIDE as usize) as f32 / SIDE as f32;
            shadow[at] > 0.0 && ((0.2..0.42).contains(&x) || (0.7..0.84).contains(&x))
        });
        assert_eq!(dark.count(), 0, "{technique}: acne");
    }
    let frame = render::render(
        &device,
        &scene,
        &Request { shadows: Some(true), ..Request::new(TechniqueChoice::named("bump").unwrap(), 8, 8) },
    )
    .unwrap();
    assert!(frame.warnings.iter().any(|warning| warning.contains("bump")), "{:?}", frame.warnings);
}

#[test]
fn point_lights_fall_off_with_the_square() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(0.2).unwrap();
    let material = Material::new(Arc::new(field(|_, _| 1.0, [4, 4], Wrap::Repeat, Extent::default())));
    let mut brightness = Vec::new();
    for distance in [1.0, 2.0] {
        let mut scene = scene(&mesh, &material, Vec3::NEG_Z);
        scene.ambient = [0.0; 3];
        scene.lights =
            vec![Light::Point { position: DVec3::new(0.0, 0.0, distance), color: [1.0; 3], intensity: 0.8 }];
        let frame =
            render::render(&device, &scene, &Request::new(TechniqueChoice::named("flat").unwrap(), 33, 33))
                .unwrap();
        let middle = f32::from(frame.color[4 * (16 * 33 + 16)]) / 255.0;
        brightness.push(render::texture::linear_from_srgb(middle));
    }
    assert!((brightness[0] - 0.8).abs() < 0.01 && (brightness[1] - 0.2).abs() < 0.01, "{brightness:?}");
}

#[test]
fn the_material_s_own_normal_map_is_used_as_it_is() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    // Leaning to the upper right: x = y = 0.5.
    let z = 0.5_f32.sqrt();
    let texel = [0.5_f32, 0.5, z].map(|c| ((0.5 * c + 0.5) * 65535.0) as u16);
    let mut material = Material::new(Arc::new(field(
        fbm,
        [16, 16],
        Wrap::Repeat,
        Extent { scale: 0.01, ..Extent::default() },
    )));
    material.normal = Some(Arc::new(Image::new(1, 1, 3, Samples::U16(texel.to_vec())).unwrap()));
    for technique in ["normal", "dot3", "exact"] {
        let request = Request {
            aovs: AovSet::NORMAL,
            ..Request::new(TechniqueChoice::named(technique).unwrap(), 33, 33)
        };
        let frame = render::render(&device, &scene(&mesh, &material, Vec3::NEG_Z), &request).unwrap();
        let normal = Vec3::from_slice(&frame.aovs.normal.unwrap()[3 * (16 * 33 + 16)..]);
        assert!(normal.angle_between(Vec3::new(0.5, 0.5, z)) < 0.006, "{technique}: {normal}");
    }
}

#[test]
fn back_faces_show_only_where_asked() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    let mut material = dome();
    for double_sided in [false, true] {
        material.double_sided = double_sided;
        let mut scene = scene(&mesh, &material, Vec3::Z);
        scene.camera = Camera::look_at(DVec3::new(0.0, 0.0, -2.0), DVec3::ZERO);
        for technique in TechniqueChoice::names() {
            let frame = shot(&device, &scene, technique);
            assert_eq!(frame.stats.pixels_covered > 0, double_sided, "{technique}");
            let middle = frame.color[4 * (48 * SIDE + 48) as usize];
            assert!(!double_sided || middle > 100, "{technique}: {middle} in the middle of the lit back");
        }
    }
}
