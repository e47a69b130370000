//! The DOT3 register combiner. Twin of `shaders_wgsl/lib/dot3.wgsl`.
//!
//! Source: Kilgard, "A Practical and Robust Bump-mapping Technique for Today's GPUs", GDC 2000.

use glam::Vec3;

/// `4 ((a - 1/2) . (b - 1/2))` of two vectors stored as `n * 0.5 + 0.5`, clamped to 0..1, in 8 bits.
pub fn dot3(normal: Vec3, light: Vec3) -> f32 {
    let half = Vec3::splat(0.5);
    ((4.0 * (normal - half).dot(light - half)).clamp(0.0, 1.0) * 255.0).round() / 255.0
}
