//! MikkTSpace on unindexed corners of triangles and quads, linear in time.
//!
//! Source: M. S. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008, and the rules of the
//! reference that glTF names: corners weld where position, normal and UV are equal; triangles are
//! grouped around a welded vertex over shared edges between equal orientations; a group's tangent is
//! the mean of its triangles' unit `dP/du`, each made perpendicular to the normal and weighted by the
//! angle it has at the vertex, seen along the normal. Quads are split along the shorter diagonal of
//! their UVs. Corners of triangles without area take the tangent of a sound corner they weld with.
//!
//! Everything is in `f32`, as in the reference, since its decisions hang on it. Unlike there, edges are
//! paired through lists at the vertices, groups are found without recursion, and degenerate triangles
//! are looked up, so that neither a fan of a million triangles nor a million degenerate ones take long.

mod groups;
mod halves;
mod neighbours;
mod spread;

use glam::Vec4;
use rayon::prelude::*;

use super::{FrameInfo, Surface, convention, weld};
use halves::{Face, Half};

pub(super) const INFO: FrameInfo = FrameInfo {
    name: "mikktspace",
    summary: "the standard of glTF, Blender and Unreal: angle-weighted means of triangles that share edges, \
              run on unindexed corners",
    guarantee: "the same at any order of triangles and vertices; mirrored charts are never mixed; agrees \
                with Blender and other users of the standard to rounding",
    source: "Mikkelsen, Simulation of Wrinkled Surfaces Revisited, 2008",
    shares: true,
    corners,
};

/// No triangle, no group.
const NONE: u32 = u32::MAX;

/// A tangent for each corner of each triangle; `None` where UVs give none.
pub(super) fn corners(surface: Surface<'_>) -> Vec<Option<Vec4>> {
    let welded = weld::first_equal(surface.positions.len(), |i| {
        let (p, n) = (surface.positions[i] + 0.0, surface.normals[i] + 0.0);
        let [u, v] = convention::v_up(surface.uvs[i]);
        [p.x, p.y, p.z, n.x, n.y, n.z, u, v].map(f32::to_bits)
    });
    let faces = halves::faces(surface);
    let mut halves: Vec<Half> =
        faces.par_iter().flat_map_iter(|face| face.halves(surface, &welded).into_iter().flatten()).collect();
    let neighbours = neighbours::neighbours(&halves, welded.len());
    let groups = groups::groups(&mut halves, &neighbours);
    drop(neighbours);
    let mut out = spread::tangents(surface, &halves, &groups);
    finish_quads(surface, &faces, &halves, &mut out);
    inherit(surface, &welded, &faces, &mut out);
    out
}

/// Gives the fourth corner of quads with one degenerate half the tangent of the corner at its place,
/// and copies what the halves share to both of its entries.
fn finish_quads(surface: Surface<'_>, faces: &[Face], halves: &[Half], out: &mut [Option<Vec4>]) {
    let mut of_face = halves.iter().peekable();
    for face in faces {
        let mut count = 0;
        let mut seen = [false; 4];
        while let Some(half) = of_face.next_if(|half| half.triangle == face.triangle) {
            count += 1;
            half.corners.iter().for_each(|&corner| seen[usize::from(corner)] = true);
        }
        if !face.quad {
            continue;
        }
        if count == 1 {
            let position = |corner: usize| surface.positions[face.vertex(surface, corner)];
            for lost in (0..4).filter(|&corner| !seen[corner]) {
                let twin = (0..4).find(|&corner| seen[corner] && position(corner) == position(lost));
                if let Some(twin) = twin {
                    out[face.places(lost)[0]] = out[face.places(twin)[0]];
                }
            }
        }
        for corner in 0..4 {
            let [first, second] = face.places(corner);
            out[second] = out[first];
        }
    }
}

/// Gives corners of degenerate triangles the tangent of the first sound corner at the same vertex.
fn inherit(surface: Surface<'_>, welded: &[u32], faces: &[Face], out: &mut [Option<Vec4>]) {
    let used: usize = faces.iter().map(|face| face.triangles()).sum();
    if used == surface.indices.len() {
        return;
    }
    let mut source = vec![NONE; welded.len()];
    let mut sound = vec![false; out.len()];
    for face in faces {
        for corner in 0..face.corners() {
            let places = face.places(corner);
            places.into_iter().for_each(|place| sound[place] = true);
            let slot = &mut source[welded[face.vertex(surface, corner)] as usize];
            if *slot == NONE {
                *slot = places[0] as u32;
            }
        }
    }
    for (place, &vertex) in surface.indices.iter().flatten().enumerate().filter(|(place, _)| !sound[*place]) {
        let from = source[welded[vertex as usize] as usize];
        if from != NONE {
            out[place] = out[from as usize];
        }
    }
}
