//! glTF by the rules, on files small enough to check by hand.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside #[test] functions

mod common;

use std::path::Path;

use base64::Engine;
use common::assert_sound;
use glam::{Vec2, Vec3, Vec4};
use mesh::{ImageSource, Mesh, MeshError};

/// A document under construction: one buffer, views and accessors into it.
#[derive(Default)]
struct Doc {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

/// Accessors 0 to 3 of `Doc::triangle`.
const ALL: &str = r#""POSITION":0,"TEXCOORD_0":1,"NORMAL":2"#;
const WITH_TANGENT: &str = r#""POSITION":0,"TEXCOORD_0":1,"NORMAL":2,"TANGENT":3"#;

impl Doc {
    /// A triangle in the plane z = 0 with its map upright.
    fn triangle() -> Self {
        let mut doc = Self::default();
        doc.floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0.], "VEC3");
        doc.floats(&[0., 1., 1., 1., 0., 0.], "VEC2");
        doc.floats(&[0., 0., 1., 0., 0., 1., 0., 0., 1.], "VEC3");
        doc.floats(&[1., 0., 0., 1., 1., 0., 0., 1., 1., 0., 0., 1.], "VEC4");
        doc
    }

    fn view(&mut self, bytes: &[u8], more: &str) -> usize {
        let offset = self.bytes.len();
        self.views
            .push(format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{}{more}}}"#, bytes.len()));
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    fn accessor(&mut self, component: u32, count: usize, kind: &str, more: &str) -> usize {
        self.accessors
            .push(format!(r#"{{"componentType":{component},"count":{count},"type":"{kind}"{more}}}"#));
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[f32], kind: &str) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes, "");
        let width = kind.bytes().last().map_or(1, |b| usize::from(b - b'0'));
        self.accessor(5126, values.len() / width, kind, &format!(r#","bufferView":{view}"#))
    }

    fn indices(&mut self, values: &[u8]) -> usize {
        let view = self.view(values, "");
        self.accessor(5121, values.len(), "SCALAR", &format!(r#","bufferView":{view}"#))
    }

    /// Reads the document with `rest` for everything else.
    fn open(&self, rest: &str) -> Result<Mesh, MeshError> {
        let data = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{},"uri":"data:;base64,{data}"}}],
            "bufferViews":[{}],"accessors":[{}],{rest}}}"#,
            self.bytes.len(),
            self.views.join(","),
            self.accessors.join(",")
        );
        let mesh = Mesh::from_gltf(json.as_bytes(), None)?;
        assert_sound(&mesh, rest);
        Ok(mesh)
    }

    /// Reads one node that shows one primitive.
    fn show(&self, node: &str, primitive: &str) -> Result<Mesh, MeshError> {
        self.open(&format!(r#""nodes":[{{"mesh":0{node}}}],"meshes":[{{"primitives":[{{{primitive}}}]}}]"#))
    }
}

fn triangle(node: &str, attributes: &str) -> Mesh {
    Doc::triangle().show(node, &format!(r#""attributes":{{{attributes}}}"#)).unwrap()
}

fn close(a: Vec3, b: Vec3) {
    assert!((a - b).length() < 1e-5, "{a} {b}");
}

#[test]
fn a_plain_triangle_is_read_as_it_is() {
    let mesh = triangle("", ALL);
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(mesh.uvs, [Vec2::Y, Vec2::ONE, Vec2::ZERO]);
    assert_eq!(mesh.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 3]);
    close(mesh.dpdu[0], Vec3::X);
    close(mesh.dpdv[0], -Vec3::Y);
    assert_eq!(mesh.warnings, Vec::<String>::new());
}

#[test]
fn transforms_move_everything() {
    let quarter = std::f32::consts::FRAC_1_SQRT_2;
    let node = format!(r#","translation":[5,0,0],"rotation":[0,0,{quarter},{quarter}],"scale":[2,3,1]"#);
    let mesh = triangle(&node, ALL);
    close(mesh.positions[1], Vec3::new(5.0, 2.0, 0.0));
    close(mesh.positions[2], Vec3::new(2.0, 0.0, 0.0));
    close(mesh.normals[0], Vec3::Z);
    close(mesh.tangents[0].truncate(), Vec3::Y);
    close(mesh.dpdu[0], 2.0 * Vec3::Y);
    close(mesh.dpdv[0], 3.0 * Vec3::X);
}

#[test]
fn a_mirroring_node_reverses_winding_and_w() {
    for attributes in [ALL, WITH_TANGENT] {
        for node in [r#","scale":[-1,1,1]"#, r#","matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]"#] {
            let mesh = triangle(node, attributes);
            assert_eq!(mesh.indices, [[0, 2, 1]]);
            assert_eq!(mesh.normals, [Vec3::Z; 3]);
            assert_eq!(mesh.tangents, [Vec4::new(-1.0, 0.0, 0.0, -1.0); 3]);
            let up = mesh::frame::convention::bitangent(mesh.normals[0], mesh.tangents[0]);
            assert_eq!(up, Vec3::Y, "up the image stays up");
        }
    }
    let mesh = triangle(r#","scale":[-1,-1,1]"#, ALL);
    assert_eq!((mesh.indices[0], mesh.tangents[0].w), ([0, 1, 2], 1.0), "two mirrors make none");
}

#[test]
fn uneven_scales_keep_normals_perpendicular() {
    let mesh = triangle(r#","rotation":[0.5,0,0,0.8660254],"scale":[1,4,0.25]"#, ALL);
    let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[i]);
    let face = (b - a).cross(c - a).normalize();
    mesh.normals.iter().for_each(|n| close(*n, face));
}

#[test]
fn children_inherit_and_other_scenes_are_left_out() {
    let mesh = Doc::triangle()
        .open(&format!(
            r#""scene":1,"scenes":[{{"nodes":[3]}},{{"nodes":[0]}}],
            "nodes":[{{"translation":[1,0,0],"children":[1,2]}},{{"mesh":0,"name":"a","translation":[0,1,0]}},
            {{"mesh":0,"scale":[2,2,2]}},{{"mesh":0}}],
            "meshes":[{{"name":"m","primitives":[{{"attributes":{{"POSITION":0}}}},{{"attributes":{{{ALL}}}}}]}}]"#
        ))
        .unwrap();
    let names: Vec<&str> = mesh.parts.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["a", "a", "m", "m"]);
    assert_eq!(mesh.positions[0], Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(mesh.positions[7], Vec3::new(3.0, 0.0, 0.0));
}

#[test]
fn meshes_without_a_scene_are_shown_as_they_are() {
    let mesh = Doc::triangle()
        .open(&format!(r#""meshes":[{{"primitives":[{{"attributes":{{{ALL}}}}}]}}]"#))
        .unwrap();
    assert_eq!((mesh.indices.len(), mesh.warnings.len()), (1, 1));
}

#[test]
fn given_tangents_are_kept_but_not_without_normals() {
    let mut doc = Doc::triangle();
    let odd = doc.floats(&[0., 2., 0., -1., 0., 1., 0., -1., 0., 1., 0., -1.], "VEC4");
    let kept = doc.show("", &format!(r#""attributes":{{{ALL},"TANGENT":{odd}}}"#)).unwrap();
    assert_eq!(kept.tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 3]);
    let flat =
        doc.show("", &format!(r#""attributes":{{"POSITION":0,"TEXCOORD_0":1,"TANGENT":{odd}}}"#)).unwrap();
    assert_eq!(flat.normals, [Vec3::Z; 3]);
    assert_eq!(flat.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 3]);
}

#[test]
fn missing_normals_are_flat() {
    let mut doc = Doc::default();
    let p = doc.floats(&[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.], "VEC3");
    let i = doc.indices(&[0, 1, 2, 0, 3, 1]);
    let mesh = doc.show("", &format!(r#""attributes":{{"POSITION":{p}}},"indices":{i}"#)).unwrap();
    assert_eq!(mesh.positions.len(), 6, "no vertex is shared");
    assert_eq!(mesh.normals[..3], [Vec3::Z; 3]);
    assert_eq!(mesh.normals[3..], [Vec3::Y; 3]);
}

#[test]
fn indices_strips_and_fans() {
    let mut doc = Doc::triangle();
    let i = doc.indices(&[2, 1, 0, 2]);
    let make = |mode: u32| doc.show("", &format!(r#""attributes":{{{ALL}}},"indices":{i},"mode":{mode}"#));
    let corners = |mesh: Mesh| -> Vec<[u32; 3]> {
        let place = |i: u32| mesh.positions[..3].iter().position(|p| *p == mesh.positions[i as usize]);
        mesh.indices.iter().map(|t| t.map(|i| place(i).unwrap() as u32)).collect()
    };
    assert_eq!(corners(make(5).unwrap()), [[2, 1, 0], [1, 2, 0]], "every other one of a strip is turned");
    assert_eq!(corners(make(6).unwrap()), [[1, 0, 2], [0, 2, 2]]);
    let rest = make(4).unwrap();
    assert_eq!(rest.warnings.len(), 1, "{:?}", rest.warnings);
    assert_eq!(corners(rest), [[2, 1, 0]]);
    assert!(make(1).is_err(), "lines");
}

#[test]
fn unused_vertices_are_left_out() {
    let mut doc = Doc::default();
    let p = doc.floats(&[9., 9., 9., 0., 0., 0., 8., 8., 8., 1., 0., 0., 0., 1., 0.], "VEC3");
    let n = doc.floats(&[0., 0., 1.].repeat(5), "VEC3");
    let i = doc.indices(&[4, 1, 3]);
    let mesh =
        doc.show("", &format!(r#""attributes":{{"POSITION":{p},"NORMAL":{n}}},"indices":{i}"#)).unwrap();
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(mesh.indices, [[2, 0, 1]]);
}

#[test]
fn quantised_and_interleaved_attributes() {
    let mut doc = Doc::triangle();
    // Every 8 bytes: u, v as normalised bytes, then a normal as normalised signed bytes.
    let bytes = [[0u8, 255, 0, 0, 127, 0], [255, 255, 0, 0, 127, 0], [0, 0, 0, 0, 127, 0]];
    let bytes: Vec<u8> = bytes.iter().flat_map(|b| [b[0], b[1], 0, 0, b[2], b[3], b[4], 0]).collect();
    let view = doc.view(&bytes, r#","byteStride":8"#);
    let t = doc.accessor(5121, 3, "VEC2", &format!(r#","bufferView":{view},"normalized":true"#));
    let n =
        doc.accessor(5120, 3, "VEC3", &format!(r#","bufferView":{view},"byteOffset":4,"normalized":true"#));
    let mesh =
        doc.show("", &format!(r#""attributes":{{"POSITION":0,"TEXCOORD_0":{t},"NORMAL":{n}}}"#)).unwrap();
    assert_eq!(mesh.uvs, [Vec2::Y, Vec2::ONE, Vec2::ZERO]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    // Positions as plain shorts.
    let shorts: Vec<u8> = [0i16, 0, 0, -7, 0, 0, 0, -9, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let view = doc.view(&shorts, "");
    let p = doc.accessor(5122, 3, "VEC3", &format!(r#","bufferView":{view}"#));
    let mesh = doc.show("", &format!(r#""attributes":{{"POSITION":{p}}}"#)).unwrap();
    assert_eq!(mesh.positions[1], Vec3::new(-7.0, 0.0, 0.0));
}

#[test]
fn sparse_accessors_replace_and_may_stand_on_zeros() {
    let mut doc = Doc::triangle();
    let at = doc.view(&[2, 0], "");
    let values: Vec<u8> = [0f32, 5., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    let values = doc.view(&values, "");
    let sparse = format!(
        r#","sparse":{{"count":1,"indices":{{"bufferView":{at},"componentType":5123}},"values":{{"bufferView":{values}}}}}"#
    );
    let p = doc.accessor(5126, 3, "VEC3", &format!(r#","bufferView":0{sparse}"#));
    let mesh = doc.show("", &format!(r#""attributes":{{"POSITION":{p}}}"#)).unwrap();
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 5.0, 0.0)]);
    let p = doc.accessor(5126, 3, "VEC3", &sparse);
    let mesh = doc.show("", &format!(r#""attributes":{{"POSITION":{p}}}"#)).unwrap();
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::ZERO, Vec3::new(0.0, 5.0, 0.0)]);
}

/// Shows the triangle with a material; accessor 4 is a second UV set, turned by a quarter.
fn with_material(material: &str) -> Mesh {
    let mut doc = Doc::triangle();
    let second = doc.floats(&[1., 1., 1., 0., 0., 1.], "VEC2");
    doc.open(&format!(
        r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{{ALL},"TEXCOORD_1":{second}}},"material":0}}]}}],
        "textures":[{{"source":0}},{{"source":1}}],
        "images":[{{"uri":"data:image/png;base64,iVBORw0KGgo="}},{{"uri":"nothing.png"}}],"materials":[{{{material}}}]"#
    ))
    .unwrap()
}

#[test]
fn the_normal_textures_uv_set_is_used() {
    let mesh = with_material(r#""normalTexture":{"index":0,"texCoord":1,"scale":0.25}"#);
    assert_eq!(mesh.uvs[0], Vec2::ONE);
    close(mesh.tangents[0].truncate(), -Vec3::Y);
    assert_eq!(mesh.materials[0].normal_scale, 0.25);
    assert!(matches!(&mesh.materials[0].normal, Some(ImageSource::Encoded(bytes)) if bytes.len() == 8));
    let mesh = with_material(
        r#""normalTexture":{"index":0,"texCoord":1},"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#,
    );
    assert!(mesh.warnings.iter().any(|w| w.contains("differ in UV set")), "{:?}", mesh.warnings);
}

#[test]
fn uv_transforms_scale_then_rotate_then_move() {
    let transform =
        r#""extensions":{"KHR_texture_transform":{"offset":[0.5,0.25],"rotation":1.5707964,"scale":[2,3]}}"#;
    for material in [
        format!(r#""normalTexture":{{"index":0,{transform}}}"#),
        format!(r#""pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,{transform}}}}}"#),
    ] {
        let mesh = with_material(&material);
        // (0, 1) -> (0, 3) -> a quarter counter-clockwise as seen with v down: (3, 0) -> moved.
        assert!((mesh.uvs[0] - Vec2::new(3.5, 0.25)).length() < 1e-6, "{}", mesh.uvs[0]);
        // (1, 1) -> (2, 3) -> (3, -2) -> moved.
        assert!((mesh.uvs[1] - Vec2::new(3.5, -1.75)).length() < 1e-6, "{}", mesh.uvs[1]);
        // Along +X of the surface v falls by 2: dP/dv = -X / 2, and u grows by 3 down the surface.
        close(mesh.dpdv[0], -0.5 * Vec3::X);
        close(mesh.dpdu[0], Vec3::Y / -3.0);
    }
    let over =
        with_material(r#""normalTexture":{"index":0,"extensions":{"KHR_texture_transform":{"texCoord":1}}}"#);
    assert_eq!(over.uvs[0], Vec2::ONE);
}

#[test]
fn materials_carry_factors_and_missing_images_are_warnings() {
    let mesh = with_material(
        r#""name":"wall","pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,0.4],"roughnessFactor":0.5,
        "baseColorTexture":{"index":1}}"#,
    );
    let material = &mesh.materials[0];
    assert_eq!((material.name.as_str(), material.albedo_factor), ("wall", [0.1, 0.2, 0.3, 0.4]));
    assert!((material.shininess - 30.0).abs() < 1e-4 && (material.specular - 0.25).abs() < 1e-6);
    assert_eq!(material.albedo, None);
    assert!(mesh.warnings.iter().any(|w| w.contains("nothing.png")), "{:?}", mesh.warnings);
}

#[test]
fn buffers_and_images_are_found_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("asset");
    std::fs::create_dir(&inner).unwrap();
    let data: Vec<u8> = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(inner.join("a b.bin"), &data).unwrap();
    std::fs::write(folder.path().join("outside.bin"), &data).unwrap();
    std::fs::write(inner.join("wall.png"), "png").unwrap();
    let json = |buffer: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":36,"uri":"{buffer}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}}],"extras":["any",{{"thing":1}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
            "nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
            "materials":[{{"normalTexture":{{"index":0}}}}],"textures":[{{"source":0}}],"images":[{{"uri":"wall.png"}}]}}"#
        )
    };
    let path = inner.join("x.gltf");
    std::fs::write(&path, json("a%20b.bin")).unwrap();
    let mesh = Mesh::open(&path).unwrap();
    assert_eq!(mesh.materials[0].normal, Some(ImageSource::File(inner.join("wall.png"))));
    std::fs::write(&path, json("../outside.bin")).unwrap();
    let error = Mesh::open(&path).unwrap_err().to_string();
    assert!(error.contains("leaves the folder"), "{error}");
    let absolute = folder.path().join("outside.bin");
    assert!(Mesh::from_gltf(json(absolute.to_str().unwrap()).as_bytes(), Some(Path::new("/"))).is_err());
    assert!(Mesh::from_gltf(json("a%20b.bin").as_bytes(), None).is_err(), "from memory there is no folder");
}

#[test]
fn one_mesh_shown_often_shares_its_vertices_layout() {
    let nodes: Vec<String> = (0..50).map(|i| format!(r#"{{"mesh":0,"translation":[{i},0,0]}}"#)).collect();
    let mesh = Doc::triangle()
        .open(&format!(
            r#""nodes":[{}],"meshes":[{{"primitives":[{{"attributes":{{{ALL}}}}}]}}]"#,
            nodes.join(",")
        ))
        .unwrap();
    assert_eq!((mesh.positions.len(), mesh.parts.len()), (150, 50));
    assert_eq!(mesh.positions[147], Vec3::new(49.0, 0.0, 0.0));
}
