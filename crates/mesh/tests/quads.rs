//! OBJ files with quads: MikkTSpace sees the quads, not the triangles they become.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use std::path::Path;
use std::time::{Duration, Instant};

use common::plain::plain_mikktspace;
use common::{assert_sound, degrees};
use glam::{Vec2, Vec3, Vec4};
use mesh::{FrameMethod, Mesh, Split, tangents};

fn read(text: &str) -> Mesh {
    let mesh = Mesh::from_obj(text.as_bytes(), Path::new("/nonexistent")).unwrap();
    assert_sound(&mesh, &text[..text.len().min(300)]);
    mesh
}

/// MikkTSpace that sees nothing but triangles.
fn on_triangles(mesh: &Mesh) -> Split {
    tangents(FrameMethod::MIKKTSPACE, &mesh.positions, &mesh.normals, &mesh.uvs, &mesh.indices).unwrap()
}

/// A unit square whose map is bent along its shorter diagonal, `bd`.
const BENT: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 0.5\nvn 0 0 1\n";

/// By hand: dP/du is (1, 0) on `abd` and (1, -1/2) on `bcd`; at b and d both have 45 degrees.
fn bent_tangent(corner: Vec3) -> Vec3 {
    let (first, second) = (Vec3::X, Vec3::new(2.0, -1.0, 0.0).normalize());
    match (corner.x + corner.y) as i32 {
        0 => first,
        1 => (first + second).normalize(),
        _ => second,
    }
}

#[test]
fn a_quad_is_split_along_the_shorter_diagonal_of_its_map() {
    for face in ["1/1/1 2/2/1 3/3/1 4/4/1", "2/2/1 3/3/1 4/4/1 1/1/1", "3/3/1 4/4/1 1/1/1 2/2/1"] {
        let mesh = read(&format!("{BENT}f {face}\n"));
        assert_eq!(mesh.positions.len(), 4, "{face}");
        for (&position, tangent) in mesh.positions.iter().zip(&mesh.tangents) {
            assert!(tangent.abs_diff_eq(bent_tangent(position).extend(1.0), 1e-6), "{position} {tangent}");
        }
    }
    // Negative control: on the triangles the other diagonal counts.
    let mesh = read(&format!("{BENT}f 1/1/1 2/2/1 3/3/1 4/4/1\n"));
    let split = on_triangles(&mesh);
    assert!(degrees(split.tangents[2].truncate(), bent_tangent(Vec3::ONE)) > 1.0);
}

#[test]
fn larger_polygons_are_triangles() {
    let more = "v 0.5 1.5 0\nvt 0.3 1.2\n";
    let polygon = read(&format!("{BENT}{more}f 1/1/1 2/2/1 3/3/1 5/5/1 4/4/1\n"));
    let triangles =
        read(&format!("{BENT}{more}f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 5/5/1\nf 1/1/1 5/5/1 4/4/1\n"));
    assert_eq!(polygon.indices, triangles.indices);
    assert_eq!(polygon.tangents, triangles.tangents);
}

/// A bumpy grid with a warped map, mirrored in its middle; quads, save for every fifth cell.
#[test]
fn quads_agree_with_the_definition() {
    const SIDE: usize = 13;
    let noise =
        |i: usize, k: usize| ((i * 7919 + k * 104_729 + 13) * 2_654_435_761 % 1000) as f32 / 1000.0 - 0.5;
    let mut text = String::new();
    for i in 0..SIDE * SIDE {
        let (x, y) = ((i % SIDE) as f32 / 12.0, (i / SIDE) as f32 / 12.0);
        let normal = Vec3::new(noise(i, 3), noise(i, 4), 2.0).normalize();
        text += &format!("v {x} {y} {}\n", noise(i, 0) * 0.05);
        text += &format!("vt {} {}\n", (x - 0.5).abs() + noise(i, 1) * 0.04, y + noise(i, 2) * 0.04);
        text += &format!("vn {} {} {}\n", normal.x, normal.y, normal.z);
    }
    let mut sides = Vec::new();
    for cell in 0..SIDE * (SIDE - 1) {
        if cell % SIDE == SIDE - 1 {
            continue;
        }
        let a = cell + 1;
        let mut corners = [a, a + 1, a + 1 + SIDE, a + SIDE].map(|i| format!("{i}/{i}/{i}"));
        corners.rotate_left(cell % 4);
        let [a, b, c, d] = corners;
        if cell % 5 == 0 {
            text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
            sides.extend([3, 3]);
        } else {
            text += &format!("f {a} {b} {c} {d}\n");
            sides.push(4);
        }
    }
    let mesh = read(&text);
    let mut rows = mesh.indices.iter();
    let faces: Vec<Vec<u32>> = sides
        .iter()
        .map(|&count| {
            let mut face = rows.next().unwrap().to_vec();
            face.extend((count == 4).then(|| rows.next().unwrap()[2]));
            face
        })
        .collect();
    assert!(rows.next().is_none());
    let mut compared = 0;
    for (face, expected) in faces.iter().zip(plain_mikktspace(&mesh, &faces)) {
        for (&vertex, expected) in face.iter().zip(expected) {
            let (direction, w) = expected.unwrap();
            let found = mesh.tangents[vertex as usize];
            let angle = degrees(direction.as_vec3(), found.truncate());
            assert!(angle < 0.05 && w == found.w, "{face:?} {vertex}: {angle} degrees, {direction} {found}");
            compared += 1;
        }
    }
    assert_eq!(compared, sides.iter().sum::<usize>());
    let again = mesh.tangents(FrameMethod::MIKKTSPACE).unwrap();
    assert_eq!((&again.indices, &again.tangents), (&mesh.indices, &mesh.tangents), "the quads are kept");
    // Negative control: so fine an agreement is not had on the triangles.
    let split = on_triangles(&mesh);
    let worst = mesh
        .indices
        .iter()
        .flatten()
        .zip(split.indices.iter().flatten())
        .map(|(&a, &b)| degrees(mesh.tangents[a as usize].truncate(), split.tangents[b as usize].truncate()))
        .fold(0.0, f64::max);
    assert!(worst > 1.0, "{worst}");
}

