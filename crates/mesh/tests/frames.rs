//! Tangent frames: the sign convention, splitting, degenerate input, and MikkTSpace against an
//! independent reading of its definition.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use std::time::{Duration, Instant};

use common::plain::plain_mikktspace;
use common::{assert_sound, degrees};
use glam::{DMat2, DVec2, DVec3, Vec2, Vec3, Vec4};
use mesh::frame::{convention, face_frame};
use mesh::{FrameMethod, Mesh, Split, derivatives, tangents};
use proptest::prelude::*;

/// Two unit squares side by side in the plane z = 0, facing +Z; the right one's map is the left
/// one's mirrored, so that both share the column of vertices at u = 1.
fn mirrored() -> Mesh {
    let positions: Vec<[f32; 3]> =
        [[0., 1.], [1., 1.], [2., 1.], [0., 0.], [1., 0.], [2., 0.]].map(|[x, y]| [x, y, 0.0]).to_vec();
    let uvs = [[0., 0.], [1., 0.], [0., 0.], [0., 1.], [1., 1.], [0., 1.]];
    let indices = [[3, 4, 1], [3, 1, 0], [4, 5, 2], [4, 2, 1]];
    Mesh::from_arrays(&positions, &indices, &uvs, Some(&[[0.0, 0.0, 1.0]; 6]), None).unwrap()
}

#[test]
fn bitangent_is_up_the_image_on_both_sides_of_a_mirror() {
    let mesh = mirrored();
    assert_sound(&mesh, "mirrored");
    assert_eq!(mesh.positions.len(), 8, "the shared column is split");
    for (triangle, (right, w)) in
        mesh.indices.iter().zip([(Vec3::X, 1.0), (Vec3::X, 1.0), (Vec3::NEG_X, -1.0), (Vec3::NEG_X, -1.0)])
    {
        for &i in triangle {
            let i = i as usize;
            assert_eq!(mesh.tangents[i], right.extend(w));
            // Row 0 of the image is at y = 1 on both squares, so up the image is +Y on both.
            assert_eq!(convention::bitangent(mesh.normals[i], mesh.tangents[i]), Vec3::Y);
            assert!((mesh.dpdu[i] - right).length() < 1e-6, "the sides do not cancel");
            assert!((mesh.dpdv[i] - Vec3::NEG_Y).length() < 1e-6);
        }
    }
}

/// Negative control: with `v` counted up, the same arrays give the other `w`.
#[test]
fn counting_v_upwards_would_flip_w() {
    let mesh = mirrored();
    let flipped: Vec<Vec2> = mesh.uvs.iter().map(|t| Vec2::new(t.x, 1.0 - t.y)).collect();
    let split =
        tangents(FrameMethod::MIKKTSPACE, &mesh.positions, &mesh.normals, &flipped, &mesh.indices).unwrap();
    for (triangle, given) in split.indices.iter().zip(&mesh.indices) {
        for (new, old) in triangle.iter().zip(given) {
            assert_eq!(split.tangents[*new as usize].w, -mesh.tangents[*old as usize].w);
        }
    }
}

#[test]
fn splitting_keeps_the_given_vertices_in_front() {
    let mesh = mirrored();
    let joined: Vec<u32> = vec![0, 1, 2, 3, 4, 5];
    let split: Split = tangents(
        FrameMethod::MIKKTSPACE,
        &mesh.positions[..6],
        &mesh.normals[..6],
        &mesh.uvs[..6],
        &[[3, 4, 1], [3, 1, 0], [4, 5, 2], [4, 2, 1]],
    )
    .unwrap();
    assert_eq!(split.source[..6], joined);
    assert!(split.source[6..].iter().all(|&i| i == 1 || i == 4));
    assert_eq!(split.source.len(), split.tangents.len());
}

#[test]
fn dietrich_is_the_inverse_of_the_uv_edges() {
    let p = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.3, -0.4, 0.9), DVec3::new(-0.2, 1.1, 0.4)];
    let t = [DVec2::new(0.2, 0.9), DVec2::new(0.8, 0.7), DVec2::new(0.3, 0.1)];
    let frame = face_frame(p, t).unwrap();
    let inverse = DMat2::from_cols(t[1] - t[0], t[2] - t[0]).inverse();
    let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
    let dpdu = e1 * inverse.x_axis.x + e2 * inverse.x_axis.y;
    let dpdv = e1 * inverse.y_axis.x + e2 * inverse.y_axis.y;
    assert!((frame.dpdu - dpdu).length() < 1e-12, "{} {dpdu}", frame.dpdu);
    assert!((frame.dpdv - dpdv).length() < 1e-12);
    assert_eq!(face_frame(p, [t[0]; 3]), None);
    assert_eq!(face_frame(p, [t[0], t[1], (t[0] + t[1]) / 2.0]), None);
}

