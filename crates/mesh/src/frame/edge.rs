//! One frame a triangle from two edges and how far `s` grows along them: the recipe of fixed-function
//! hardware. The line on which `s` stands still is the bitangent; the tangent is what is perpendicular
//! to it and the normal. It follows columns of texels exactly and rows only where the map is not
//! sheared; [`dietrich`](super::dietrich) has it the other way round.
//!
//! Source: Kilgard, "A Practical and Robust Bump-mapping Technique for Today's GPUs", GDC 2000.

use glam::Vec4;

use super::{FrameInfo, Surface, convention};

pub(super) const INFO: FrameInfo = FrameInfo {
    name: "edge",
    summary: "one frame a triangle: the bitangent from two edges along which u stands still, the tangent \
              across it",
    guarantee: "the bitangent follows dP/dv of the triangle exactly; the tangent is off by the shear of \
                the map",
    source: "Kilgard, A Practical and Robust Bump-mapping Technique for Today's GPUs, 2000",
    shares: true,
    corners,
};

fn corners(surface: Surface<'_>) -> Vec<Option<Vec4>> {
    surface.each_corner(|face| {
        let sound = surface.face_frame(face).is_some();
        let [a, b, c] = surface.indices[face].map(|i| surface.positions[i as usize].as_dvec3());
        let [r, s, t] = surface.indices[face].map(|i| surface.uvs[i as usize].as_dvec2());
        let (e1, e2, d1, d2) = (b - a, c - a, s - r, t - r);
        // Along this u does not change; v, which runs down, falls along it.
        let up = (e1 * d2.x - e2 * d1.x) * d1.perp_dot(d2).signum();
        let right = (e1 * d2.y - e2 * d1.y) * d1.perp_dot(d2).signum();
        move |_, normal| {
            let bitangent = convention::in_surface(normal, up).filter(|_| sound)?;
            let w = if normal.cross(right).dot(bitangent) < 0.0 { -1.0 } else { 1.0 };
            Some((bitangent.cross(normal) * w).as_vec3().extend(w as f32))
        }
    })
}
