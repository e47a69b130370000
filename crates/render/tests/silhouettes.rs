//! Relief traced through the shell against rays through the displaced surface in double precision, and against
//! displacement.
//!
//! `cargo test -p render --release --test silhouettes -- --nocapture` prints the tables of docs/displacement.md.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::agree::{agreement, as_truth, disproved, from, lost, row, show};
use common::shapes::{SIZE, heights, picture, scene_picture, shapes};
use common::truth::Truth;
use glam::{DVec3, Vec2, Vec3};
use mesh::Mesh;
use render::{Camera, Draw, Material};

#[test]
fn relief_in_the_shell_is_the_displaced_surface() {
    let Some(device) = common::device() else { return };
    println!(
        "| mesh | base | pixels | outline off | astray | place p99, pixels | off by a pixel | uv p99, texels | depth p99 |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, mesh, texels, eye) in shapes() {
        for base in [0.0, 1.0] {
            let field = heights(texels, 0.08, base);
            let camera = from(eye);
            let judge = Truth::new(&mesh, &field);
            let truth = judge.picture(&camera, SIZE);
            let frame = picture(&device, &mesh, &field, camera, "exact", true);
            show(&frame, &format!("shell_{name}_{base}"));
            let found = agreement(&frame, &truth, &camera, texels);
            row(name, base, &found);
            assert!(found.both > 1500 && found.outline_off.is_empty(), "{name} {base}: {found:?}");
            assert!(found.place_p99 < 0.06 && found.texels_p99 < 0.04, "{name} {base}: {found:?}");
            assert!(found.astray.is_empty() && found.depth_p99 < 4e-4, "{name} {base}: {found:?}");
            assert!(found.far < 0.001, "{name} {base}: {found:?}");
            assert_eq!(frame.stats.pixels_unconverged, 0);
        }
    }
}

