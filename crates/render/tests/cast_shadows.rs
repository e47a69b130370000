//! Shadows that meshes throw on each other, against rays through the displaced surfaces in double precision.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::agree::{from, show, specks};
use common::shapes::{LIGHT, SIZE, heights, scene_picture};
use common::truth::Truth;
use glam::{DMat4, DQuat, DVec3, Vec3};
use heightfield::HeightField;
use mesh::Mesh;
use render::{Draw, Frame, Material};

/// A mesh in the scene: how it looks, and where it stands.
struct Part {
    mesh: Mesh,
    field: Arc<HeightField>,
    place: DMat4,
}

/// A ball with bumps above a plate with bumps, pressed flat, turned and mirrored, and a bare block beside it.
fn parts() -> Vec<Part> {
    let pressed = DMat4::from_scale_rotation_translation(
        DVec3::new(1.1, -0.8, 0.9),
        DQuat::from_rotation_y(0.6),
        DVec3::new(-0.1, 0.1, 0.45),
    );
    let aside = DMat4::from_scale_rotation_translation(
        DVec3::new(0.5, 0.5, 1.5),
        DQuat::from_rotation_z(0.4),
        DVec3::new(0.45, -0.35, 0.2),
    );
    vec![
        Part { mesh: Mesh::quad(1.8).unwrap(), field: heights([48, 48], 0.06, 0.0), place: DMat4::IDENTITY },
        Part { mesh: Mesh::sphere(0.25, 24).unwrap(), field: heights([64, 32], 0.06, 0.5), place: pressed },
        Part { mesh: Mesh::cube(0.4).unwrap(), field: heights([8, 8], 0.0, 0.0), place: aside },
    ]
}

#[test]
fn reliefs_and_bare_meshes_shade_each_other() {
    let Some(device) = common::device() else { return };
    let parts = parts();
    let materials: Vec<_> = parts.iter().map(|part| Material::new(Arc::clone(&part.field))).collect();
    let judges: Vec<_> = parts.iter().map(|part| Truth::new(&part.mesh, &part.field)).collect();
    let blocked_by = |at: usize, place: DVec3, to_light: DVec3| {
        let inverse = parts[at].place.inverse();
        let direction = inverse.transform_vector3(to_light).normalize();
        judges[at].blocked(inverse.transform_point3(place), direction, 2e-4)
    };
    let camera = from([0.5, -1.2, 1.7]);
    let to_light = -LIGHT.as_dvec3().normalize();
    let pictures = [("exact", true), ("displacement", false)].map(|(technique, silhouettes)| {
        let draws = parts.iter().zip(&materials).map(|(part, material)| Draw {
            world_from_object: part.place,
            ..Draw::new(&part.mesh, material)
        });
        let draws: Vec<_> = draws.collect();
        let frame = scene_picture(&device, draws, camera, technique, silhouettes);
        show(&frame, &format!("cast_{technique}"));
        (technique, frame)
    });
    let exact = &pictures[0].1;
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let place = |frame: &Frame, at: usize| {
        Vec3::from_slice(&frame.aovs.position.as_ref().unwrap()[3 * at..]).as_dvec3()
    };
    let blocked: Vec<Option<[(bool, bool); 3]>> = (0..pixels)
        .map(|at| {
            let normal = Vec3::from_slice(&exact.aovs.normal.as_ref().unwrap()[3 * at..]).as_dvec3();
            let seen = exact.aovs.mask.as_ref().unwrap()[at] == 1 && normal.dot(to_light) > 0.15;
            seen.then(|| {
                [0, 1, 2].map(|part| {
                    // What is in the way within a texel may be a crease of the bilinear surface.
                    let start = place(exact, at) + normal * 2e-4;
                    let [near, far] = [0.0, 0.03].map(|on| blocked_by(part, start + to_light * on, to_light));
                    (near, near == far)
                })
            })
        })
        .collect();
    for (technique, frame) in &pictures {
        let (mask, shadow) = (frame.aovs.mask.as_ref().unwrap(), frame.aovs.shadow.as_ref().unwrap());
        let (mut seen, mut by_others, mut alone) = (0, 0, 0);
        let mut wrong = vec![false; pixels];
        for (at, blocked) in blocked.iter().enumerate() {
            let Some(blocked) = blocked else { continue };
            // Micro-polygons show another place where edges in depth are.
            if mask[at] == 0 || place(frame, at).distance(place(exact, at)) > 0.02 {
                continue;
            }
            let [plate, ball, block] = blocked.map(|(blocked, _)| blocked);
            let clear = blocked.iter().all(|(_, clear)| *clear);
            seen += 1;
            by_others += usize::from(ball || block);
            // The plate stands first: without the others it would be lit.
            alone += usize::from(!plate && shadow[at] > 0.5);
            wrong[at] = clear && (plate || ball || block) != (shadow[at] > 0.5);
        }
        let count = wrong.iter().filter(|wrong| **wrong).count();
        let specks = specks(shadow, &wrong, SIZE);
        println!("{technique}: {seen} pixels, {by_others} shaded, {count} wrong, {specks} of them alone");
        assert!(seen > 3000 && by_others > 500 && alone > 300, "{technique}: {seen} {by_others} {alone}");
        assert!(count * 100 < seen && specks == 0, "{technique}: {count} of {seen}, {specks} alone");
    }
}
