//! One frame a vertex: the sum of `dP/du` over its triangles, made perpendicular to its normal.
//!
//! Triangles with mirrored UVs are summed apart from the others. Where the directions of one side
//! still cancel, as around the middle of a polar map, each triangle keeps its own frame.
//!
//! Source: Lengyel, "Computing Tangent Space Basis Vectors for an Arbitrary Mesh", 2001.

use glam::{DVec3, Vec4};

use super::{FrameInfo, Surface, convention};

pub(super) const INFO: FrameInfo = FrameInfo {
    name: "averaged",
    summary: "one frame a vertex: the sum of dP/du over its triangles",
    guarantee: "smooth over the triangles of a vertex, not over seams of the UVs; mirrored charts are never \
                mixed, and where directions cancel each triangle keeps its own",
    source: "Lengyel, Computing Tangent Space Basis Vectors for an Arbitrary Mesh, 2001",
    shares: true,
    corners,
};

/// A sum shorter than this share of its parts has cancelled.
const CANCELLED: f64 = 0.1;

#[derive(Clone, Copy, Default)]
struct Sum {
    dpdu: DVec3,
    length: f64,
}

fn corners(surface: Surface<'_>) -> Vec<Option<Vec4>> {
    let mut sums = vec![[Sum::default(); 2]; surface.positions.len()];
    for (face, triangle) in surface.indices.iter().enumerate() {
        let Some(frame) = surface.face_frame(face) else { continue };
        for &vertex in triangle {
            let normal = surface.normals[vertex as usize].as_dvec3();
            let w = convention::handedness(normal, frame.dpdu, frame.dpdv);
            let sum = &mut sums[vertex as usize][usize::from(w < 0.0)];
            sum.dpdu += frame.dpdu;
            sum.length += frame.dpdu.length();
        }
    }
    surface.each_corner(|face| {
        let (frame, sums) = (surface.face_frame(face), &sums);
        move |vertex, normal| {
            let frame = frame?;
            let w = convention::handedness(normal, frame.dpdu, frame.dpdv);
            let sum = sums[vertex][usize::from(w < 0.0)];
            let direction = if sum.dpdu.length() > CANCELLED * sum.length { sum.dpdu } else { frame.dpdu };
            Some(convention::in_surface(normal, direction)?.as_vec3().extend(w))
        }
    })
}
