//! Shadows that displaced meshes throw on themselves, against rays through the displaced surface in double precision.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::agree::{from, show};
use common::light::{TEXEL, certain};
use common::shapes::{LIGHT, LOW_LIGHT, SIZE, heights, picture_under, shapes};
use common::truth::{Hit, Truth};
use glam::Vec3;
use render::{Draw, Frame, Material};

/// Rays through the shell are at most 0.02 texels off.
const OFF: f64 = 0.02 * TEXEL;

/// Pixels that the light does not only graze, those of them in shadow, and those that are shown wrongly.
fn judged(
    frame: &Frame,
    truth: &[Option<Hit>],
    judge: &Truth<'_>,
    light: Vec3,
) -> (usize, usize, Vec<usize>) {
    let (shadow, normals) = (frame.aovs.shadow.as_ref().unwrap(), frame.aovs.normal.as_ref().unwrap());
    let to_light = -light.as_dvec3().normalize();
    let (mut seen, mut dark, mut wrong) = (0, 0, Vec::new());
    for (at, hit) in truth.iter().enumerate() {
        let normal = Vec3::from_slice(&normals[3 * at..]).as_dvec3();
        let (Some(hit), true) = (hit, normal.dot(to_light) > 0.1) else { continue };
        seen += 1;
        let blocked = judge.blocked(hit.position, to_light, 1e-5);
        dark += usize::from(blocked);
        if blocked != (shadow[at] > 0.5)
            && certain(normal, to_light, OFF, |way, clear| judge.blocked(hit.position, way, clear)).is_some()
        {
            wrong.push(at);
        }
    }
    (seen, dark, wrong)
}

#[test]
fn shadows_in_the_shell_are_those_of_the_displaced_surface() {
    let Some(device) = common::device() else { return };
    for (name, mesh, texels, eye) in shapes() {
        for base in [0.0, 1.0] {
            let field = heights(texels, 0.08, base);
            let (camera, material) = (from(eye), Material::new(std::sync::Arc::clone(&field)));
            let judge = Truth::new(&mesh, &field);
            let truth = judge.picture(&camera, SIZE);
            for (sun, light) in [("high", LIGHT), ("low", LOW_LIGHT)] {
                let draws = vec![Draw::new(&mesh, &material)];
                let frame = picture_under(&device, light, draws, camera, "exact", true);
                show(&frame, &format!("shadows_{name}_{base}_{sun}"));
                let (seen, dark, wrong) = judged(&frame, &truth, &judge, light);
                println!("{name} {base} {sun}: {dark} of {seen} pixels in shadow, {} wrong", wrong.len());
                let enough = if sun == "low" { 40 } else { 0 };
                assert!(seen > 1500 && dark >= enough, "{name} {base} {sun}: {dark} of {seen}");
                assert!(wrong.is_empty(), "{name} {base} {sun}: pixels {wrong:?}");
            }
        }
    }
}

/// Shadows of a sun that stands elsewhere must be found out.
#[test]
fn shadows_of_another_sun_are_noticed() {
    let Some(device) = common::device() else { return };
    let (_, mesh, texels, eye) = shapes().into_iter().next().unwrap();
    let (field, camera) = (heights(texels, 0.08, 0.0), from(eye));
    let (judge, material) = (Truth::new(&mesh, &field), Material::new(std::sync::Arc::clone(&field)));
    let truth = judge.picture(&camera, SIZE);
    let frame = picture_under(&device, LOW_LIGHT, vec![Draw::new(&mesh, &material)], camera, "exact", true);
    let elsewhere = Vec3::new(-0.95, -0.45, -0.21);
    let (_, _, wrong) = judged(&frame, &truth, &judge, elsewhere);
    assert!(wrong.len() > 100, "{}", wrong.len());
}
