//! Displaced meshes are watertight, and where the closed form says.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use mesh::generate::{sphere_point, torus_point};
use mesh::{Cut, Displaced, EdgeSide, Mesh, MeshError, Relief, displace};

/// Heights that do not tile, so that each UV seam has two of them.
fn uneven(u: f64, v: f64) -> f64 {
    0.5 + 0.3 * (7.0 * u + 1.0).sin() * (5.0 * v).cos() + 0.15 * (3.0 * u - 11.0 * v).sin()
}

/// Pieces that differ from edge to edge, and with the direction in which UVs run along one.
fn mixed(side: &EdgeSide) -> u32 {
    let middle = (side.positions[0] + side.positions[1]) * 0.5;
    let hash = (middle.x * 37.0 + middle.y * 61.0 + middle.z * 89.0).abs() * 100.0 + side.uvs[0].x * 50.0;
    1 + hash as u32 % 9
}

fn displaced(mesh: &Mesh, segments: &(dyn Fn(&EdgeSide) -> u32 + Sync)) -> Displaced {
    let range = 0..mesh.indices.len() as u32;
    let cut = Cut { range: &range, keep: &|_| true, segments, origin: DVec3::ZERO, limit: u64::MAX };
    displace(mesh, &cut, &Relief { height: &uneven, scale: 0.1, base: 0.4 }).unwrap()
}

/// How often each edge between two places is walked, forwards less backwards. Zero everywhere: no gap.
fn gaps(positions: &[Vec3], indices: &[[u32; 3]]) -> usize {
    let key = |at: u32| (positions[at as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut walked: HashMap<_, i64> = HashMap::new();
    for triangle in indices {
        for corner in 0..3 {
            let (a, b) = (key(triangle[corner]), key(triangle[(corner + 1) % 3]));
            *walked.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    walked.into_iter().filter(|((a, b), count)| a != b && *count != 0).count()
}

#[test]
fn closed_meshes_stay_closed() {
    let closed = [
        ("sphere", Mesh::sphere(0.7, 24).unwrap()),
        ("torus", Mesh::torus(0.7, 0.3, 24, 12).unwrap()),
        ("cube", Mesh::cube(1.0).unwrap()),
    ];
    for (name, mesh) in closed {
        assert_eq!(gaps(&mesh.positions, &mesh.indices), 0, "{name} itself");
        let micro = displaced(&mesh, &mixed);
        assert!(micro.indices.len() > 8 * mesh.indices.len(), "{name}");
        assert_eq!(gaps(&micro.positions, &micro.indices), 0, "{name}");
        // Negative control: without agreeing on one place along seams it falls apart.
        let mut apart = micro.clone();
        for (at, position) in apart.positions.iter_mut().enumerate() {
            let [_, b, c] = mesh.indices[apart.faces[at] as usize];
            if apart.weights[at].x == 1.0 {
                *position += 1e-3 * mesh.uvs[b as usize].x * mesh.normals[b as usize];
            } else if apart.weights[at].y == 1.0 {
                *position += 1e-3 * mesh.uvs[c as usize].x * mesh.normals[c as usize];
            }
        }
        assert!(gaps(&apart.positions, &apart.indices) > 10, "{name}");
    }
}

#[test]
fn an_open_mesh_opens_nowhere_else() {
    let quad = Mesh::quad(1.0).unwrap();
    let micro = displaced(&quad, &|_| 7);
    assert_eq!(gaps(&micro.positions, &micro.indices), 4 * 7);
}

#[test]
fn a_real_mesh_stays_as_closed_as_it_was() {
    let Some(path) = common::shared("obj/trimesh/fuze.obj") else { return };
    let mesh = Mesh::open(path).unwrap();
    let before = gaps(&mesh.positions, &mesh.indices);
    let micro = displaced(&mesh, &|_| 3);
    assert_eq!(gaps(&micro.positions, &micro.indices), 3 * before);
}

#[test]
fn micro_vertices_are_where_the_closed_form_says() {
    let uneven_ring = |u: f64, v: f64| 0.5 + 0.3 * (std::f64::consts::TAU * (3.0 * u + v)).sin();
    let relief = Relief { height: &uneven_ring, scale: 0.1, base: 0.4 };
    type Closed = fn(f64, f64) -> (DVec3, DVec3);
    // What linear interpolation over a triangle is off: an eighth of the second derivatives, which are radii.
    let step = |pieces: f64| std::f64::consts::TAU / pieces;
    let off = |uu: f64, uv: f64, vv: f64, du: f64, dv: f64| {
        (uu * du * du + 2.0 * uv * du * dv + vv * dv * dv) / 8.0
    };
    let ball = off(0.76, 0.76, 0.76, step(512.0), step(512.0));
    let ring = off(1.06, 0.36, 0.36, step(512.0), step(256.0));
    let shapes: [(Mesh, Closed, f64); 2] = [
        (
            Mesh::sphere(0.7, 512).unwrap(),
            |u, v| {
                let point = sphere_point(f64::from(0.7_f32), u, v);
                (point.position, point.normal)
            },
            ball,
        ),
        (
            Mesh::torus(0.7, 0.3, 512, 256).unwrap(),
            |u, v| {
                let point = torus_point(f64::from(0.7_f32), f64::from(0.3_f32), u, v);
                (point.position, point.normal)
            },
            ring,
        ),
    ];
    for (mesh, closed, bound) in shapes {
        let range = 0..mesh.indices.len() as u32;
        let origin = DVec3::new(0.25, 0.0, -3.0);
        let cut = Cut { range: &range, keep: &|f| f % 97 == 0, segments: &|_| 4, origin, limit: u64::MAX };
        let micro = displace(&mesh, &cut, &relief).unwrap();
        assert!(micro.positions.len() > 20_000);
        let mut worst = 0.0_f64;
        for (at, position) in micro.positions.iter().enumerate() {
            let [a, b, c] = mesh.indices[micro.faces[at] as usize].map(|i| mesh.uvs[i as usize].as_dvec2());
            let weights = micro.weights[at].as_dvec2();
            let uv = a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
            // Triangles at a pole are no part of the closed form.
            if uv.y < 0.01 || uv.y > 0.99 {
                continue;
            }
            let (place, normal) = closed(uv.x, uv.y);
            let truth = place + 0.1 * (uneven_ring(uv.x, uv.y) - 0.4) * normal - origin;
            worst = worst.max((position.as_dvec3() - truth).length());
        }
        assert!(worst < bound, "{worst} of {bound}");
        assert!(worst > 0.5 * bound, "{worst} of {bound}: does this compare anything?");
    }
}

#[test]
fn too_many_micro_triangles_are_refused() {
    let quad = Mesh::quad(1.0).unwrap();
    let cut = Cut {
        range: &(0..2),
        keep: &|_| true,
        segments: &|_| 1_000_000_000,
        origin: DVec3::ZERO,
        limit: 1000,
    };
    let error = displace(&quad, &cut, &Relief { height: &uneven, scale: 0.1, base: 0.0 }).unwrap_err();
    assert!(matches!(error, MeshError::TooLarge { limit: 1000, .. }), "{error}");
}
