//! Strips between charts that are displaced each for itself, as rays through a shell see them: from where a side
//! of an edge is displaced to where all of them meet in a displaced mesh. They close UV seams and hard edges.

use glam::Vec2;

use super::seams::Seams;
use super::{Cut, Displaced, Relief};
use crate::{Mesh, MeshError};

/// The strips along all edges of `cut.range` whose sides differ in UVs or normals; `cut.keep` plays no part. There
/// are none on a mesh without seams.
///
/// # Errors
/// [`MeshError::TooLarge`] for more than `cut.limit` micro-triangles.
pub fn bridges(mesh: &Mesh, cut: &Cut<'_>, relief: &Relief<'_>) -> Result<Displaced, MeshError> {
    let seams = Seams::new(mesh, cut.range);
    let pieces = seams.pieces(mesh, cut.segments);
    cut.check(seams.pieces_of_strips(&pieces))?;
    let rim = seams.displace(mesh, cut, &pieces, relief);
    let mut strips = Displaced::default();
    for (sides, meeting) in seams.parted(&pieces, &rim) {
        let last = meeting.len() - 1;
        for side in sides {
            let [a, b] = side.ends.map(|end| mesh.positions[end as usize].as_dvec3());
            let first = strips.positions.len() as u32;
            for (k, &place) in meeting.iter().enumerate() {
                let share = k as f64 / last as f64;
                let own = relief.shared(a.lerp(b, share), std::iter::once(side.at(mesh, share)));
                strips.positions.extend([(own - cut.origin).as_vec3(), place]);
                let mut weights = [0.0; 3];
                let along = if side.backwards { 1.0 - share } else { share } as f32;
                weights[side.corner] = 1.0 - along;
                weights[(side.corner + 1) % 3] = along;
                strips.weights.extend([Vec2::new(weights[1], weights[2]); 2]);
                strips.faces.extend([side.face; 2]);
            }
            for k in 0..last as u32 {
                let [own, meets, own_next, meets_next] = [0, 1, 2, 3].map(|at| first + 2 * k + at);
                // As a triangle across the edge would be wound.
                strips.indices.extend(if side.backwards {
                    [[own, own_next, meets], [own_next, meets_next, meets]]
                } else {
                    [[own_next, own, meets], [own_next, meets, meets_next]]
                });
            }
        }
    }
    Ok(strips)
}