/// A cube with one normal a corner: on its sides normals are up to 109 degrees apart.
fn smooth_cube() -> Mesh {
    let at = |bits: u32| Vec3::from([0, 1, 2].map(|axis| if bits >> axis & 1 == 0 { -0.4 } else { 0.4 }));
    let (mut places, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    let mut triangles = Vec::new();
    for side in 0..6_u32 {
        let (axis, far) = (side / 2, side % 2);
        let [u, v] =
            if far == 1 { [(axis + 1) % 3, (axis + 2) % 3] } else { [(axis + 2) % 3, (axis + 1) % 3] };
        let first = places.len() as u32;
        for corner in 0..4_u32 {
            let place = at(far << axis | (corner & 1) << u | (corner >> 1) << v);
            places.push(place);
            normals.push(place.normalize());
            uvs.push(Vec2::new((corner & 1) as f32, (corner >> 1) as f32));
        }
        triangles.extend([[first, first + 1, first + 3], [first, first + 3, first + 2]]);
    }
    common::mesh_of(&places, &normals, &uvs, &triangles)
}

/// A square whose normals lean sideways, 63 degrees at its corners: the sides of its prisms are twisted.
fn swirl() -> Mesh {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(Vec2::from);
    let places = corners.map(|uv| Vec3::new(uv.x - 0.5, 0.5 - uv.y, 0.0));
    let normals = places.map(|p| (Vec3::Z + 8.0_f32.sqrt() * Vec3::new(-p.y, p.x, 0.0)).normalize());
    common::mesh_of(&places, &normals, &corners, &[[2, 3, 1], [2, 1, 0]])
}

/// How many pixels' rays go through one side of a prism twice.
fn twice(mesh: &Mesh, camera: &Camera, highest: f64) -> usize {
    let [corner, right, down] = camera.pixel_directions(SIZE, 0);
    let crossings = |way: DVec3, ends: [u32; 2]| {
        let [a, b] = ends.map(|end| mesh.positions[end as usize].as_dvec3() - camera.eye);
        let [up_a, up_b] = ends.map(|end| mesh.normals[end as usize].as_dvec3());
        let (constant, bend) = (way.dot(a.cross(b)), way.dot(up_a.cross(up_b)));
        let slope = way.dot(a.cross(up_b) + up_a.cross(b));
        let root = (slope * slope - 4.0 * bend * constant).sqrt();
        let inside = |rise: &f64| {
            let (from, to) = (a + *rise * up_a, b + *rise * up_b);
            let edge = (to - from).reject_from(way);
            let share = -from.reject_from(way).dot(edge) / edge.length_squared();
            (0.0..highest).contains(rise) && (0.0..1.0).contains(&share)
        };
        [-root, root].map(|root| (root - slope) / (2.0 * bend)).iter().filter(|rise| inside(rise)).count()
    };
    let way = |at: u32| {
        let (x, y) = (f64::from(at % SIZE[0]) + 0.5, f64::from(at / SIZE[0]) + 0.5);
        corner + right * x + down * y
    };
    let any = |at: &u32| {
        let sides = mesh.indices.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        sides.into_iter().any(|ends| crossings(way(*at), ends) == 2)
    };
    (0..SIZE[0] * SIZE[1]).filter(any).count()
}

/// Where sides of prisms are twisted a ray may go through the prism over a whole triangle more than once: without the cut
/// into pieces 46 and 19 pixels of the swirl are lost. The sides over the cube's edges are plane.
#[test]
fn normals_may_fan_out() {
    let Some(device) = common::device() else { return };
    let texels = [48, 48];
    let judged = |name: &str, mesh: &Mesh, scale: f32, base: f32, eye: [f64; 3]| {
        let (field, camera) = (heights(texels, scale, base), from(eye));
        let judge = Truth::new(mesh, &field);
        let truth = judge.picture(&camera, SIZE);
        let frame = picture(&device, mesh, &field, camera, "exact", true);
        show(&frame, &format!("{name}_{base}_{}", eye[0]));
        let found = agreement(&frame, &truth, &camera, texels);
        row(name, base, &found);
        assert!(found.both > 1500 && found.outline_off.is_empty(), "{name} {base}: {found:?}");
        assert!(found.place_p99 < 0.1 && found.far < 0.002, "{name} {base}: {found:?}");
        assert_eq!(lost(&found.astray, &frame, &judge, &camera), 0, "{name} {base}: {found:?}");
        twice(mesh, &camera, f64::from(scale))
    };
    for base in [0.0, 1.0] {
        assert_eq!(judged("smooth cube", &smooth_cube(), 0.08, base, [1.0, 0.9, 1.4]), 0);
    }
    let views = [[0.9, -0.9, 0.6], [0.2, 0.3, 1.5]];
    let twice: Vec<usize> = views.map(|eye| judged("swirl", &swirl(), 0.2, 0.0, eye)).into();
    println!("{twice:?} rays go through a side of the swirl twice");
    assert!(twice.iter().sum::<usize>() > 20, "{twice:?}");
}

/// A relief whose rays are straight in a frame of their own must be found out, and one a tenth too deep.
#[test]
fn what_is_not_the_displaced_surface_is_noticed() {
    let Some(device) = common::device() else { return };
    let (_, mesh, texels, eye) = shapes().into_iter().nth(2).unwrap();
    let (field, camera) = (heights(texels, 0.08, 0.0), from(eye));
    let truth = Truth::new(&mesh, &field).picture(&camera, SIZE);
    let deeper = picture(&device, &mesh, &heights(texels, 0.088, 0.0), camera, "exact", true);
    let deeper = agreement(&deeper, &truth, &camera, texels);
    assert!(deeper.place_p99 > 1.0, "{deeper:?}");
    let straight = picture(&device, &mesh, &field, camera, "exact", false);
    let straight = agreement(&straight, &truth, &camera, texels);
    assert!(straight.outline_off.len() > 200 && straight.place_p99 > 1.0, "{straight:?}");
}

#[test]
fn outlines_are_those_of_displacement() {
    let Some(device) = common::device() else { return };
    for (name, mesh, texels, eye) in shapes() {
        for base in [0.0, 1.0] {
            let (field, camera) = (heights(texels, 0.08, base), from(eye));
            let displaced = picture(&device, &mesh, &field, camera, "displacement", false);
            let traced = picture(&device, &mesh, &field, camera, "exact", true);
            let found = agreement(&traced, &as_truth(&displaced, &camera), &camera, texels);
            row(name, base, &found);
            assert!(found.both > 1500 && found.outline_off.is_empty(), "{name} {base}: {found:?}");
            assert!(found.place_p99 < 0.5 && found.astray.is_empty(), "{name} {base}: {found:?}");
        }
    }
}

#[test]
fn the_camera_may_stand_in_the_shell() {
    let Some(device) = common::device() else { return };
    let (mesh, texels) = (Mesh::quad(1.0).unwrap(), [48, 48]);
    let field = heights(texels, 0.08, 0.0);
    let (u, v) = (0.47, 0.83);
    let above = 0.08 * field.height_at(u, v) + 0.004;
    let eye = DVec3::new(u - 0.5, 0.5 - v, above);
    assert!(above < 0.08 * 0.95, "below the lid");
    for target in [DVec3::new(0.1, 0.4, 0.03), DVec3::new(-0.3, -0.3, 0.02)] {
        let camera = Camera { up: DVec3::Z, ..Camera::look_at(eye, target) };
        let truth = Truth::new(&mesh, &field).picture(&camera, SIZE);
        let frame = picture(&device, &mesh, &field, camera, "exact", true);
        show(&frame, &format!("inside_{}", target.x));
        let found = agreement(&frame, &truth, &camera, texels);
        row("inside", 0.0, &found);
        assert!(found.both > 1500 && found.outline_off.is_empty(), "{found:?}");
        assert!(found.place_p99 < 0.1 && found.far < 0.01, "{found:?}");
    }
}

/// Where the near plane cuts a mesh open, rays begin below its surface; so they do for a camera inside of it.
#[test]
fn the_near_plane_cuts_meshes_open() {
    let Some(device) = common::device() else { return };
    for (name, mesh, texels, _) in shapes() {
        let field = heights(texels, 0.08, 0.0);
        let judge = Truth::new(&mesh, &field);
        let eye = DVec3::new(0.5, 0.6, 0.9);
        for cut in [0.6, 0.8] {
            // The farther away the target, the farther the near plane.
            let near = Camera::look_at(eye, DVec3::ZERO).near() / eye.length();
            let camera = Camera::look_at(eye, eye - eye * (cut / near));
            let truth = judge.picture(&camera, SIZE);
            let frame = picture(&device, &mesh, &field, camera, "exact", true);
            show(&frame, &format!("near_{name}_{cut}"));
            let found = agreement(&frame, &truth, &camera, texels);
            row(&format!("{name}, cut at {cut}"), 0.0, &found);
            // Crests that stand out of the cut by less than the micro-triangles of the truth are met by finer rays.
            let odd = [found.outline_off.as_slice(), &found.astray].concat();
            assert!(found.both > 200, "{name} {cut}: {found:?}");
            assert_eq!(disproved(&odd, &frame, &judge, &camera), 0, "{name} {cut}: {found:?}");
        }
    }
}

/// What is two pixels aside is not what finer rays meet.
#[test]
fn finer_rays_notice_what_is_off() {
    let Some(device) = common::device() else { return };
    let (_, mesh, texels, eye) = shapes().into_iter().next().unwrap();
    let (field, camera) = (heights(texels, 0.08, 0.0), from(eye));
    let judge = Truth::new(&mesh, &field);
    let frame = |camera| picture(&device, &mesh, &field, camera, "exact", true);
    let aside = Camera { target: camera.target + 0.02 * DVec3::X, ..camera };
    let some: Vec<usize> = (0..20).map(|k| (SIZE[0] * 50 + 56 + k) as usize).collect();
    assert_eq!(disproved(&some, &frame(camera), &judge, &camera), 0);
    assert!(disproved(&some, &frame(aside), &judge, &camera) > 10);
}

#[test]
fn reliefs_cut_into_each_other_where_they_are() {
    let Some(device) = common::device() else { return };
    let (ball, plate) = (Mesh::sphere(0.4, 48).unwrap(), Mesh::quad(1.2).unwrap());
    let (field, camera) = (heights([128, 64], 0.08, 0.5), from([0.5, 0.7, 1.3]));
    let material = Material::new(std::sync::Arc::clone(&field));
    let draws = vec![Draw::new(&ball, &material), Draw::new(&plate, &material)];
    let frame = scene_picture(&device, draws, camera, "exact", true);
    show(&frame, "cut");
    let [a, b] = [&ball, &plate].map(|mesh| Truth::new(mesh, &field).picture(&camera, SIZE));
    let nearest: Vec<_> = a
        .iter()
        .zip(&b)
        .map(|(&a, &b)| match (a, b) {
            (Some(a), Some(b)) => Some(if a.t < b.t { a } else { b }),
            (a, b) => a.or(b),
        })
        .collect();
    let balls =
        nearest.iter().zip(&a).filter(|(n, a)| n.is_some() && n.map(|n| n.t) == a.map(|a| a.t)).count();
    assert!(balls > 500, "the ball stands out of the plate: {balls}");
    let found = agreement(&frame, &nearest, &camera, [128, 64]);
    row("ball in plate", 0.5, &found);
    assert!(found.outline_off.is_empty() && found.far < 0.005, "{found:?}");
}
