//! OBJ and MTL by the rules, on files small enough to check by hand.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use std::path::Path;

use common::assert_sound;
use glam::{Vec2, Vec3, Vec4};
use mesh::{ImageSource, Mesh};

fn read(text: &str) -> Mesh {
    let mesh = Mesh::from_obj(text.as_bytes(), Path::new("/nonexistent")).unwrap();
    assert_sound(&mesh, text);
    mesh
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

#[test]
fn v_is_turned_down_and_quads_are_fans() {
    let mesh = read(&format!("{SQUARE}f 1/1 2/2 3/3 4/4\n"));
    assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.uvs, [Vec2::new(0., 1.), Vec2::new(1., 1.), Vec2::new(1., 0.), Vec2::new(0., 0.)]);
    assert_eq!(mesh.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
    assert_eq!(mesh.normals, [Vec3::Z; 4]);
    assert!((mesh.dpdv[0] + Vec3::Y).length() < 1e-6, "v = 0 is at the top of the image");
    assert!(mesh.warnings.is_empty(), "{:?}", mesh.warnings);
}

#[test]
fn indices_count_from_either_end() {
    let a = read(&format!("{SQUARE}f 1/1 2/2 3/3\n"));
    let b = read(&format!("{SQUARE}f -4/-4 -3/-3 -2/-2\n"));
    assert_eq!((a.positions, a.uvs), (b.positions, b.uvs));
}

#[test]
fn given_normals_are_normalised() {
    let mesh = read(&format!("{SQUARE}vn 0 0 6.28\nvn 0 1 1\nf 1//1 2//1 3//2\n"));
    assert_eq!(mesh.normals[0], Vec3::Z);
    assert!((mesh.normals[2] - Vec3::new(0.0, 1.0, 1.0).normalize()).length() < 1e-6);
}

#[test]
fn missing_normals_are_smooth_up_to_60_degrees() {
    let bent = |angle: f32| {
        let (sin, cos) = angle.to_radians().sin_cos();
        read(&format!("v 0 0 0\nv 0 1 0\nv -1 0 0\nv {cos} 0 {}\nf 1 2 3\nf 2 1 4\n", -sin))
    };
    assert_eq!(bent(40.0).positions.len(), 4, "smooth: the edge is shared");
    let half = bent(40.0).normals[0];
    assert!((half.x - 20f32.to_radians().sin()).abs() < 1e-5, "{half}");
    let hard = bent(80.0);
    assert_eq!(hard.positions.len(), 6, "hard: the edge is split");
    assert_eq!(hard.normals[0], Vec3::Z);
}

#[test]
fn partly_missing_normals_leave_the_given_ones() {
    let mesh = read(&format!("{SQUARE}vn 0 1 1\nf 1//1 2//1 3//1\nf 1 3 4\n"));
    let given = Vec3::new(0.0, 1.0, 1.0).normalize();
    let [first, second] = [0, 1].map(|t: usize| mesh.normals[mesh.indices[t][0] as usize]);
    assert!((first - given).length() < 1e-6);
    assert_eq!(second, Vec3::Z);
    assert!(mesh.warnings.iter().any(|w| w.contains("no normal")));
}

#[test]
fn objects_groups_and_materials_become_parts() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("my walls.mtl"),
        "newmtl brick wall\nKd 0.5 0.25 0.125\nKs 0.1 0.4 0.2\nNs 50\nd 0.75\nmap_Kd -clamp on my wall.png\n\
         map_Bump -bm 0.5 sub\\height.png\nnorm normal.png\ndisp -mm 0 0.25 height.png\n\
         newmtl plain\nKd 1\nmap_Kd gone.png\n",
    )
    .unwrap();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    for name in ["my wall.png", "normal.png", "height.png", "sub/height.png"] {
        std::fs::write(folder.path().join(name), "x").unwrap();
    }
    let path = folder.path().join("x.obj");
    // The library is named after the materials are used.
    let text = format!(
        "{SQUARE}o house\nusemtl brick wall\nf 1/1 2/2 3/3\nusemtl plain\nf 1/1 3/3 4/4\ng roof\nf 1/1 2/2 4/4\n\
         usemtl nobody\nf 2/2 3/3 4/4\nmtllib my walls.mtl\n"
    );
    std::fs::write(&path, text).unwrap();
    let mesh = Mesh::open(&path).unwrap();
    assert_sound(&mesh, "parts");
    let parts: Vec<_> =
        mesh.parts.iter().map(|p| (p.name.as_str(), p.triangles.clone(), p.material)).collect();
    assert_eq!(
        parts,
        [("house", 0..1, Some(0)), ("house", 1..2, Some(1)), ("roof", 2..3, Some(1)), ("roof", 3..4, None)]
    );
    let file = |name: &str| Some(ImageSource::File(folder.path().join(name)));
    let brick = &mesh.materials[0];
    assert_eq!(brick.name, "brick wall");
    assert_eq!(brick.albedo_factor, [0.5, 0.25, 0.125, 0.75]);
    assert_eq!((brick.specular, brick.shininess), (0.4, 50.0));
    assert_eq!((&brick.albedo, &brick.normal), (&file("my wall.png"), &file("normal.png")));
    assert_eq!((&brick.bump, brick.bump_scale), (&file("sub/height.png"), 0.5));
    assert_eq!((&brick.displacement, brick.displacement_scale), (&file("height.png"), 0.25));
    assert_eq!(mesh.materials[1].albedo, None);
    assert!(mesh.warnings.iter().any(|w| w.contains("gone.png")), "{:?}", mesh.warnings);
}

