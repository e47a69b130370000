//! Puts the primitives of the scene's meshes together, each under its node's transform.

use std::collections::HashMap;

use glam::{DMat3, DMat4, DVec3, Vec3, Vec4};

use super::buffers::Buffers;
use super::material::Materials;
use super::primitive;
use super::scene::Instance;
use crate::error::MeshError;
use crate::limits::{self, MAX_ELEMENTS, check_elements};
use crate::mesh::{Mesh, Part};

/// Appends every instance to `mesh`.
///
/// MikkTSpace belongs to a primitive in its own space, so it is run once there, however often the
/// primitive is shown and however it is scaled.
pub(super) fn build(buffers: &Buffers<'_>, instances: &[Instance], mesh: &mut Mesh) -> Result<(), MeshError> {
    check_total(buffers, instances)?;
    let mut materials = Materials::default();
    let mut finished: HashMap<(usize, usize), Option<Mesh>> = HashMap::new();
    for instance in instances {
        // Checked to be in range by `check_total`.
        let source = &buffers.root.meshes[instance.mesh];
        for (number, primitive) in source.primitives.iter().enumerate() {
            let name =
                if instance.name.is_empty() { source.name.as_deref().unwrap_or("") } else { &instance.name };
            let material = match primitive.material {
                Some(index) => Some(materials.read(buffers, index.value(), &mut mesh.warnings)?),
                None => None,
            };
            let local = match finished.entry((instance.mesh, number)) {
                std::collections::hash_map::Entry::Occupied(entry) => entry.into_mut(),
                std::collections::hash_map::Entry::Vacant(entry) => {
                    let uv = materials.uv(material);
                    let place = format!("mesh {} primitive {number}", instance.mesh);
                    entry.insert(primitive::read(buffers, primitive, &uv, &place, &mut mesh.warnings)?)
                }
            };
            if let Some(local) = local {
                let first = mesh.indices.len() as u32;
                append(mesh, local, &instance.scene_from_mesh);
                let triangles = first..mesh.indices.len() as u32;
                mesh.parts.push(Part { name: limits::name(name).to_owned(), triangles, material });
            }
        }
    }
    check_elements("vertices", mesh.positions.len())?;
    if let Some(vertex) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(buffers.fail(format!("vertex {vertex} lies outside what 32 bits hold once placed")));
    }
    mesh.materials = materials.finish();
    Ok(())
}

/// Refuses scenes that are too large before anything is read: a short file can show one mesh, or
/// open one sparse accessor, any number of times.
fn check_total(buffers: &Buffers<'_>, instances: &[Instance]) -> Result<(), MeshError> {
    let meshes = &buffers.root.meshes;
    let mut cost_of: HashMap<usize, (usize, u64)> = HashMap::new();
    let (mut triangles, mut replaced) = (0usize, 0u64);
    for instance in instances {
        let Some(mesh) = meshes.get(instance.mesh) else {
            return Err(buffers.missing("mesh", instance.mesh, meshes.len()));
        };
        let (shown, opened) = match cost_of.get(&instance.mesh) {
            Some(&(shown, _)) => (shown, 0),
            None => {
                let mut sum = (0usize, 0u64);
                for primitive in &mesh.primitives {
                    let (triangles, replaced) = primitive::cost(buffers, primitive)?;
                    sum = (sum.0.saturating_add(triangles), sum.1.saturating_add(replaced));
                }
                cost_of.insert(instance.mesh, sum);
                sum
            }
        };
        triangles = triangles.saturating_add(shown);
        replaced = replaced.saturating_add(opened);
        check_elements("triangles in the scene", triangles)?;
    }
    if replaced > MAX_ELEMENTS as u64 {
        return Err(buffers.fail(format!("{replaced} sparse elements, at most {MAX_ELEMENTS} accepted")));
    }
    Ok(())
}

/// Appends `local` transformed. A transform that mirrors swaps two corners of each triangle, so that
/// counter-clockwise stays outside, and the sign of `w`, so that the bitangent stays up the image.
fn append(mesh: &mut Mesh, local: &Mesh, scene_from_mesh: &DMat4) {
    let linear = DMat3::from_mat4(*scene_from_mesh);
    let mirrored = linear.determinant() < 0.0;
    let sign = if mirrored { -1.0 } else { 1.0 };
    // Cofactors: the inverse transpose but for a factor, and defined for flattening transforms too.
    let cofactor = sign
        * DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
    let unit = |v: DVec3, fallback: Vec3| v.try_normalize().map_or(fallback, |v| v.as_vec3());
    let offset = mesh.positions.len() as u32;
    let moved = |p: &Vec3| scene_from_mesh.transform_point3(p.as_dvec3()).as_vec3();
    let turned = |v: &Vec3| finite(linear * v.as_dvec3());
    mesh.positions.extend(local.positions.iter().map(moved));
    mesh.normals.extend(local.normals.iter().map(|n| unit(cofactor * n.as_dvec3(), *n)));
    mesh.uvs.extend_from_slice(&local.uvs);
    mesh.tangents.extend(local.tangents.iter().map(|t| -> Vec4 {
        let direction = t.truncate();
        unit(linear * direction.as_dvec3(), direction).extend(t.w * sign as f32)
    }));
    mesh.dpdu.extend(local.dpdu.iter().map(turned));
    mesh.dpdv.extend(local.dpdv.iter().map(turned));
    mesh.indices.extend(local.indices.iter().map(|&[a, b, c]| {
        let [a, b, c] = [a + offset, b + offset, c + offset];
        if mirrored { [a, c, b] } else { [a, b, c] }
    }));
}

/// A vector in 32 bits, its components held within what those can store.
fn finite(v: DVec3) -> Vec3 {
    let most = f64::from(f32::MAX);
    v.clamp(DVec3::splat(-most), DVec3::splat(most)).as_vec3()
}
