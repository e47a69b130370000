//! The generated shapes against their closed forms.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use common::{assert_sound, degrees};
use glam::{DVec3, Vec2, Vec3};
use mesh::frame::{convention, face_frame};
use mesh::generate::{SurfacePoint, sphere_point, torus_point};
use mesh::{FrameMethod, Mesh, derivatives};

fn shapes() -> Vec<(&'static str, Mesh)> {
    vec![
        ("quad", Mesh::quad(2.0).unwrap()),
        ("rectangle", Mesh::rectangle(3.0, 0.5).unwrap()),
        ("cube", Mesh::cube(2.0).unwrap()),
        ("sphere", Mesh::sphere(1.5, 64).unwrap()),
        ("coarse sphere", Mesh::sphere(1.0, 3).unwrap()),
        ("torus", Mesh::torus(1.0, 0.25, 64, 32).unwrap()),
        ("coarse torus", Mesh::torus(1.0, 0.5, 3, 3).unwrap()),
    ]
}

#[test]
fn all_are_sound_and_wound_outwards() {
    for (name, mesh) in shapes() {
        assert_sound(&mesh, name);
        for triangle in &mesh.indices {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
            let face = (b - a).cross(c - a);
            let outward: Vec3 = triangle.iter().map(|&i| mesh.normals[i as usize]).sum();
            assert!(face.dot(outward) > 0.0, "{name}: {triangle:?}");
        }
    }
}

#[test]
fn images_are_unmirrored_and_frames_agree() {
    for (name, mesh) in shapes() {
        for i in 0..mesh.positions.len() {
            let (n, t) = (mesh.normals[i], mesh.tangents[i]);
            assert_eq!(t.w, 1.0, "{name}: unmirrored from outside");
            assert!(n.dot(t.truncate()).abs() < 1e-6);
            let up = convention::bitangent(n, t);
            assert!(degrees(up, -mesh.dpdv[i]) < 1e-3, "{name}: bitangent up, dP/dv down");
            if mesh.dpdu[i] != Vec3::ZERO {
                assert!(degrees(t.truncate(), mesh.dpdu[i]) < 1e-3, "{name}");
            }
        }
    }
}

/// `dP/du`, `dP/dv` of a closed form against central differences of its positions.
fn check_form(point: impl Fn(f64, f64) -> SurfacePoint) {
    let h = 1e-6;
    for i in 1..20 {
        for j in 1..20 {
            let (u, v) = (f64::from(i) / 20.0 + 0.003, f64::from(j) / 20.0 + 0.007);
            let at = point(u, v);
            let du = (point(u + h, v).position - point(u - h, v).position) / (2.0 * h);
            let dv = (point(u, v + h).position - point(u, v - h).position) / (2.0 * h);
            assert!((du - at.dpdu).length() < 1e-8 * (1.0 + du.length()), "{du} {}", at.dpdu);
            assert!((dv - at.dpdv).length() < 1e-8 * (1.0 + dv.length()), "{dv} {}", at.dpdv);
            let normal = dv.cross(du).normalize();
            assert!((normal - at.normal).length() < 1e-8);
            let turned = |a: SurfacePoint, b: SurfacePoint| (a.normal - b.normal) / (2.0 * h);
            assert!((turned(point(u + h, v), point(u - h, v)) - at.dndu).length() < 1e-7);
            assert!((turned(point(u, v + h), point(u, v - h)) - at.dndv).length() < 1e-7);
            assert!((at.along - du.normalize()).length() < 1e-8);
        }
    }
}

#[test]
fn closed_forms_match_finite_differences() {
    check_form(|u, v| sphere_point(1.7, u, v));
    check_form(|u, v| torus_point(2.0, 0.6, u, v));
}

#[test]
fn vertices_lie_on_the_closed_forms() {
    let sphere = Mesh::sphere(1.7, 24).unwrap();
    for (i, uv) in sphere.uvs.iter().enumerate() {
        let point = sphere_point(1.7f32.into(), uv.x.into(), uv.y.into());
        assert!((point.position.as_vec3() - sphere.positions[i]).length() < 1e-5);
        assert!((point.dpdv.as_vec3() - sphere.dpdv[i]).length() < 1e-5);
        if 0.0 < uv.y && uv.y < 1.0 {
            assert!((point.dpdu.as_vec3() - sphere.dpdu[i]).length() < 1e-5);
        }
    }
    // At the poles it is that of the one triangle there.
    for triangle in &sphere.indices {
        let at = triangle.map(|i| i as usize);
        let Some(&pole) = at.iter().find(|&&i| sphere.uvs[i].y == 0.0 || sphere.uvs[i].y == 1.0) else {
            continue;
        };
        let frame =
            face_frame(at.map(|i| sphere.positions[i].as_dvec3()), at.map(|i| sphere.uvs[i].as_dvec2()));
        assert!((frame.unwrap().dpdu.as_vec3() - sphere.dpdu[pole]).length() < 1e-4);
    }
    let torus = Mesh::torus(2.0, 0.6, 24, 12).unwrap();
    for (i, uv) in torus.uvs.iter().enumerate() {
        let point = torus_point(2.0, 0.6f32.into(), uv.x.into(), uv.y.into());
        assert!((point.position.as_vec3() - torus.positions[i]).length() < 1e-5);
        assert!((point.dpdu.as_vec3() - torus.dpdu[i]).length() < 1e-4);
    }
}

