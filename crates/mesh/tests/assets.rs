//! Real meshes. Skipped, saying so, where the folder of real assets is absent.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use std::path::Path;

use common::{assert_sound, degrees, shared};
use glam::Vec3;
use mesh::{FrameMethod, ImageSource, Mesh};

fn open(path: &Path) -> Mesh {
    let mesh = Mesh::open(path).unwrap();
    assert_sound(&mesh, &path.display().to_string());
    mesh
}

/// Angles between the tangents a file gives and MikkTSpace on the same arrays, and how many agree in
/// handedness, corner by corner over the parts whose name contains `part`.
fn against_mikktspace(mesh: &Mesh, part: &str) -> (Vec<f64>, f64) {
    let split = mesh.tangents(FrameMethod::MIKKTSPACE).unwrap();
    let mut angles = Vec::new();
    let mut agree = 0;
    for range in mesh.parts.iter().filter(|p| p.name.contains(part)).map(|p| p.triangles.clone()) {
        for triangle in range.start as usize..range.end as usize {
            for corner in 0..3 {
                let given = mesh.tangents[mesh.indices[triangle][corner] as usize];
                let found = split.tangents[split.indices[triangle][corner] as usize];
                angles.push(degrees(given.truncate(), found.truncate()));
                agree += usize::from(given.w == found.w);
            }
        }
    }
    assert!(!angles.is_empty(), "no part named {part}: {:?}", mesh.parts);
    angles.sort_by(f64::total_cmp);
    let share = agree as f64 / angles.len() as f64;
    (angles, share)
}

#[test]
fn tangents_equal_those_of_the_sample_assets() {
    let Some(path) = shared("playcanvas/AnisotropyRotationTest.glb") else { return };
    let mesh = open(&path);
    for part in ["Band 1", "Band 3", "Band 4R", "Band 5", "Labels"] {
        let (angles, agree) = against_mikktspace(&mesh, part);
        let worst = angles[angles.len() - 1];
        println!("{part}: worst {worst} degrees, w {agree}");
        assert!(worst < 0.05 && agree == 1.0, "{part}: worst {worst}, w {agree}");
    }
    // Negative control: the others were made from rotated UVs and differ by up to a degree.
    let (angles, agree) = against_mikktspace(&mesh, "Band 2");
    assert!((0.05..1.1).contains(&angles[angles.len() - 1]) && agree == 1.0);
}

/// Negative control: the helmet's tangents come from another tool, so they must differ.
#[test]
fn tangents_of_the_helmet_are_not_mikktspace() {
    let Some(path) = shared("bevy/FlightHelmet/FlightHelmet.gltf") else { return };
    let mesh = open(&path);
    assert_eq!(mesh.parts.len(), 6);
    let (angles, agree) = against_mikktspace(&mesh, "");
    println!("helmet: median {}, worst {}, w {agree}", angles[angles.len() / 2], angles[angles.len() - 1]);
    assert!(angles[angles.len() / 2] < 1.0 && angles[angles.len() - 1] > 10.0);
    assert!(agree > 0.999);
    for material in &mesh.materials {
        for image in [&material.albedo, &material.normal] {
            assert!(matches!(image, Some(ImageSource::File(path)) if path.is_file()), "{material:?}");
        }
    }
    assert_eq!(mesh.warnings, Vec::<String>::new());
}

#[test]
fn the_two_sided_plane_keeps_its_tangents() {
    let Some(path) = shared("khronos/TwoSidedPlane/TwoSidedPlane.gltf") else { return };
    let mesh = open(&path);
    let (angles, agree) = against_mikktspace(&mesh, "");
    assert!(angles[angles.len() - 1] < 0.05 && agree == 0.0, "direction exact, w opposite");
}

#[test]
fn negative_scales_keep_faces_outwards_and_frames_right() {
    let Some(path) = shared("khronos/NegativeScaleTest/NegativeScaleTest.glb") else { return };
    let mesh = open(&path);
    let mut checked = 0;
    for triangle in &mesh.indices {
        let at = triangle.map(|i| i as usize);
        let [a, b, c] = at.map(|i| mesh.positions[i]);
        let face = (b - a).cross(c - a);
        let normal: Vec3 = at.iter().map(|&i| mesh.normals[i]).sum();
        if face.length() > 1e-9 {
            assert!(face.dot(normal) > 0.0, "{triangle:?}");
            checked += 1;
        }
        for i in at {
            let up = mesh::frame::convention::bitangent(mesh.normals[i], mesh.tangents[i]);
            assert!(up.dot(-mesh.dpdv[i]) > 0.0, "vertex {i}: bitangent against dP/dv");
        }
    }
    assert!(checked > 3000);
}

