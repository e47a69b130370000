//! Reader for Wavefront OBJ with MTL.
//!
//! `tobj` does the grouping into objects and materials. It trusts its input, so the text is first
//! checked line by line and rewritten in a regular form ([`clean`]); what remains cannot overflow
//! or run out of bounds in it. OBJ counts `v` upwards: this reader turns it down.

mod clean;
mod mtl;
mod polygon;
mod text;
mod texture;

use std::collections::HashMap;
use std::io::BufReader;
use std::path::Path;

use glam::{Vec2, Vec3};

use crate::arrays::{Arrays, checked};
use crate::error::MeshError;
use crate::limits::check_elements;
use crate::mesh::{Mesh, Part};
use crate::normals;

/// Reads OBJ; material libraries and textures are looked for in `folder`.
pub(crate) fn read(bytes: &[u8], folder: &Path, name: &str) -> Result<Mesh, MeshError> {
    let mut warnings = Vec::new();
    let text = text::decode(bytes).map_err(|problem| MeshError::malformed(name, problem))?;
    let cleaned = clean::clean(&text, name, &mut warnings)?;
    let library = mtl::read_all(&cleaned.libraries, folder, &mut warnings);
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
    let loaded = tobj::load_obj_buf(&mut BufReader::new(cleaned.text.as_bytes()), &options, |_| {
        Ok((library.materials.clone(), library.index.clone()))
    });
    drop(cleaned.text);
    let (models, _) = loaded.map_err(|error| MeshError::malformed(name, format!("OBJ: {error}")))?;

    let mut arrays = Arrays { normals: Some(Vec::new()), ..Arrays::default() };
    let mut parts = Vec::new();
    for model in models.iter().filter(|m| !m.mesh.indices.is_empty()) {
        let first = arrays.indices.len() as u32;
        append(&mut arrays, &model.mesh);
        parts.push(Part {
            name: if model.name == "unnamed_object" { String::new() } else { model.name.clone() },
            triangles: first..arrays.indices.len() as u32,
            material: model.mesh.material_id,
        });
    }
    if arrays.indices.is_empty() {
        return Err(MeshError::malformed(name, "OBJ: no faces"));
    }
    check_elements("vertices", arrays.positions.len())?;
    let in_file = |error: MeshError| match error {
        MeshError::Arrays { problem } => MeshError::malformed(name, format!("OBJ: {problem}")),
        other => other,
    };
    let arrays = complete_normals(checked(arrays).map_err(in_file)?, &mut warnings);
    let mut mesh = Mesh::assemble(checked(arrays).map_err(in_file)?, &cleaned.quads)?;
    mesh.parts = parts;
    mesh.materials = library.sources;
    warnings.append(&mut mesh.warnings);
    crate::mesh::trim_warnings(&mut warnings);
    mesh.warnings = warnings;
    Ok(mesh)
}

fn append(arrays: &mut Arrays, mesh: &tobj::Mesh) {
    let offset = arrays.positions.len() as u32;
    let vectors =
        |flat: &[f32]| -> Vec<Vec3> { flat.chunks_exact(3).map(|c| Vec3::new(c[0], c[1], c[2])).collect() };
    arrays.positions.extend(vectors(&mesh.positions));
    arrays.uvs.extend(mesh.texcoords.chunks_exact(2).map(|c| Vec2::new(c[0], 1.0 - c[1])));
    if let Some(normals) = &mut arrays.normals {
        normals.extend(vectors(&mesh.normals));
    }
    arrays
        .indices
        .extend(mesh.indices.chunks_exact(3).map(|c| [c[0] + offset, c[1] + offset, c[2] + offset]));
}

/// Makes the normals the file does not give (they arrive as zeros), splitting vertices at creases.
fn complete_normals(mut arrays: Arrays, warnings: &mut Vec<String>) -> Arrays {
    let Some(normals) = arrays.normals.take() else { return arrays };
    let missing = normals.iter().filter(|n| **n == Vec3::ZERO).count();
    if missing == 0 {
        arrays.normals = Some(normals);
        return arrays;
    }
    if missing < normals.len() {
        warnings.push(format!("{missing} of {} vertices have no normal; generated", normals.len()));
    }
    let made = normals::creased(&arrays.positions, &arrays.indices);
    let mut known: Vec<Option<Vec3>> = normals.iter().map(|n| (*n != Vec3::ZERO).then_some(*n)).collect();
    let given: Vec<bool> = known.iter().map(Option::is_some).collect();
    let mut extra: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    for (triangle, corners) in arrays.indices.iter_mut().zip(made) {
        for (slot, normal) in triangle.iter_mut().zip(corners) {
            let vertex = *slot as usize;
            if given[vertex] || *known[vertex].get_or_insert(normal) == normal {
                continue;
            }
            *slot = *extra.entry((*slot, normal.to_array().map(f32::to_bits))).or_insert_with(|| {
                arrays.positions.push(arrays.positions[vertex]);
                arrays.uvs.push(arrays.uvs[vertex]);
                known.push(Some(normal));
                arrays.positions.len() as u32 - 1
            });
        }
    }
    arrays.normals = Some(known.into_iter().map(|n| n.unwrap_or(Vec3::Z)).collect());
    arrays
}
