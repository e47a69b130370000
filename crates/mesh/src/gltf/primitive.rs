//! One primitive: from accessors to a finished mesh in its own space.

use glam::{Vec2, Vec3, Vec4};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{self, Elements};
use super::buffers::Buffers;
use super::material::UvChoice;
use crate::arrays::{Arrays, checked};
use crate::error::MeshError;
use crate::mesh::Mesh;
use crate::normals;

fn attribute(primitive: &Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value())
}

fn is_triangles(mode: &Checked<Mode>) -> bool {
    matches!(mode, Checked::Valid(Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan))
}

/// Most triangles the primitive can have, and what reading it costs beyond them.
pub(super) fn cost(buffers: &Buffers<'_>, primitive: &Primitive) -> Result<(usize, u64), MeshError> {
    let Some(positions) = attribute(primitive, Semantic::Positions).filter(|_| is_triangles(&primitive.mode))
    else {
        return Ok((0, 0));
    };
    let corners = accessor::count(buffers, primitive.indices.map_or(positions, |i| i.value()))?;
    let triangles = match primitive.mode {
        Checked::Valid(Mode::Triangles) => corners / 3,
        _ => corners.saturating_sub(2),
    };
    let used = primitive.attributes.values().map(|i| i.value()).chain(primitive.indices.map(|i| i.value()));
    Ok((triangles, used.map(|index| accessor::replaced(buffers, index)).fold(0, u64::saturating_add)))
}

/// Reads a primitive; `None`, with a warning, for points and lines. `place` is used in messages.
///
/// Vertices that no triangle uses are left out.
pub(super) fn read(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    uv: &UvChoice,
    place: &str,
    warnings: &mut Vec<String>,
) -> Result<Option<Mesh>, MeshError> {
    if !is_triangles(&primitive.mode) {
        warnings.push(format!("{place}: points and lines are left out"));
        return Ok(None);
    }
    let compressed =
        |e: &gltf::json::extensions::mesh::Primitive| e.others.contains_key("KHR_draco_mesh_compression");
    let Some(positions) = attribute(primitive, Semantic::Positions) else {
        warnings.push(format!("{place}: has no POSITION and is left out"));
        return Ok(None);
    };
    let positions: Elements<'_, 3> = Elements::new(buffers, positions, &format!("{place}, POSITION"))
        .map_err(|error| match primitive.extensions.as_ref().filter(|e| compressed(e)) {
            Some(_) => MeshError::Unsupported {
                name: buffers.name.to_owned(),
                problem: format!("{place}: KHR_draco_mesh_compression is not read"),
            },
            None => error,
        })?;
    let corners = corners(buffers, primitive, positions.len(), place)?;
    let triangles = triangles(primitive, &corners, place, warnings);
    if triangles.is_empty() {
        warnings.push(format!("{place}: has no triangles"));
        return Ok(None);
    }
    if primitive.targets.as_ref().is_some_and(|t| !t.is_empty()) {
        warnings.push(format!("{place}: morph targets are ignored"));
    }
    let (used, indices) = compact(&triangles, positions.len());
    let mut arrays = Arrays {
        positions: gather(&positions, &used, Vec3::from_array),
        uvs: read_uvs(buffers, primitive, uv, &used, positions.len(), place, warnings)?,
        normals: optional(buffers, primitive, Semantic::Normals, &used, positions.len(), place)?
            .map(|n: Vec<[f32; 3]>| n.into_iter().map(Vec3::from_array).collect()),
        tangents: optional(buffers, primitive, Semantic::Tangents, &used, positions.len(), place)?
            .map(|t: Vec<[f32; 4]>| t.into_iter().map(Vec4::from_array).collect()),
        indices,
    };
    if arrays.tangents.is_some() && uv.turns() {
        warnings.push(format!("{place}: the UV transform turns the texture, but TANGENT is kept as given"));
    }
    let in_place = |error: MeshError| match error {
        MeshError::Arrays { problem } => buffers.fail(format!("{place}: {problem}")),
        other => other,
    };
    arrays = checked(arrays).map_err(in_place)?;
    if arrays.normals.is_none() {
        arrays = flat(&arrays);
    }
    let mut mesh = Mesh::assemble(checked(arrays).map_err(in_place)?, &[])?;
    warnings.extend(mesh.warnings.drain(..).map(|w| format!("{place}: {w}")));
    Ok(Some(mesh))
}