#[test]
fn dietrich_frames_are_one_per_face() {
    let mesh =
        Mesh::torus(1.0, 0.4, 12, 8).unwrap().with_tangents(FrameMethod::named("dietrich").unwrap()).unwrap();
    assert_sound(&mesh, "dietrich");
    for triangle in &mesh.indices {
        let at = triangle.map(|i| i as usize);
        let frame =
            face_frame(at.map(|i| mesh.positions[i].as_dvec3()), at.map(|i| mesh.uvs[i].as_dvec2())).unwrap();
        for i in at {
            let n = mesh.normals[i];
            let flat = frame.dpdu.as_vec3() - n * n.dot(frame.dpdu.as_vec3());
            assert!(degrees(flat, mesh.tangents[i].truncate()) < 0.1);
            assert_eq!(mesh.tangents[i].w, 1.0);
        }
    }
}

#[test]
fn degenerate_uvs_are_finite_and_said() {
    let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]];
    let indices = [[0, 1, 2], [2, 1, 3]];
    for uvs in [
        [[0.5, 0.5]; 4],
        [[0., 0.], [1., 1.], [2., 2.], [3., 3.]],
        [[0., 0.], [0., 0.], [1., 0.], [1., 0.]],
        [[1e30, 1e30], [-1e30, 1e30], [1e30, 1e30], [1e30, 1e30]],
        [[1e-40, 0.], [0., 1e-40], [0., 0.], [0., 0.]],
    ] {
        for method in FrameMethod::all().iter().copied() {
            let mesh = Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap();
            assert_sound(&mesh, "degenerate");
            assert!(mesh.warnings.iter().any(|w| w.contains("degenerate")), "{uvs:?}: {:?}", mesh.warnings);
            assert_sound(&mesh.with_tangents(method).unwrap(), "degenerate");
        }
    }
}

#[test]
fn zero_area_triangles_take_their_neighbours_tangents() {
    let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];
    let uvs = [[0., 1.], [1., 1.], [0., 0.]];
    let indices = [[0, 1, 2], [0, 0, 1], [2, 2, 2]];
    let mesh = Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap();
    assert_eq!(mesh.positions.len(), 3);
    assert!(mesh.tangents.iter().all(|&t| t == Vec4::new(1.0, 0.0, 0.0, 1.0)), "{:?}", mesh.tangents);
}

#[test]
fn derivatives_have_the_length_of_the_surface() {
    // A triangle of 4 x 2 mesh units that uses half the map across and a quarter down.
    let positions = [[0., 0., 0.], [4., 0., 0.], [0., 2., 0.]];
    let uvs = [[0., 0.25], [0.5, 0.25], [0., 0.]];
    let mesh = Mesh::from_arrays(&positions, &[[0, 1, 2]], &uvs, None, None).unwrap();
    for i in 0..3 {
        assert!((mesh.dpdu[i] - Vec3::new(8.0, 0.0, 0.0)).length() < 1e-5);
        assert!((mesh.dpdv[i] - Vec3::new(0.0, -8.0, 0.0)).length() < 1e-5);
    }
}

#[test]
fn derivatives_turn_onto_bent_normals_without_shrinking() {
    let bent = Vec3::new(0.5, 0.0, 1.0).normalize();
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let uvs = [Vec2::new(0., 1.), Vec2::new(1., 1.), Vec2::new(0., 0.)];
    for normal in [bent, -bent] {
        let found = derivatives(&positions, &[normal; 3], &uvs, &[Vec4::X; 3], &[[0, 1, 2]]);
        for i in 0..3 {
            assert!(found.dpdu[i].dot(normal).abs() < 1e-6 && found.dpdv[i].dot(normal).abs() < 1e-6);
            assert!((found.dpdu[i].length() - 1.0).abs() < 1e-6, "{}", found.dpdu[i]);
            assert!(found.dpdu[i].x > 0.8 && found.dpdv[i].y < -0.9);
        }
    }
}

/// A fan of `count` triangles around one vertex, a cone over a disc.
fn fan(count: u32) -> (Vec<Vec3>, Vec<Vec3>, Vec<Vec2>, Vec<[u32; 3]>) {
    let mut positions = vec![Vec3::Z];
    let mut uvs = vec![Vec2::splat(0.5)];
    for i in 0..count {
        let (sin, cos) = (std::f32::consts::TAU * i as f32 / count as f32).sin_cos();
        positions.push(Vec3::new(cos, sin, 0.0));
        uvs.push(Vec2::new(0.5 + 0.5 * cos, 0.5 - 0.5 * sin));
    }
    let normals = vec![Vec3::Z; positions.len()];
    let indices = (0..count).map(|i| [0, 1 + i, 1 + (i + 1) % count]).collect();
    (positions, normals, uvs, indices)
}

/// The reference recurses around a vertex and compares all pairs of faces there.
#[test]
fn huge_fans_neither_overflow_the_stack_nor_hang() {
    for count in [300, 5_000, 10_000, 200_000] {
        let (positions, normals, uvs, indices) = fan(count);
        let start = Instant::now();
        let split = tangents(FrameMethod::MIKKTSPACE, &positions, &normals, &uvs, &indices).unwrap();
        assert!(start.elapsed() < Duration::from_secs(20), "{count}: {:?}", start.elapsed());
        assert!(split.tangents.iter().all(|t| t.is_finite()));
        // u runs along +X and the cone is even all around.
        assert!(split.tangents[0].abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-3), "{}", split.tangents[0]);
    }
}

