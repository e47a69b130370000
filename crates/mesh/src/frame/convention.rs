//! The one place where "up the image" and "`v` down" meet.
//!
//! Our `v`, like glTF's, grows *down* the image, so `dP/dv` points down it. The glTF tangent's `w`
//! is defined by the bitangent `B = w (N x T)`, which points *up* it (green of a normal map = up).
//! Hence `B` is along `-dP/dv`, and MikkTSpace, whose `w` follows growing `v`, is fed `-v`.

use glam::{DQuat, DVec3, Vec2, Vec3, Vec4};

/// The smallest share of a vector's length that must lie in the surface for its direction to count.
const MIN_SHARE: f64 = 1e-6;

/// The bitangent, up the image: `w (N x T)`.
pub fn bitangent(normal: Vec3, tangent: Vec4) -> Vec3 {
    tangent.w * normal.cross(tangent.truncate())
}

/// The `w` of a surface with this normal and these derivatives (`v` down): +1 when the image is
/// seen unmirrored from the side the normal points to, else -1.
pub fn handedness(normal: DVec3, dpdu: DVec3, dpdv: DVec3) -> f32 {
    if normal.cross(dpdu).dot(-dpdv) < 0.0 { -1.0 } else { 1.0 }
}

/// Texture coordinates with `v` up, as MikkTSpace wants them. Negation, unlike `1 - v`, is exact.
/// Subtracting from zero also turns -0 into +0, which would otherwise not weld with it.
pub(super) fn v_up(uv: Vec2) -> [f32; 2] {
    [uv.x + 0.0, 0.0 - uv.y]
}

/// The direction of `v` in the plane of a unit normal, or `None` when `v` runs along the normal.
pub(super) fn in_surface(normal: DVec3, v: DVec3) -> Option<DVec3> {
    let flat = v - normal * normal.dot(v);
    if flat.length() > MIN_SHARE * v.length() { flat.try_normalize() } else { None }
}

/// The shortest turn that takes the normal of a triangle's plane onto a vertex normal. A triangle
/// wound against its normals is turned by its nearer side, not flipped over.
pub(super) fn turn(plane: DVec3, normal: DVec3) -> DQuat {
    DQuat::from_rotation_arc(plane * plane.dot(normal).signum(), normal)
}

/// Some unit tangent perpendicular to a unit normal, for where UVs give none.
pub(super) fn any_tangent(normal: Vec3) -> Vec4 {
    normal.any_orthonormal_vector().extend(1.0)
}

/// Given tangents with `xyz` of unit length and `w` of +1 or -1; those without length are replaced.
pub(crate) fn repair(given: &[Vec4], normals: &[Vec3], warnings: &mut Vec<String>) -> Vec<Vec4> {
    let mut bad = 0usize;
    let repaired = given
        .iter()
        .zip(normals)
        .map(|(tangent, &normal)| {
            let w = if tangent.w < 0.0 { -1.0 } else { 1.0 };
            match tangent.truncate().as_dvec3().try_normalize() {
                Some(unit) => unit.as_vec3().extend(w),
                None => {
                    bad += 1;
                    any_tangent(normal).truncate().extend(w)
                }
            }
        })
        .collect();
    if bad > 0 {
        warnings.push(format!("{bad} given tangents have no length; replaced by an arbitrary direction"));
    }
    repaired
}