fn corners(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    vertices: usize,
    place: &str,
) -> Result<Vec<u32>, MeshError> {
    let Some(index) = primitive.indices else { return Ok((0..vertices as u32).collect()) };
    let what = format!("{place}, indices");
    let elements: Elements<'_, 1> = Elements::new(buffers, index.value(), &what)?;
    let Some(corners) = elements.integers() else {
        return Err(buffers.fail(format!("{what}: unsigned integers expected")));
    };
    match corners.iter().position(|&i| i as usize >= vertices) {
        Some(at) => Err(buffers
            .fail(format!("{what}: number {at} is {}, but there are {vertices} vertices", corners[at]))),
        None => Ok(corners),
    }
}

fn triangles(
    primitive: &Primitive,
    corners: &[u32],
    place: &str,
    warnings: &mut Vec<String>,
) -> Vec<[u32; 3]> {
    match primitive.mode {
        Checked::Valid(Mode::TriangleStrip) => corners
            .windows(3)
            .enumerate()
            .map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        Checked::Valid(Mode::TriangleFan) => match corners.split_first() {
            Some((&centre, rim)) => rim.windows(2).map(|w| [w[0], w[1], centre]).collect(),
            None => Vec::new(),
        },
        _ => {
            if !corners.len().is_multiple_of(3) {
                warnings.push(format!("{place}: {} corners do not make whole triangles", corners.len()));
            }
            corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
        }
    }
}

/// The vertices in use, in order, and the triangles over them. Many exporters let all primitives
/// share one large set of accessors.
fn compact(triangles: &[[u32; 3]], vertices: usize) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    if used.len() == vertices {
        return (used, triangles.to_vec());
    }
    let rank = |vertex: u32| used.partition_point(|&u| u < vertex) as u32;
    let moved = triangles.iter().map(|t| t.map(rank)).collect();
    (used, moved)
}

fn gather<const N: usize, T>(elements: &Elements<'_, N>, used: &[u32], make: fn([f32; N]) -> T) -> Vec<T> {
    used.iter().map(|&i| make(elements.get(i as usize))).collect()
}

fn optional<const N: usize>(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    semantic: Semantic,
    used: &[u32],
    vertices: usize,
    place: &str,
) -> Result<Option<Vec<[f32; N]>>, MeshError> {
    let what = format!("{place}, {}", semantic.to_string());
    let Some(index) = attribute(primitive, semantic) else { return Ok(None) };
    let elements = Elements::<N>::new(buffers, index, &what)?;
    if elements.len() != vertices {
        return Err(buffers.fail(format!("{what}: {} elements for {vertices} positions", elements.len())));
    }
    Ok(Some(gather(&elements, used, |e| e)))
}

fn read_uvs(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    uv: &UvChoice,
    used: &[u32],
    vertices: usize,
    place: &str,
    warnings: &mut Vec<String>,
) -> Result<Vec<Vec2>, MeshError> {
    let found = optional::<2>(buffers, primitive, Semantic::TexCoords(uv.set), used, vertices, place)?;
    Ok(match found {
        Some(uvs) => uvs.into_iter().map(|t| uv.apply(Vec2::from_array(t))).collect(),
        None => {
            warnings.push(format!("{place}: has no TEXCOORD_{}; all UVs are 0", uv.set));
            vec![Vec2::ZERO; used.len()]
        }
    })
}

/// Gives each triangle vertices of its own with its own normal. Given tangents go: glTF says that
/// without normals they mean nothing.
fn flat(arrays: &Arrays) -> Arrays {
    let corners = || arrays.indices.iter().flatten().map(|&i| i as usize);
    let normal = |triangle| {
        let normal = normals::face_normal(&arrays.positions, triangle).as_vec3();
        [if normal == Vec3::ZERO { Vec3::Z } else { normal }; 3]
    };
    Arrays {
        positions: corners().map(|i| arrays.positions[i]).collect(),
        uvs: corners().map(|i| arrays.uvs[i]).collect(),
        normals: Some(arrays.indices.iter().flat_map(normal).collect()),
        tangents: None,
        indices: (0..arrays.indices.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
    }
}
