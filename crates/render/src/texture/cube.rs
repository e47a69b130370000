//! The normalisation cube map of fixed-function bump mapping.

use glam::Vec3;

use super::upload::MipLevel;

/// Texels along a side of a face.
const FACE_SIDE: usize = 64;

/// The direction through a point of a face; `s`, `t` in -1..1, right and down. Faces in the order
/// +X, -X, +Y, -Y, +Z, -Z, laid out as cube textures are.
fn direction(face: usize, s: f32, t: f32) -> Vec3 {
    match face {
        0 => Vec3::new(1.0, -t, -s),
        1 => Vec3::new(-1.0, -t, s),
        2 => Vec3::new(s, 1.0, t),
        3 => Vec3::new(s, -1.0, -t),
        4 => Vec3::new(s, -t, 1.0),
        _ => Vec3::new(-s, -t, -1.0),
    }
}

/// Six faces; each texel is the unit vector towards it, `n * 0.5 + 0.5` in 8 bits.
pub(crate) fn normalization_cube() -> Vec<MipLevel> {
    let coordinate = |i: usize| (2 * i + 1) as f32 / FACE_SIDE as f32 - 1.0;
    (0..6)
        .map(|face| {
            let mut bytes = Vec::with_capacity(4 * FACE_SIDE * FACE_SIDE);
            for y in 0..FACE_SIDE {
                for x in 0..FACE_SIDE {
                    let unit = direction(face, coordinate(x), coordinate(y)).normalize();
                    let stored = unit.to_array().map(|c| ((0.5 * c + 0.5) * 255.0).round() as u8);
                    bytes.extend([stored[0], stored[1], stored[2], 255]);
                }
            }
            MipLevel { size: [FACE_SIDE, FACE_SIDE], bytes }
        })
        .collect()
}
