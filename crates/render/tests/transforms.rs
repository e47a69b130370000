//! Placed objects against rays through the displaced surface in double precision, taken back into the object's own
//! space: the relief of a stretched object is stretched along.
//!
//! `cargo test -p render --release --test transforms -- --nocapture` prints the table of docs/scenes.md.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::agree::{Agreement, agreement, from, row, show};
use common::shapes::{SIZE, heights, scene_picture, shapes};
use common::truth::{Hit, Truth};
use glam::{DMat3, DMat4, DQuat, DVec3};
use mesh::Mesh;
use render::{Camera, Draw, Frame, Material};

/// Name and transform.
fn places() -> [(&'static str, DMat4); 6] {
    let turn = DMat4::from_quat(DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 1.1));
    let scale = |x, y, z| DMat4::from_scale(DVec3::new(x, y, z));
    let mut shear = DMat4::IDENTITY;
    shear.y_axis.x = 0.6;
    [
        ("turned", turn),
        ("half", scale(0.5, 0.5, 0.5)),
        ("stretched", turn * scale(1.3, 0.7, 0.5)),
        ("mirrored", turn * scale(-1.2, 0.6, 0.9)),
        ("sheared", shear * turn),
        ("needle", turn * scale(1.0, 0.01, 0.01)),
    ]
}

/// What a camera sees of a placed object.
fn truth(mesh: &Mesh, material: &Material, place: DMat4, camera: &Camera) -> Vec<Option<Hit>> {
    let judge = Truth::new(mesh, &material.field);
    let object_from_world = place.inverse();
    let eye = object_from_world.transform_point3(camera.eye);
    let [corner, right, down] =
        camera.pixel_directions(SIZE, 0).map(|way| object_from_world.transform_vector3(way));
    (0..SIZE[0] * SIZE[1])
        .map(|at| {
            let (x, y) = (f64::from(at % SIZE[0]) + 0.5, f64::from(at / SIZE[0]) + 0.5);
            let hit = judge.first_hit(eye, corner + right * x + down * y)?;
            Some(Hit { position: place.transform_point3(hit.position), ..hit })
        })
        .collect()
}

fn shot(
    device: &render::Device,
    mesh: &Mesh,
    material: &Material,
    place: DMat4,
    camera: Camera,
    way: (&str, bool),
) -> Frame {
    let draw = Draw { world_from_object: place, ..Draw::new(mesh, material) };
    scene_picture(device, vec![draw], camera, way.0, way.1)
}

#[test]
fn placed_reliefs_are_displaced_objects_as_they_stand() {
    let Some(device) = common::device() else { return };
    println!(
        "| object | base | pixels | outline off | place p99, pixels | off by a pixel | uv p99, texels | depth p99 |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let [_, _, (_, ball, texels, _), (_, ring, ..)] = shapes();
    let material = Material::new(heights(texels, 0.08, 0.5));
    for (name, place) in places() {
        let mesh = if name == "sheared" { &ring } else { &ball };
        let eye = if name == "needle" { [0.05, 0.1, 0.6] } else { [0.3, 0.6, 1.6] };
        let camera = from(eye);
        let expected = truth(mesh, &material, place, &camera);
        for way in [("exact", true), ("displacement", false)] {
            let frame = shot(&device, mesh, &material, place, camera, way);
            show(&frame, &format!("{name}_{}", way.0));
            let found = agreement(&frame, &expected, &camera, texels);
            row(&format!("{name}, {}", way.0), 0.5, &found);
            assert!(found.both > if name == "needle" { 50 } else { 1000 }, "{name}: {found:?}");
            assert!(found.outline_off.is_empty(), "{name}: {found:?}");
            assert!(found.place_p99 < 0.1 && found.depth_p99 < 5e-4, "{name} {way:?}: {found:?}");
            assert!(
                found.texels_p99 < if name == "needle" { 2.0 } else { 0.12 },
                "{name} {way:?}: {found:?}"
            );
        }
        // Against another object the judge must complain.
        let larger = DMat4::from_scale(DVec3::splat(if name == "needle" { 3.0 } else { 1.02 }));
        let other = shot(&device, mesh, &material, place * larger, camera, ("exact", true));
        let Agreement { place_p99, outline_off, .. } = agreement(&other, &expected, &camera, texels);
        assert!(place_p99 > 0.3 || !outline_off.is_empty(), "{name}");
    }
}

#[test]
fn normals_of_stretched_objects_stand_on_their_surface() {
    let Some(device) = common::device() else { return };
    let [_, _, (_, ball, texels, _), _] = shapes();
    let flat = Material::new(heights(texels, 0.0, 0.5));
    for (name, place) in places() {
        if name == "needle" {
            continue;
        }
        let frame = shot(&device, &ball, &flat, place, from([0.3, 0.6, 1.6]), ("flat", false));
        let mask = frame.aovs.mask.as_ref().unwrap();
        let (positions, normals) =
            (frame.aovs.position.as_ref().unwrap(), frame.aovs.normal.as_ref().unwrap());
        let back = DMat3::from_mat4(place).inverse();
        let mut worst = 1.0_f64;
        for at in (0..mask.len()).filter(|&at| mask[at] == 1) {
            let point = DVec3::new(
                f64::from(positions[3 * at]),
                f64::from(positions[3 * at + 1]),
                f64::from(positions[3 * at + 2]),
            );
            let normal = DVec3::new(
                f64::from(normals[3 * at]),
                f64::from(normals[3 * at + 1]),
                f64::from(normals[3 * at + 2]),
            );
            // Of the ellipsoid |back * p| = r.
            let expected = (back.transpose() * (back * point)).normalize();
            worst = worst.min(expected.dot(normal));
        }
        assert!(worst > 0.999, "{name}: {} degrees", worst.acos().to_degrees());
    }
}