#[test]
fn the_quad_faces_z_with_u_right_and_v_down() {
    let quad = Mesh::quad(2.0).unwrap();
    let at = |uv: Vec2| quad.positions[quad.uvs.iter().position(|&t| t == uv).unwrap()];
    assert_eq!(at(Vec2::ZERO), Vec3::new(-1.0, 1.0, 0.0));
    assert_eq!(at(Vec2::ONE), Vec3::new(1.0, -1.0, 0.0));
    assert!(quad.normals.iter().all(|&n| n == Vec3::Z));
    assert!(quad.dpdu.iter().all(|&d| d == 2.0 * Vec3::X));
    assert!(quad.dpdv.iter().all(|&d| d == -2.0 * Vec3::Y));
}

#[test]
fn the_cube_shows_the_map_upright_on_every_face() {
    let cube = Mesh::cube(2.0).unwrap();
    assert_eq!(cube.positions.len(), 24);
    let mut faces: Vec<Vec3> = cube.normals.clone();
    faces.dedup();
    assert_eq!(faces.len(), 6);
    for i in 0..24 {
        assert!((cube.positions[i].dot(cube.normals[i]) - 1.0).abs() < 1e-6);
        let up = -cube.dpdv[i].normalize();
        let expected = match cube.normals[i] {
            Vec3::Y => Vec3::NEG_Z,
            Vec3::NEG_Y => Vec3::Z,
            _ => Vec3::Y,
        };
        assert_eq!(up, expected);
    }
}

#[test]
fn the_sphere_has_north_up_and_faces_z() {
    let middle = sphere_point(1.0, 0.5, 0.5);
    assert!((middle.position - DVec3::Z).length() < 1e-12);
    assert!((middle.along - DVec3::X).length() < 1e-12);
    assert!((sphere_point(1.0, 0.3, 0.0).position - DVec3::Y).length() < 1e-12);
    let sphere = Mesh::sphere(1.0, 16).unwrap();
    let poles = sphere.uvs.iter().filter(|t| t.y == 0.0 || t.y == 1.0).count();
    assert_eq!(poles, 32, "a pole vertex of its own for each triangle");
}

/// Averaged derivatives and MikkTSpace on fine meshes come close to the closed forms.
#[test]
fn averaged_frames_approach_the_closed_forms() {
    for (name, mesh) in
        [("sphere", Mesh::sphere(1.0, 256).unwrap()), ("torus", Mesh::torus(1.0, 0.4, 256, 128).unwrap())]
    {
        let found = derivatives(&mesh.positions, &mesh.normals, &mesh.uvs, &mesh.tangents, &mesh.indices);
        assert!(found.warnings.is_empty(), "{name}: {:?}", found.warnings);
        let split = mesh.tangents(FrameMethod::MIKKTSPACE).unwrap();
        assert_eq!(split.source.len(), mesh.positions.len(), "{name}: nothing to split");
        let [dndu, dndv] = mesh.normal_derivatives();
        for i in 0..mesh.positions.len() {
            // Next to a pole the triangles span a finite turn however fine the mesh.
            if name == "sphere" && !(0.15..0.85).contains(&mesh.uvs[i].y) {
                continue;
            }
            let error = (found.dpdu[i] - mesh.dpdu[i]).length() / mesh.dpdu[i].length();
            assert!(error < 0.02, "{name} vertex {i}: dP/du off by {error}");
            let error = (found.dpdv[i] - mesh.dpdv[i]).length() / mesh.dpdv[i].length();
            assert!(error < 0.02, "{name} vertex {i}: dP/dv off by {error}");
            let uv = mesh.uvs[i].as_dvec2();
            let truth = if name == "sphere" {
                sphere_point(1.0, uv.x, uv.y)
            } else {
                torus_point(1.0, 0.4, uv.x, uv.y)
            };
            for (found, truth) in [(dndu[i], truth.dndu), (dndv[i], truth.dndv)] {
                let error = (found.as_dvec3() - truth).length();
                assert!(error < 0.02 * std::f64::consts::TAU, "{name} vertex {i}: dN off by {error}");
            }
            let angle = degrees(split.tangents[i].truncate(), mesh.tangents[i].truncate());
            assert!(angle < 1.0 && split.tangents[i].w == 1.0, "{name} vertex {i}: {angle} degrees");
        }
    }
}

#[test]
fn senseless_parameters_are_refused() {
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-20, 1e30] {
        assert!(Mesh::quad(bad).is_err());
        assert!(Mesh::rectangle(1.0, bad).is_err());
        assert!(Mesh::cube(bad).is_err());
        assert!(Mesh::sphere(bad, 8).is_err());
        assert!(Mesh::torus(bad, 0.1, 8, 8).is_err());
        assert!(Mesh::torus(1.0, bad, 8, 8).is_err());
    }
    assert!(Mesh::torus(1.0, 1.0, 8, 8).is_err());
    for bad in [0, 2, 2049, u32::MAX] {
        assert!(Mesh::sphere(1.0, bad).is_err());
        assert!(Mesh::torus(1.0, 0.1, bad, 8).is_err());
        assert!(Mesh::torus(1.0, 0.1, 8, bad).is_err());
    }
}