/// One triangle a hundred thousand times over: every edge is shared by all of them.
#[test]
fn repeated_triangles_do_not_hang() {
    let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]];
    let uvs = [[0., 1.], [1., 1.], [0., 0.]];
    let start = Instant::now();
    let mesh = Mesh::from_arrays(&positions, &vec![[0, 1, 2]; 100_000], &uvs, None, None).unwrap();
    assert!(start.elapsed() < Duration::from_secs(20));
    assert!(mesh.tangents.iter().all(|&t| t == Vec4::new(1.0, 0.0, 0.0, 1.0)));
}

/// Triangles at one place with UVs of their own: nothing welds, though all positions are equal.
#[test]
fn stacked_triangles_do_not_hang() {
    let count = 100_000u32;
    let positions = [[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.]].repeat(count as usize);
    let uvs: Vec<[f32; 2]> =
        (0..count).map(|i| i as f32 / 1e5).flat_map(|u| [[u, 1.], [u + 1., 1.], [u, 0.]]).collect();
    let indices: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let start = Instant::now();
    let mesh = Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap();
    assert!(start.elapsed() < Duration::from_secs(20));
    assert!(mesh.tangents.iter().all(|t| t.x > 0.999 && t.w == 1.0));
}

fn compare_with_plain(mesh: &Mesh, what: &str) {
    let split = mesh.tangents(FrameMethod::MIKKTSPACE).unwrap();
    let triangles: Vec<Vec<u32>> = mesh.indices.iter().map(|t| t.to_vec()).collect();
    let plain = plain_mikktspace(mesh, &triangles).concat();
    let mut compared = 0;
    for (corner, expected) in plain.iter().enumerate() {
        let Some((direction, w)) = expected else { continue };
        let found = split.tangents[split.indices[corner / 3][corner % 3] as usize];
        let angle = degrees(direction.as_vec3(), found.truncate());
        assert!(angle < 0.05, "{what} corner {corner}: {angle} degrees, {direction} {found}");
        assert_eq!(*w, found.w, "{what} corner {corner}");
        compared += 1;
    }
    assert!(compared * 10 > plain.len() * 9, "{what}: {compared} of {}", plain.len());
}

#[test]
fn mikktspace_agrees_with_its_definition_on_generated_shapes() {
    compare_with_plain(&Mesh::cube(1.0).unwrap(), "cube");
    compare_with_plain(&Mesh::sphere(1.0, 24).unwrap(), "sphere");
    compare_with_plain(&Mesh::torus(1.0, 0.4, 24, 12).unwrap(), "torus");
    compare_with_plain(&mirrored(), "mirrored");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    /// A bumpy grid with a warped map, mirrored in its middle. Not so steep that a face looks away
    /// from a vertex normal: there MikkTSpace parts faces whose projections are opposite.
    #[test]
    fn mikktspace_agrees_with_its_definition_on_warped_grids(
        heights in prop::collection::vec(-0.06f32..0.06, 49),
        shifts in prop::collection::vec(-0.06f32..0.06, 98),
    ) {
        let mut positions = Vec::new();
        let mut uvs = Vec::new();
        for i in 0..49usize {
            let (x, y) = ((i % 7) as f32 / 6.0, (i / 7) as f32 / 6.0);
            positions.push([x, y, heights[i]]);
            uvs.push([(x - 0.5).abs() + shifts[2 * i] * 0.5, 1.0 - y + shifts[2 * i + 1]]);
        }
        let mut indices = Vec::new();
        for i in 0..6u32 {
            for j in 0..6u32 {
                let a = i * 7 + j;
                indices.extend([[a, a + 1, a + 8], [a, a + 8, a + 7]]);
            }
        }
        let mesh = Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap();
        assert_sound(&mesh, "grid");
        compare_with_plain(&mesh, "grid");
    }

    #[test]
    fn any_arrays_give_sound_meshes_or_errors(
        numbers in prop::collection::vec(any::<f32>(), 40),
        corners in prop::collection::vec(0u32..9, 3..30),
        normals in any::<bool>(),
        tangents in any::<bool>(),
    ) {
        let positions: Vec<[f32; 3]> = numbers.chunks_exact(5).map(|c| [c[0], c[1], c[2]]).collect();
        let uvs: Vec<[f32; 2]> = numbers.chunks_exact(5).map(|c| [c[3], c[4]]).collect();
        let indices: Vec<[u32; 3]> = corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let given_normals = normals.then(|| positions.clone());
        let given_tangents: Option<Vec<[f32; 4]>> =
            tangents.then(|| numbers.chunks_exact(5).map(|c| [c[0], c[1], c[2], c[3]]).collect());
        let made = Mesh::from_arrays(
            &positions, &indices, &uvs, given_normals.as_deref(), given_tangents.as_deref(),
        );
        if let Ok(mesh) = made {
            assert_sound(&mesh, "any");
            for method in FrameMethod::all().iter().copied() {
                assert_sound(&mesh.with_tangents(method).unwrap(), "any");
            }
        }
    }
}
