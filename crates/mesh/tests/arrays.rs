//! Meshes from plain arrays.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use common::assert_sound;
use glam::{Vec3, Vec4};
use mesh::{FrameMethod, Mesh, MeshError, tangents};

const POSITIONS: [[f32; 3]; 3] = [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.]];
const UVS: [[f32; 2]; 3] = [[0., 1.], [1., 1.], [0., 0.]];

fn message(result: Result<Mesh, MeshError>) -> String {
    match result {
        Err(error @ MeshError::Arrays { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_triangle_becomes_a_mesh() {
    let mesh = Mesh::from_arrays(&POSITIONS, &[[0, 1, 2]], &UVS, None, None).unwrap();
    assert_sound(&mesh, "triangle");
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 3]);
    assert!(mesh.warnings.is_empty());
    assert_eq!(mesh.bounds(), (Vec3::ZERO, Vec3::new(2.0, 2.0, 0.0)));
}

#[test]
fn given_normals_are_normalised_and_given_tangents_kept() {
    let normals = [[0., 0., 5.], [0., 0., 1e-30], [0., 0., 1e30]];
    let given = [[0., 3., 0., 0.5], [0., 1., 0., 1.], [0., 1., 0., -0.1]];
    let mesh = Mesh::from_arrays(&POSITIONS, &[[0, 1, 2]], &UVS, Some(&normals), Some(&given)).unwrap();
    assert_sound(&mesh, "given");
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    let expected = [1.0, 1.0, -1.0].map(|w| Vec4::new(0.0, 1.0, 0.0, w));
    assert_eq!(mesh.tangents, expected);
    assert!((mesh.dpdu[0] - 2.0 * Vec3::X).length() < 1e-6, "derivatives come from the UVs all the same");
}

#[test]
fn vectors_without_length_are_replaced_and_said() {
    let given = [[0., 0., 0., 1.]; 3];
    let mesh = Mesh::from_arrays(&POSITIONS, &[[0, 1, 2]], &UVS, Some(&[[0.0; 3]; 3]), Some(&given)).unwrap();
    assert_sound(&mesh, "replaced");
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    assert_eq!(mesh.warnings.len(), 2, "{:?}", mesh.warnings);
}

#[test]
fn messages_say_what_is_wrong() {
    let make =
        |p: &[[f32; 3]], i: &[[u32; 3]], t: &[[f32; 2]]| message(Mesh::from_arrays(p, i, t, None, None));
    assert_eq!(make(&[], &[], &[]), "mesh has 0 vertices and 0 triangles; at least 3 and 1 needed");
    assert!(make(&POSITIONS, &[], &UVS).contains("0 triangles"));
    assert_eq!(make(&POSITIONS, &[[0, 1, 2]], &UVS[..2]), "2 uvs for 3 positions; one each needed");
    assert_eq!(
        make(&POSITIONS, &[[0, 1, 2], [0, 1, 3]], &UVS),
        "triangle 1 uses vertex 3, but there are 3 vertices"
    );
    assert!(make(&POSITIONS, &[[0, 1, u32::MAX]], &UVS).contains("4294967295"));
    let mut bad = POSITIONS;
    bad[1][2] = f32::NAN;
    assert_eq!(make(&bad, &[[0, 1, 2]], &UVS), "position of vertex 1 is NaN or infinite");
    let mut bad = UVS;
    bad[2][0] = f32::INFINITY;
    assert_eq!(make(&POSITIONS, &[[0, 1, 2]], &bad), "uv of vertex 2 is NaN or infinite");
    let normals = [[0., 0., 1.]; 2];
    let result = Mesh::from_arrays(&POSITIONS, &[[0, 1, 2]], &UVS, Some(&normals), None);
    assert_eq!(message(result), "2 normals for 3 positions; one each needed");
    let tangents = [[0., 0., 1., f32::NAN]; 3];
    let result = Mesh::from_arrays(&POSITIONS, &[[0, 1, 2]], &UVS, None, Some(&tangents));
    assert_eq!(message(result), "tangent of vertex 0 is NaN or infinite");
}

#[test]
fn the_plain_function_checks_too() {
    let p = [Vec3::ZERO; 3];
    assert!(tangents(FrameMethod::MIKKTSPACE, &p, &p[..2], &[], &[]).is_err());
    assert!(tangents(FrameMethod::MIKKTSPACE, &p, &p, &[glam::Vec2::ZERO; 3], &[[0, 1, 3]]).is_err());
    let nan = [Vec3::NAN; 3];
    assert!(tangents(FrameMethod::MIKKTSPACE, &nan, &p, &[glam::Vec2::ZERO; 3], &[[0, 1, 2]]).is_err());
}

#[test]
fn methods_have_names() {
    for method in FrameMethod::all().iter().copied() {
        assert_eq!(FrameMethod::named(method.name()).unwrap(), method);
    }
    assert!(FrameMethod::named("nonesuch").unwrap_err().to_string().contains("nonesuch"));
}

#[test]
fn huge_positions_stay_finite() {
    let huge = [[-3e38, 0., 0.], [3e38, 0., 0.], [0., 3e38, 0.]];
    assert_sound(&Mesh::from_arrays(&huge, &[[0, 1, 2]], &UVS, None, None).unwrap(), "huge");
    let tiny = POSITIONS.map(|p| p.map(|x| x * 1e-42));
    assert_sound(&Mesh::from_arrays(&tiny, &[[0, 1, 2]], &UVS, None, None).unwrap(), "tiny");
}