#[test]
fn concave_polygons_keep_their_shape() {
    let mesh = read("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n");
    let area: f32 = mesh
        .indices
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a).z / 2.0
        })
        .inspect(|a| assert!(*a > 0.0))
        .sum();
    assert!((area - 10.0).abs() < 1e-5);
}

#[test]
fn a_face_without_uvs_among_others_is_said() {
    let mesh = read(&format!("{SQUARE}f 1/1 2/2 3/3\nf 1 3 4\n"));
    assert!(mesh.warnings.iter().any(|w| w.contains("1 faces have no texture coordinates")));
    assert_eq!(mesh.uvs[mesh.indices[0][2] as usize], Vec2::new(1.0, 0.0));
}

/// A name of a hundred thousand characters, carried by each of thousands of parts, would be gigabytes.
#[test]
fn long_names_are_cut() {
    let folder = tempfile::tempdir().unwrap();
    let long = "x".repeat(100_000);
    std::fs::write(folder.path().join("m.mtl"), format!("newmtl {long}\nnewmtl b\n")).unwrap();
    let turns = format!("usemtl {long}\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n").repeat(20);
    let text = format!("mtllib m.mtl\n{SQUARE}g {long}\n{turns}");
    let mesh = Mesh::from_obj(text.as_bytes(), folder.path()).unwrap();
    assert_eq!(mesh.parts.len(), 40);
    assert!(mesh.parts.iter().all(|p| p.name.len() == 256 && p.material.is_some()));
    assert_eq!(mesh.parts[0].material, Some(0));
}

/// Stars of many corners: clipping ears from all of them would take hours.
#[test]
fn many_large_concave_polygons_do_not_hang() {
    let mut text = String::new();
    for i in 0..4000 {
        let (sin, cos) = (i as f32 * std::f32::consts::TAU / 4000.0).sin_cos();
        let r = if i % 2 == 0 { 1.0 } else { 0.3 };
        text += &format!("v {} {} 0\n", r * cos, r * sin);
    }
    let polygon: String = (1..=4000).map(|i| format!(" {i}")).collect();
    text += &format!("f{polygon}\n").repeat(20);
    let start = std::time::Instant::now();
    let mesh = read(&text);
    assert!(start.elapsed() < std::time::Duration::from_secs(30), "{:?}", start.elapsed());
    assert_eq!(mesh.indices.len(), 20 * 3998);
}
