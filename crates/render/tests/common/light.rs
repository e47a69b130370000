//! Whether a place is in shadow, where that can be told.
#![allow(dead_code)]

use glam::DVec3;

/// About the width of a texel on the shapes.
pub const TEXEL: f64 = 0.025;
/// What is nearer than this is the start itself.
const CLEAR: f64 = 1e-5;

/// Whether what lies in direction `to_light` is in the way, or none at the edge of a shadow: where something within a
/// texel decides, or a start that is `off` would see something else. What is a texel away or farther it sees turned by
/// `off / TEXEL` at most.
///
/// `blocked`: whether anything is in the way in a direction, farther than so much.
pub fn certain(
    normal: DVec3,
    to_light: DVec3,
    off: f64,
    blocked: impl Fn(DVec3, f64) -> bool,
) -> Option<bool> {
    let across = to_light.cross(normal).normalize_or(to_light.any_orthonormal_vector());
    let up = across.cross(to_light);
    let answer = blocked(to_light, CLEAR);
    let turn = off / TEXEL;
    let turned = [across, -across, up, -up].map(|side| (to_light + turn * side).normalize());
    let alike = blocked(to_light, TEXEL) == answer && turned.iter().all(|&way| blocked(way, TEXEL) == answer);
    alike.then_some(answer)
}
