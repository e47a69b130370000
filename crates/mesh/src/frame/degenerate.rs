//! Tangents for corners whose UVs give none: finite, unit, and said aloud.

use glam::Vec4;

use super::{Surface, convention};

/// Fills the gaps: with the tangent of another corner of the same vertex if one has it, else with
/// an arbitrary direction perpendicular to the normal and `w = 1`.
pub(super) fn fill(
    surface: Surface<'_>,
    corners: Vec<Option<Vec4>>,
    warnings: &mut Vec<String>,
) -> Vec<Vec4> {
    let mut known: Vec<Option<Vec4>> = vec![None; surface.positions.len()];
    let vertices = || surface.indices.iter().flatten().map(|&i| i as usize);
    for (vertex, corner) in vertices().zip(&corners) {
        known[vertex] = known[vertex].or(*corner);
    }
    let mut arbitrary = vec![false; surface.positions.len()];
    let filled = vertices()
        .zip(corners)
        .map(|(vertex, corner)| {
            corner.or(known[vertex]).unwrap_or_else(|| {
                arbitrary[vertex] = true;
                convention::any_tangent(surface.normals[vertex])
            })
        })
        .collect();
    let count = arbitrary.iter().filter(|&&a| a).count();
    if count > 0 {
        warnings.push(format!(
            "{count} vertices have degenerate UVs or normals; their tangents are arbitrary directions in the surface"
        ));
    }
    filled
}