#[test]
fn other_samples_load() {
    let Some(folder) = shared("khronos") else { return };
    let test = open(&folder.join("NormalTangentTest/NormalTangentTest.glb"));
    assert_eq!(test.indices.len(), 7774);
    assert!(matches!(&test.materials[0].normal, Some(ImageSource::Encoded(b)) if b.starts_with(b"\x89PNG")
        || b.starts_with(b"\xff\xd8")));
    let multi = open(&folder.join("MultiUVTest/MultiUVTest.glb"));
    assert_eq!(multi.indices.len(), 12);
    let transforms = open(&folder.join("TextureTransformMultiTest/TextureTransformMultiTest.glb"));
    assert_eq!(transforms.parts.len(), 29);
}

#[test]
fn the_fuze_bottle_has_its_texture_and_unit_normals() {
    let Some(path) = shared("obj/trimesh/fuze.obj") else { return };
    let mesh = open(&path);
    assert_eq!(mesh.indices.len(), 1000);
    assert_eq!(mesh.parts.len(), 1);
    let material = &mesh.materials[mesh.parts[0].material.unwrap()];
    assert_eq!(material.name, "a-super-duper-material");
    assert!(matches!(&material.albedo, Some(ImageSource::File(p)) if p.ends_with("fuze uv.jpg")));
    assert!(mesh.uvs.iter().all(|t| (0.0..=1.0).contains(&t.y)));
}

#[test]
fn a_missing_bump_map_is_a_warning() {
    let Some(path) = shared("obj/tinyobjloader/map-bump.obj") else { return };
    let mesh = open(&path);
    assert_eq!(mesh.materials.len(), 2);
    assert_eq!(mesh.materials[0].bump, None);
    assert!(mesh.warnings.iter().any(|w| w.contains("bump.jpg")), "{:?}", mesh.warnings);
    assert_eq!(mesh.parts.iter().map(|p| p.material).collect::<Vec<_>>(), [Some(0), Some(1)]);
}

#[test]
fn a_character_with_mirrored_uvs_splits() {
    let Some(path) = shared("obj/meshoptimizer/pirate.obj") else { return };
    let mesh = open(&path);
    assert!(mesh.warnings.iter().any(|w| w.contains("pirate.mtl")), "{:?}", mesh.warnings);
    let left = mesh.tangents.iter().filter(|t| t.w < 0.0).count();
    assert!(left > 100 && left * 5 < mesh.tangents.len(), "{left} of {}", mesh.tangents.len());
    let up = |i: usize| mesh::frame::convention::bitangent(mesh.normals[i], mesh.tangents[i]);
    let against = (0..mesh.positions.len()).filter(|&i| up(i).dot(-mesh.dpdv[i]) <= 0.0).count();
    // Its author turned the normals of a few vertices against their faces.
    assert!(against < 20, "{against}");
}

#[test]
fn torture_meshes_stay_finite() {
    let Some(folder) = shared("obj/mikktspace") else { return };
    for name in ["cube", "doomcone", "doomcone_smooth", "rancid_geometry"] {
        let mesh = open(&folder.join(name).with_extension("obj"));
        for method in FrameMethod::all().iter().copied() {
            assert_sound(&mesh.with_tangents(method).unwrap(), name);
        }
        println!("{name}: {} vertices, {:?}", mesh.positions.len(), mesh.warnings);
    }
}

#[test]
fn the_uv_plane_is_exact() {
    let Some(path) = shared("materialx/plane.obj") else { return };
    let mesh = open(&path);
    let width = mesh.bounds().1 - mesh.bounds().0;
    for i in 0..mesh.positions.len() {
        assert!((mesh.dpdu[i].length() - width.max_element()).abs() < 1e-3 * width.max_element());
        assert!(mesh.dpdu[i].dot(mesh.dpdv[i]).abs() < 1e-3 * width.max_element().powi(2));
    }
}
