//! Derivatives of position by UV on one triangle, by Dietrich's planes.
//!
//! Over a triangle x is linear in (u, v): `A x + B u + C v + D = 0`, whose normal (A, B, C) is the
//! cross product of two edges in (x, u, v) space. Then `dx/du = -B/A`, `dx/dv = -C/A`; likewise y
//! and z. `A` is twice the signed UV area and so the same for all three.
//! Source: D. S. Dietrich, "Texture Space Bump Maps", Game Programming Gems, 2000.

use glam::{DVec2, DVec3, Vec4};

use super::{FrameInfo, Surface, convention};

pub(super) const INFO: FrameInfo = FrameInfo {
    name: "dietrich",
    summary: "one frame a triangle, from the planes that x, y and z form over (u, v)",
    guarantee: "dP/du of the triangle exactly, projected onto the vertex normals; nothing is averaged, so \
                facets show",
    source: "Dietrich, Texture Space Bump Maps, Game Programming Gems, 2000",
    shares: true,
    corners,
};

/// Sine of the smallest angle between two UV edges that still counts as a UV triangle.
const MIN_UV_SINE: f64 = 1e-7;

/// Derivatives that are constant over one triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceFrame {
    /// `dP/du`, mesh units per UV unit.
    pub dpdu: DVec3,
    /// `dP/dv`, `v` down, mesh units per UV unit.
    pub dpdv: DVec3,
}

/// The derivatives on a triangle, or `None` when its UVs enclose no area or the result overflows.
pub fn face_frame(positions: [DVec3; 3], uvs: [DVec2; 3]) -> Option<FaceFrame> {
    let (e1, e2) = (positions[1] - positions[0], positions[2] - positions[0]);
    let (t1, t2) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let a = t1.perp_dot(t2);
    let longest = t1.length_squared().max(t2.length_squared()).max((t2 - t1).length_squared());
    if a.is_nan() || a.abs() <= MIN_UV_SINE * longest || a == 0.0 {
        return None;
    }
    let axis = |d1: f64, d2: f64| {
        let plane = DVec3::new(d1, t1.x, t1.y).cross(DVec3::new(d2, t2.x, t2.y));
        (-plane.y / plane.x, -plane.z / plane.x)
    };
    let (x, y, z) = (axis(e1.x, e2.x), axis(e1.y, e2.y), axis(e1.z, e2.z));
    let frame = FaceFrame { dpdu: DVec3::new(x.0, y.0, z.0), dpdv: DVec3::new(x.1, y.1, z.1) };
    // Beyond f32 the result could not be stored.
    let fits = |v: DVec3| v.as_vec3().is_finite();
    (fits(frame.dpdu) && fits(frame.dpdv)).then_some(frame)
}

impl Surface<'_> {
    /// [`face_frame`] of triangle `face`.
    pub(super) fn face_frame(&self, face: usize) -> Option<FaceFrame> {
        let corners = self.indices[face].map(|i| i as usize);
        face_frame(corners.map(|i| self.positions[i].as_dvec3()), corners.map(|i| self.uvs[i].as_dvec2()))
    }
}

/// The face's `dP/du` made perpendicular to the corner's normal.
pub(super) fn corners(surface: Surface<'_>) -> Vec<Option<Vec4>> {
    surface.each_corner(|face| {
        let frame = surface.face_frame(face);
        move |_, normal| {
            let frame = frame?;
            let tangent = convention::in_surface(normal, frame.dpdu)?;
            Some(tangent.as_vec3().extend(convention::handedness(normal, frame.dpdu, frame.dpdv)))
        }
    })
}
