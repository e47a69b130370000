//! `dP/du` and `dP/dv` at the vertices: the metric of the texture on the surface.
//!
//! Each triangle's derivatives are turned, without change of length or angle, from its own plane
//! into the plane of the vertex normal, then averaged over the triangles of the vertex. Weights are
//! the angle at the vertex times the sine of the UV angle there, so that slivers in either space
//! count for little and no weight times derivative grows without bound. Triangles with mirrored
//! UVs are averaged apart from the others, and the heavier side wins: the two never cancel.

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::{FaceFrame, Surface, convention, face_frame};
use crate::normals::{corner_angles, face_normal};

/// Derivatives at each vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct Derivatives {
    /// `dP/du`, mesh units per UV unit.
    pub dpdu: Vec<Vec3>,
    /// `dP/dv`, `v` down, mesh units per UV unit.
    pub dpdv: Vec<Vec3>,
    /// What had to be replaced.
    pub warnings: Vec<String>,
}

#[derive(Clone, Copy, Default)]
struct Sum {
    dpdu: DVec3,
    dpdv: DVec3,
    weight: f64,
}

/// Averaged derivatives for each vertex of a checked mesh (equal lengths, indices in range).
///
/// A vertex without any sound UV triangle gets its tangent frame with a length of one mesh unit per
/// UV unit, and the warnings count such vertices.
pub fn derivatives(
    positions: &[Vec3],
    normals: &[Vec3],
    uvs: &[Vec2],
    tangents: &[Vec4],
    indices: &[[u32; 3]],
) -> Derivatives {
    let surface = Surface { positions, normals, uvs, indices, quads: &[] };
    let sums = means(surface, |_, frame, plane, normal| {
        let turn = convention::turn(plane, normal);
        FaceFrame { dpdu: turn * frame.dpdu, dpdv: turn * frame.dpdv }
    });
    let mut result = Derivatives {
        dpdu: Vec::with_capacity(positions.len()),
        dpdv: Vec::with_capacity(positions.len()),
        warnings: Vec::new(),
    };
    let mut used = vec![false; positions.len()];
    indices.iter().flatten().for_each(|&i| used[i as usize] = true);
    let mut replaced = 0usize;
    for (vertex, sum) in sums.iter().enumerate() {
        let (dpdu, dpdv) = ((sum.dpdu / sum.weight).as_vec3(), (sum.dpdv / sum.weight).as_vec3());
        if sum.weight > 0.0 && sound(dpdu) && sound(dpdv) {
            result.dpdu.push(dpdu);
            result.dpdv.push(dpdv);
        } else {
            replaced += usize::from(used[vertex]);
            result.dpdu.push(tangents[vertex].truncate());
            result.dpdv.push(-convention::bitangent(normals[vertex], tangents[vertex]));
        }
    }
    if replaced > 0 {
        result.warnings.push(format!(
            "{replaced} vertices have degenerate UVs; their texture scale is set to 1 mesh unit"
        ));
    }
    result
}

/// `dN/du` and `dN/dv` at each vertex of a checked mesh, per UV unit, perpendicular to the normal; zero at
/// vertices without any sound UV triangle.
///
/// The smooth normals change linearly over each triangle; the vertices get means as for [`derivatives`].
pub fn normal_derivatives(
    positions: &[Vec3],
    normals: &[Vec3],
    uvs: &[Vec2],
    indices: &[[u32; 3]],
) -> [Vec<Vec3>; 2] {
    let surface = Surface { positions, normals, uvs, indices, quads: &[] };
    let still = FaceFrame { dpdu: DVec3::ZERO, dpdv: DVec3::ZERO };
    let sums = means(surface, |face, _, _, normal| {
        let corners = indices[face].map(|i| i as usize);
        let turning = face_frame(corners.map(|i| normals[i].as_dvec3()), corners.map(|i| uvs[i].as_dvec2()));
        let FaceFrame { dpdu, dpdv } = turning.unwrap_or(still);
        FaceFrame { dpdu: dpdu - normal * normal.dot(dpdu), dpdv: dpdv - normal * normal.dot(dpdv) }
    });
    let finite = |v: DVec3| if v.as_vec3().is_finite() { v.as_vec3() } else { Vec3::ZERO };
    let along = |pick: fn(&Sum) -> DVec3| sums.iter().map(|sum| finite(pick(sum) / sum.weight)).collect();
    [along(|sum| sum.dpdu), along(|sum| sum.dpdv)]
}

/// Weighted sums over the triangles of each vertex, of the heavier side of a mirror. `carry` takes a
/// triangle, its frame, the normal of its plane and the vertex normal to what counts at the vertex.
fn means(surface: Surface<'_>, carry: impl Fn(usize, FaceFrame, DVec3, DVec3) -> FaceFrame) -> Vec<Sum> {
    let mut sums = vec![[Sum::default(); 2]; surface.positions.len()];
    for (face, triangle) in surface.indices.iter().enumerate() {
        let plane = face_normal(surface.positions, triangle);
        let Some(frame) = surface.face_frame(face).filter(|_| plane != DVec3::ZERO) else { continue };
        let side = usize::from(frame.dpdu.cross(frame.dpdv).dot(plane) > 0.0);
        let angles = corner_angles(surface.positions, triangle);
        for (corner, &vertex) in triangle.iter().enumerate() {
            let value = carry(face, frame, plane, surface.normals[vertex as usize].as_dvec3());
            let weight = angles[corner] * uv_sine(surface.uvs, triangle, corner);
            let sum = &mut sums[vertex as usize][side];
            sum.dpdu += weight * value.dpdu;
            sum.dpdv += weight * value.dpdv;
            sum.weight += weight;
        }
    }
    sums.into_iter().map(|[a, b]| if a.weight > b.weight { a } else { b }).collect()
}

fn sound(v: Vec3) -> bool {
    v.is_finite() && v != Vec3::ZERO
}

fn uv_sine(uvs: &[Vec2], triangle: &[u32; 3], corner: usize) -> f64 {
    let t = |i: usize| uvs[triangle[i % 3] as usize].as_dvec2();
    let (e, f) = (t(corner + 1) - t(corner), t(corner + 2) - t(corner));
    let lengths = e.length() * f.length();
    if lengths > 0.0 { (e.perp_dot(f) / lengths).abs() } else { 0.0 }
}
