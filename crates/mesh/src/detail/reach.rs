//! How far the detailed mesh rises above the plain one and sinks below it.

use glam::Vec3;
use rayon::prelude::*;

use super::surface::Surface;
use super::tree::Tree;
use crate::mesh::Mesh;

/// Corners of the detailed mesh that are measured.
const MEASURED: usize = 1 << 16;
/// What is not measured, and rays that lean against the surface, may need this much more.
const MORE: f32 = 1.25;
/// Least distance, as a share of the plain mesh's diagonal, so that a copy of it is met too.
const LEAST: f32 = 1e-3;

/// Distances for rays to start above the plain mesh and to end below it, mesh units.
///
/// Measured from corners of the detailed mesh, evenly chosen, to the nearest point of the plain one.
pub(super) fn measured(
    plain: &Mesh,
    detail: &Surface<'_>,
    go_on: impl FnMut() -> bool,
) -> Option<(f32, f32)> {
    let corners = |t: u32| plain.indices[t as usize].map(|i| plain.positions[i as usize]);
    let tree = Tree::new(plain.indices.len(), corners, go_on)?;
    let triangles = &detail.mesh.indices;
    let step = triangles.len().div_ceil(MEASURED / 2);
    let heights = (0..triangles.len()).into_par_iter().step_by(step).with_min_len(64).map_init(
        Vec::new,
        |stack, at| {
            // A different corner each time, so that no regular mesh hides its peaks.
            let p = detail.mesh.positions[triangles[at][at / step % 3] as usize];
            let Some(near) = tree.nearest_point(p, stack) else { return (0.0, 0.0) };
            let [a, b, c] = plain.indices[near.triangle as usize].map(|i| plain.normals[i as usize]);
            let up = a * near.weights[0] + b * near.weights[1] + c * near.weights[2];
            let height = p.distance(near.place).copysign(up.dot(p - near.place));
            (height.max(0.0), (-height).max(0.0))
        },
    );
    let (above, below) = heights.reduce(|| (0.0, 0.0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    let (low, high) = plain.bounds();
    let size = Vec3::distance(low, high);
    let least = LEAST * if size > 0.0 { size } else { 1.0 };
    Some(((above * MORE).max(least), (below * MORE).max(least)))
}
