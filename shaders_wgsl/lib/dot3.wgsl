// The DOT3 register combiner. Twin: `crates/render/src/surface/dot3.rs`.

// A register holds 8 bits.
fn to_8_bit(v: f32) -> f32 {
    return round(clamp(v, 0.0, 1.0) * 255.0) / 255.0;
}

// `4 ((a - 1/2) . (b - 1/2))` of two vectors stored as n * 0.5 + 0.5, clamped to 0..1, in 8 bits.
fn dot3(normal: vec3f, light: vec3f) -> f32 {
    return to_8_bit(4.0 * dot(normal - vec3f(0.5), light - vec3f(0.5)));
}
