//! What a shader finds without any stored tangent: the triangle's `dP/du`, turned with the shortest
//! turn from the triangle's plane onto the smooth normal. The difference to projecting it, as
//! [`dietrich`](super::dietrich) does, is second order in the bend.
//!
//! On the device the same comes from screen-space derivatives of position and uv.
//! Source: Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", 2010, and "Surface
//! Gradient-Based Bump Mapping Framework", JCGT 2020.

use glam::{DVec3, Vec4};

use super::{FrameInfo, Surface, convention};
use crate::normals::face_normal;

pub(super) const INFO: FrameInfo = FrameInfo {
    name: "derivative",
    summary: "the triangle's dP/du turned onto the smooth normal, as screen-space derivatives give it",
    guarantee: "needs no stored tangents; exact on the triangle, facets show as with dietrich",
    source: "Mikkelsen, Bump Mapping Unparametrized Surfaces on the GPU, 2010; Surface Gradient-Based \
             Bump Mapping Framework, JCGT 2020",
    shares: true,
    corners,
};

fn corners(surface: Surface<'_>) -> Vec<Option<Vec4>> {
    surface.each_corner(|face| {
        let plane = face_normal(surface.positions, &surface.indices[face]);
        let frame = surface.face_frame(face).filter(|_| plane != DVec3::ZERO);
        move |_, normal| {
            let frame = frame?;
            let turned = convention::turn(plane, normal) * frame.dpdu;
            // Projected once more: rounding must not leave it outside the surface.
            let tangent = convention::in_surface(normal, turned)?;
            Some(tangent.as_vec3().extend(convention::handedness(normal, frame.dpdu, frame.dpdv)))
        }
    })
}
