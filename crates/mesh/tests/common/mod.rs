//! What the tests share: invariants of every mesh, and the folder of real assets.
#![allow(dead_code)]

pub mod bakes;
pub mod plain;

use std::path::{Path, PathBuf};

use mesh::Mesh;

/// Asserts what the documentation of `Mesh` promises.
pub fn assert_sound(mesh: &Mesh, what: &str) {
    let vertices = mesh.positions.len();
    for length in [mesh.normals.len(), mesh.uvs.len(), mesh.tangents.len(), mesh.dpdu.len(), mesh.dpdv.len()]
    {
        assert_eq!(length, vertices, "{what}");
    }
    assert!(!mesh.indices.is_empty(), "{what}");
    assert!(mesh.indices.iter().flatten().all(|&i| (i as usize) < vertices), "{what}");
    for i in 0..vertices {
        assert!(mesh.positions[i].is_finite() && mesh.uvs[i].is_finite(), "{what}: vertex {i}");
        assert!(mesh.dpdu[i].is_finite() && mesh.dpdv[i].is_finite(), "{what}: vertex {i}");
        assert!((mesh.normals[i].length() - 1.0).abs() < 1e-4, "{what}: normal {i}: {}", mesh.normals[i]);
        let tangent = mesh.tangents[i];
        assert!((tangent.truncate().length() - 1.0).abs() < 2e-3, "{what}: tangent {i}: {tangent}");
        assert!(tangent.w.abs() == 1.0, "{what}: tangent {i}: {tangent}");
    }
    let mut next = 0;
    for part in &mesh.parts {
        assert_eq!(part.triangles.start, next, "{what}");
        assert!(part.triangles.end > next, "{what}");
        next = part.triangles.end;
        assert!(part.material.is_none_or(|m| m < mesh.materials.len()), "{what}");
    }
    assert_eq!(next as usize, mesh.indices.len(), "{what}");
}

/// The folder of real assets, or `None`, said aloud, when it is not there.
pub fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// Every file below a folder.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { folders.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    found
}

/// Angle between two vectors, degrees.
pub fn degrees(a: glam::Vec3, b: glam::Vec3) -> f64 {
    a.as_dvec3().angle_between(b.as_dvec3()).to_degrees()
}
