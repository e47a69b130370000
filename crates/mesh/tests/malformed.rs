//! Bad files: each is read or refused within seconds, and never panics.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use std::path::Path;
use std::time::{Duration, Instant};

use common::{assert_sound, files, shared};
use mesh::Mesh;
use proptest::prelude::*;

/// Opens every mesh below a folder; returns how many were read and how many refused.
fn open_all(folder: &Path) -> (usize, usize) {
    let (mut read, mut refused) = (0, 0);
    for path in files(folder) {
        let suffix = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if !["obj", "gltf", "glb"].contains(&suffix.as_str()) {
            continue;
        }
        let start = Instant::now();
        match Mesh::open(&path) {
            Ok(mesh) => {
                assert_sound(&mesh, &path.display().to_string());
                println!("{}: read, {:?}", path.display(), mesh.warnings);
                read += 1;
            }
            Err(error) => {
                let message = error.to_string();
                println!("{}: {message}", path.display());
                assert!(message.len() > 10 && message.len() < 600, "{message}");
                refused += 1;
            }
        }
        assert!(start.elapsed() < Duration::from_secs(10), "{}: {:?}", path.display(), start.elapsed());
    }
    (read, refused)
}

#[test]
fn our_own_hostile_files_are_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/hostile/mesh");
    let (_, refused) = open_all(&folder.join("refused"));
    assert!(refused > 40, "{refused}");
    for path in files(&folder.join("refused")) {
        assert!(Mesh::open(&path).is_err(), "{}", path.display());
    }
    let (read, refused) = open_all(&folder.join("accepted"));
    assert!(read > 10 && refused == 0, "{read} read, {refused} refused");
}

#[test]
fn files_of_other_projects_are_read_or_refused() {
    for (name, least) in [("gltf-validator", 80), ("assimp", 20), ("tinygltf", 5)] {
        let Some(folder) = shared(&format!("malformed/{name}")) else { return };
        let (read, refused) = open_all(&folder);
        println!("{name}: {read} read, {refused} refused");
        assert!(read + refused >= least, "{name}: {read} + {refused}");
    }
}

#[test]
fn paths_that_are_no_files_are_refused() {
    assert!(matches!(Mesh::open("/nonexistent/x.obj"), Err(mesh::MeshError::NotFound { .. })));
    assert!(matches!(Mesh::open(env!("CARGO_MANIFEST_DIR")), Err(mesh::MeshError::Read { .. })));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.stl");
    std::fs::write(&path, "solid").unwrap();
    assert!(matches!(Mesh::open(&path), Err(mesh::MeshError::UnknownFormat { .. })));
}

/// A GLB with everything the reader knows, small enough to be mutated often.
fn rich_glb() -> Vec<u8> {
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0,"scale":[-1,2,1],"children":[1]},{"mesh":0,"translation":[3,0,0]}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1,"NORMAL":3},"indices":2,"material":0,"mode":5}]}],
"materials":[{"normalTexture":{"index":0,"scale":0.5,"extensions":{"KHR_texture_transform":{"offset":[0.1,0.2],"rotation":0.3,"scale":[2,3]}}}}],
"textures":[{"source":0}],"images":[{"bufferView":3,"mimeType":"image/png"}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":3,"componentType":5121},"values":{"bufferView":0}}},
{"bufferView":1,"componentType":5123,"count":4,"type":"VEC2","normalized":true},
{"bufferView":2,"componentType":5121,"count":4,"type":"SCALAR"},
{"bufferView":4,"componentType":5120,"count":4,"type":"VEC3","normalized":true}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":16},{"buffer":0,"byteOffset":64,"byteLength":4},{"buffer":0,"byteOffset":68,"byteLength":4},{"buffer":0,"byteOffset":72,"byteLength":16,"byteStride":4}],
"buffers":[{"byteLength":88}]}"#;
    let mut json = json.replace('\n', "").into_bytes();
    while !json.len().is_multiple_of(4) {
        json.push(b' ');
    }
    let mut binary = Vec::new();
    for x in [0f32, 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.5] {
        binary.extend(x.to_le_bytes());
    }
    for x in [0u16, 65535, 65535, 65535, 0, 0, 65535, 0] {
        binary.extend(x.to_le_bytes());
    }
    binary.extend([0, 1, 2, 3, 3, 0, 0, 0]);
    binary.extend([0, 0, 127, 0].repeat(4));
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend(((12 + 8 + json.len() + 8 + binary.len()) as u32).to_le_bytes());
    glb.extend((json.len() as u32).to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(&json);
    glb.extend((binary.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(&binary);
    glb
}

const RICH_OBJ: &str = "mtllib nothing.mtl\no box\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5 0.1 0.2 0.3\n\
vt 0 0\nvt 1 0\nvt 1 1\nvt 0.25\nvn 0 0 2\ng a b\nusemtl x\nf 1/1/1 2/2/1 3/3/1 4/4/1\nf -4 -3 -2\ns 1\n\
f 1//1 \\\n 2//1 3//1\nl 1 2\np 1\n";

#[test]
fn the_seeds_of_the_mutations_are_good() {
    let mesh = Mesh::from_gltf(&rich_glb(), None).unwrap();
    assert_sound(&mesh, "rich glb");
    assert_eq!((mesh.parts.len(), mesh.indices.len()), (2, 4));
    assert!(mesh.materials[0].normal.is_some());
    let mesh = Mesh::from_obj(RICH_OBJ.as_bytes(), Path::new("")).unwrap();
    assert_sound(&mesh, "rich obj");
    assert_eq!(mesh.indices.len(), 4);
}

fn mutated(mut bytes: Vec<u8>, edits: &[(usize, u8)], cut: usize) -> Vec<u8> {
    let length = bytes.len();
    for &(at, value) in edits {
        bytes[at % length] = value;
    }
    bytes.truncate(length - cut % length);
    bytes
}

fn never_panics(result: Result<Mesh, mesh::MeshError>) {
    if let Ok(mesh) = result {
        assert_sound(&mesh, "mutated");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(3000) })]

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        never_panics(Mesh::from_gltf(&bytes, None));
        never_panics(Mesh::from_obj(&bytes, Path::new("")));
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend(bytes);
        never_panics(Mesh::from_gltf(&glb, None));
    }

    #[test]
    fn mutated_glbs_never_panic(
        edits in prop::collection::vec((any::<usize>(), any::<u8>()), 1..4),
        cut in prop_oneof![4 => Just(0usize), 1 => any::<usize>()],
    ) {
        never_panics(Mesh::from_gltf(&mutated(rich_glb(), &edits, cut), None));
    }

    /// Digits for digits: keeps the JSON valid, so that what it says goes wrong.
    #[test]
    fn glbs_with_other_numbers_never_panic(edits in prop::collection::vec((any::<usize>(), 0u8..10), 1..6)) {
        let mut glb = rich_glb();
        let digits: Vec<usize> = (20..glb.len() - 96).filter(|&i| glb[i].is_ascii_digit()).collect();
        for (at, digit) in edits {
            glb[digits[at % digits.len()]] = b'0' + digit;
        }
        never_panics(Mesh::from_gltf(&glb, None));
    }

    #[test]
    fn mutated_objs_never_panic(
        edits in prop::collection::vec((any::<usize>(), prop::sample::select(b"0123456789-/.e vtfnaou#\\\n\x00\xff".to_vec())), 1..6),
        cut in prop_oneof![4 => Just(0usize), 1 => any::<usize>()],
    ) {
        never_panics(Mesh::from_obj(&mutated(RICH_OBJ.into(), &edits, cut), Path::new("")));
    }
}
