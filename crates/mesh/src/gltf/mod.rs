//! Reader for glTF 2.0 and GLB.
//!
//! The `gltf` crate supplies the schema of the JSON part; its validation and its accessor readers
//! can panic on hostile files, so every index and range is checked here before it is used. Nothing
//! is decoded that the chosen scene does not show.

mod accessor;
mod buffers;
mod container;
mod image;
mod material;
mod place;
mod primitive;
mod scene;
mod uri;

use std::path::Path;

use gltf::json::Root;

use crate::error::MeshError;
use crate::mesh::Mesh;

/// Extensions a file may require: those that change nothing we read, and those we follow.
const FOLLOWED: [&str; 3] = ["KHR_texture_transform", "KHR_mesh_quantization", "EXT_texture_webp"];
const HARMLESS: [&str; 6] = [
    "KHR_materials_",
    "KHR_lights_",
    "KHR_xmp",
    "KHR_animation_pointer",
    "KHR_texture_basisu",
    "EXT_lights_",
];

/// Reads glTF or GLB; relative files are looked for in `folder`.
pub(crate) fn read(bytes: &[u8], folder: Option<&Path>, name: &str) -> Result<Mesh, MeshError> {
    let (json, binary) = container::split(bytes, name)?;
    let root: Root = gltf::json::deserialize::from_slice(json)
        .map_err(|error| MeshError::malformed(name, format!("glTF JSON: {error}")))?;
    check_version(&root, name)?;
    let mut mesh = Mesh::default();
    check_extensions(&root, name, &mut mesh.warnings)?;
    let buffers = buffers::Buffers::new(&root, binary, folder, name);
    let instances = scene::instances(&root, name, &mut mesh.warnings)?;
    place::build(&buffers, &instances, &mut mesh)?;
    if mesh.indices.is_empty() {
        return Err(MeshError::malformed(name, "the scene shows no triangles"));
    }
    crate::mesh::trim_warnings(&mut mesh.warnings);
    Ok(mesh)
}

fn check_version(root: &Root, name: &str) -> Result<(), MeshError> {
    let wanted = root.asset.min_version.as_deref().unwrap_or(&root.asset.version);
    let supported = match root.asset.min_version.as_deref() {
        Some(minimum) => minimum == "2.0",
        None => root.asset.version.starts_with("2."),
    };
    if !supported {
        return Err(MeshError::Unsupported {
            name: name.to_owned(),
            problem: format!("glTF version {wanted:?}; 2.0 is read"),
        });
    }
    Ok(())
}

fn check_extensions(root: &Root, name: &str, warnings: &mut Vec<String>) -> Result<(), MeshError> {
    for extension in &root.extensions_required {
        if FOLLOWED.contains(&extension.as_str()) {
            continue;
        }
        if !HARMLESS.iter().any(|prefix| extension.starts_with(prefix)) {
            return Err(MeshError::Unsupported {
                name: name.to_owned(),
                problem: format!("requires the glTF extension {extension:?}, which is not read"),
            });
        }
        warnings.push(format!("the required glTF extension {extension:?} is ignored"));
    }
    Ok(())
}
