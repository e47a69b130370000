//! Normals: checked, normalised, or made when a mesh has none.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use crate::arrays::Arrays;

/// Cosine of the bend above which an edge without given normals stays hard.
const CREASE_COS: f64 = 0.5;

/// Vertices with more corners than this are smoothed over all of them: comparing every pair of
/// faces of a fan would take quadratic time.
const MAX_CREASE_CORNERS: usize = 256;

/// Unit normals for every vertex: the given ones, or the angle-weighted mean over the triangles
/// that use the vertex; zero-length ones are replaced likewise.
pub(crate) fn complete(arrays: &Arrays, warnings: &mut Vec<String>) -> Vec<Vec3> {
    let given = match &arrays.normals {
        None => return smooth(&arrays.positions, &arrays.indices),
        Some(given) => given,
    };
    // Normals that are of unit length already stay as they are, bit for bit.
    let is_unit = |n: Vec3| (n.as_dvec3().length_squared() - 1.0).abs() <= 4.0 * f64::from(f32::EPSILON);
    let unit: Vec<Option<Vec3>> =
        given.iter().map(|&n| if is_unit(n) { Some(n) } else { unit(n.as_dvec3()) }).collect();
    let missing = unit.iter().filter(|n| n.is_none()).count();
    if missing == 0 {
        return unit.into_iter().flatten().collect();
    }
    warnings.push(format!("{missing} normals have no length; generated from the triangles instead"));
    let made = smooth(&arrays.positions, &arrays.indices);
    unit.into_iter().zip(made).map(|(n, made)| n.unwrap_or(made)).collect()
}

/// Angle-weighted vertex normals; a vertex without a proper triangle gets +Z.
pub(crate) fn smooth(positions: &[Vec3], indices: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for triangle in indices {
        let normal = face_normal(positions, triangle);
        for (corner, angle) in corner_angles(positions, triangle).into_iter().enumerate() {
            sums[triangle[corner] as usize] += angle * normal;
        }
    }
    sums.into_iter().map(|sum| unit(sum).unwrap_or(Vec3::Z)).collect()
}

/// Normals for each corner of each triangle: smooth where faces that share a *position* bend by
/// less than 60 degrees, hard elsewhere. For formats that say nothing of smoothing.
pub(crate) fn creased(positions: &[Vec3], indices: &[[u32; 3]]) -> Vec<[Vec3; 3]> {
    let mut ids: HashMap<[u32; 3], u32> = HashMap::new();
    let place: Vec<u32> = positions
        .iter()
        .map(|p| {
            let next = ids.len() as u32;
            *ids.entry((*p + 0.0).to_array().map(f32::to_bits)).or_insert(next)
        })
        .collect();
    let faces: Vec<DVec3> = indices.iter().map(|t| face_normal(positions, t)).collect();
    let angles: Vec<[f64; 3]> = indices.iter().map(|t| corner_angles(positions, t)).collect();
    let mut around: Vec<Vec<(u32, u8)>> = vec![Vec::new(); ids.len()];
    for (face, triangle) in indices.iter().enumerate() {
        for (corner, &vertex) in triangle.iter().enumerate() {
            around[place[vertex as usize] as usize].push((face as u32, corner as u8));
        }
    }
    let mut result: Vec<[Vec3; 3]> = faces.iter().map(|n| [unit(*n).unwrap_or(Vec3::Z); 3]).collect();
    for corners in &around {
        let weighted =
            |&(face, corner): &(u32, u8)| angles[face as usize][corner as usize] * faces[face as usize];
        let all: DVec3 = corners.iter().map(weighted).sum();
        for &(face, corner) in corners {
            let own = faces[face as usize];
            let sum = if corners.len() > MAX_CREASE_CORNERS || own == DVec3::ZERO {
                all
            } else {
                corners.iter().filter(|c| faces[c.0 as usize].dot(own) >= CREASE_COS).map(weighted).sum()
            };
            if let Some(normal) = unit(sum) {
                result[face as usize][corner as usize] = normal;
            }
        }
    }
    result
}

/// Unit normal of a counter-clockwise triangle; zero when it has no area.
pub(crate) fn face_normal(positions: &[Vec3], triangle: &[u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|i| positions[i as usize].as_dvec3());
    (b - a).cross(c - a).normalize_or_zero()
}

/// Interior angles of a triangle at its corners, radians; zeros when an edge has no length.
pub(crate) fn corner_angles(positions: &[Vec3], triangle: &[u32; 3]) -> [f64; 3] {
    let p = triangle.map(|i| positions[i as usize].as_dvec3());
    std::array::from_fn(|i| {
        let (e, f) = (p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
        e.cross(f).length().atan2(e.dot(f))
    })
}

fn unit(v: DVec3) -> Option<Vec3> {
    v.try_normalize().map(|n| n.as_vec3())
}