/// A quad folded by more than 60 degrees gets a hard edge where its triangles meet, and no frame
/// that is averaged over it.
#[test]
fn folded_quads_are_triangles() {
    let mesh =
        read("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n");
    assert_eq!(mesh.positions.len(), 6);
    let split = on_triangles(&mesh);
    assert_eq!((split.indices, split.tangents), (mesh.indices, mesh.tangents));
}

#[test]
fn quads_with_equal_corners_are_sound() {
    let data = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n";
    let words = ["1/1/1", "2/2/1", "3/3/1", "4/4/1"];
    for code in 0..256 {
        let corners = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6].map(|i| words[i]).join(" ");
        let mesh = read(&format!("{data}f {corners}\nf 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n"));
        // Every corner is one of the sound triangles' vertices, where dP/du is +X.
        let agrees = mesh.tangents.iter().all(|t| t.truncate().abs_diff_eq(Vec3::X, 1e-6));
        assert!(agrees, "{corners}: {:?}", mesh.tangents);
    }
}

/// Quads without any sound half, each of which the generator would seek among all others.
#[test]
fn many_degenerate_quads_do_not_hang() {
    let mut text = format!("{BENT}f 1/1/1 2/2/1 3/3/1 4/4/1\n");
    text += &"f 1/1/1 1/1/1 2/2/1 2/2/1\n".repeat(100_000);
    text += &"f 1/1/1 2/2/1 1/1/1 3/3/1\n".repeat(100_000);
    let start = Instant::now();
    let mesh = read(&text);
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    let degenerate = &mesh.indices[2];
    assert_eq!(mesh.tangents[degenerate[0] as usize], Vec4::new(1.0, 0.0, 0.0, 1.0));
}

/// Quads around one vertex: recursion, and pairs of faces.
#[test]
fn huge_fans_of_quads_neither_overflow_the_stack_nor_hang() {
    for count in [300usize, 4_000, 100_000] {
        let mut text = String::from("v 0 0 1\nvt 0.5 0.5\nvn 0 0 1\n");
        for i in 0..2 * count {
            let (sin, cos) = (std::f64::consts::PI * i as f64 / count as f64).sin_cos();
            let uv = Vec2::new(0.5 + 0.5 * cos as f32, 0.5 + 0.5 * sin as f32);
            text += &format!("v {cos} {sin} 0\nvt {} {}\n", uv.x, uv.y);
        }
        for i in 0..count {
            let [a, b, c] = [0, 1, 2].map(|k| 2 + (2 * i + k) % (2 * count));
            text += &format!("f 1/1/1 {a}/{a}/1 {b}/{b}/1 {c}/{c}/1\n");
        }
        let start = Instant::now();
        let mesh = read(&text);
        assert!(start.elapsed() < Duration::from_secs(20), "{count}: {:?}", start.elapsed());
        // u runs along +X and the cone is even all around.
        let middle = mesh.tangents[mesh.indices[0][0] as usize];
        assert!(middle.abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-3), "{count}: {middle}");
    }
}
