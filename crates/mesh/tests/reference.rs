//! MikkTSpace against another implementation of it, corner by corner: random quads and triangles with
//! mirrored, folded and collapsed maps, and real meshes.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use common::degrees;
use glam::{Vec2, Vec3, Vec4};
use mesh::arrays::Arrays;
use mesh::frame::{quads_of_triangles, tangents_of_arrays, triangles_of_quads};
use mesh::{FrameMethod, Mesh};
use proptest::prelude::*;

/// Faces of 3 or 4 vertices for the reference, `v` up.
struct Reference<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    uvs: &'a [Vec2],
    faces: Vec<Vec<u32>>,
    found: Vec<Vec<Option<Vec4>>>,
}

impl Geometry for Reference<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }
    fn num_vertices_of_face(&self, face: usize) -> usize {
        self.faces[face].len()
    }
    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.positions[self.faces[face][corner] as usize].to_array()
    }
    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals[self.faces[face][corner] as usize].to_array()
    }
    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.uvs[self.faces[face][corner] as usize];
        [uv.x, 0.0 - uv.y]
    }
    fn set_tangent(&mut self, found: Option<TangentSpace>, face: usize, corner: usize) {
        let unit = |t: &Vec4| (t.truncate().length() - 1.0).abs() < 1e-3;
        self.found[face][corner] = found.map(|space| Vec4::from(space.tangent_encoded())).filter(unit);
    }
}

/// Compares, and returns how many corners there were to compare.
fn compare(positions: &[Vec3], normals: &[Vec3], uvs: &[Vec2], faces: Vec<Vec<u32>>, what: &str) -> usize {
    let quads = faces[0].len() == 4;
    let (indices, starts) = if quads {
        let rows: Vec<[u32; 4]> = faces.iter().map(|face| [face[0], face[1], face[2], face[3]]).collect();
        triangles_of_quads(&rows)
    } else {
        (faces.iter().map(|face| [face[0], face[1], face[2]]).collect(), Vec::new())
    };
    let arrays = Arrays {
        positions: positions.to_vec(),
        normals: Some(normals.to_vec()),
        uvs: uvs.to_vec(),
        tangents: None,
        indices,
    };
    let split = tangents_of_arrays(FrameMethod::MIKKTSPACE, arrays, &starts, false).unwrap();
    let rows: Vec<Vec<u32>> = if quads {
        quads_of_triangles(&split.indices).iter().map(|row| row.to_vec()).collect()
    } else {
        split.indices.iter().map(|row| row.to_vec()).collect()
    };
    let found = faces.iter().map(|face| vec![None; face.len()]).collect();
    let mut reference = Reference { positions, normals, uvs, faces, found };
    generate_tangents(&mut reference).unwrap();
    let mut compared = 0;
    for (face, (row, expected)) in rows.iter().zip(&reference.found).enumerate() {
        for (corner, (&vertex, expected)) in row.iter().zip(expected).enumerate() {
            let Some(expected) = expected else { continue };
            let found = split.tangents[vertex as usize];
            let angle = degrees(found.truncate(), expected.truncate());
            assert!(
                angle < 0.02 && found.w == expected.w,
                "{what}, face {face}, corner {corner}: {found} instead of {expected}, {angle} degrees"
            );
            compared += 1;
        }
    }
    compared
}

fn triangles(mesh: &Mesh) -> Vec<Vec<u32>> {
    mesh.indices.iter().map(|row| row.to_vec()).collect()
}

#[test]
fn generated_shapes_agree() {
    for mesh in
        [Mesh::cube(1.0).unwrap(), Mesh::sphere(1.0, 48).unwrap(), Mesh::torus(1.0, 0.4, 40, 30).unwrap()]
    {
        let count = compare(&mesh.positions, &mesh.normals, &mesh.uvs, triangles(&mesh), "shape");
        assert_eq!(count, 3 * mesh.indices.len());
    }
}

#[test]
fn real_meshes_agree() {
    for name in [
        "khronos/NormalTangentTest/NormalTangentTest.glb",
        "obj/meshoptimizer/pirate.obj",
        "obj/trimesh/fuze.obj",
        "obj/tinyobjloader/map-bump.obj",
        "obj/mikktspace/cube.obj",
        "obj/mikktspace/doomcone.obj",
        "obj/mikktspace/doomcone_smooth.obj",
        "obj/mikktspace/rancid_geometry.obj",
    ] {
        let Some(path) = common::shared(name) else { return };
        let mesh = Mesh::open(path).unwrap();
        let count = compare(&mesh.positions, &mesh.normals, &mesh.uvs, triangles(&mesh), name);
        println!("{name}: {count} of {} corners agree", 3 * mesh.indices.len());
        assert!(2 * count > 3 * mesh.indices.len(), "{name}: {count}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    /// A grid whose vertices and map are moved by whole steps, so that mirrored, folded, collapsed and
    /// zero-area faces are common.
    #[test]
    fn random_faces_agree(
        moves in prop::collection::vec(-2i32..3, 5 * 36),
        tilts in prop::collection::vec(-0.5f32..0.5, 2 * 36),
        quads in any::<bool>(),
        first in 0usize..4,
    ) {
        let step = |i: usize, k: usize| moves[5 * i + k] as f32;
        let grid = |i: usize| Vec2::new((i % 6) as f32, (i / 6) as f32);
        let place = |i: usize| {
            let p = grid(i) * 2.0;
            Vec3::new(p.x + step(i, 0) * 0.5, p.y + step(i, 1) * 0.5, step(i, 2) * 0.3)
        };
        let positions: Vec<Vec3> = (0..36).map(place).collect();
        let map = |i: usize| {
            let p = grid(i) * 0.2;
            Vec2::new((p.x - 0.5).abs() + 0.1 * step(i, 3), p.y + 0.1 * step(i, 4))
        };
        let uvs: Vec<Vec2> = (0..36).map(map).collect();
        let tilt = |i: usize| Vec3::new(tilts[2 * i], tilts[2 * i + 1], 1.0).normalize();
        let normals: Vec<Vec3> = (0..36).map(tilt).collect();
        let mut faces = Vec::new();
        for cell in (0..29u32).filter(|cell| cell % 6 != 5) {
            let mut corners = [cell, cell + 1, cell + 7, cell + 6];
            corners.rotate_left(first);
            let [a, b, c, d] = corners;
            if quads {
                faces.push(vec![a, b, c, d]);
            } else {
                faces.extend([vec![a, b, c], vec![a, c, d]]);
            }
        }
        compare(&positions, &normals, &uvs, faces, "random");
    }
}
