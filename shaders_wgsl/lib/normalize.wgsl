// Normalisation that never divides by zero.

// `v` at unit length, or `fallback` where `v` has no length.
fn normalize_or(v: vec3f, fallback: vec3f) -> vec3f {
    let largest = max(max(abs(v.x), abs(v.y)), abs(v.z));
    if !(largest > 1e-30) {
        return fallback;
    }
    // Scaled first, so that neither tiny nor huge vectors leave the range of f32 when squared.
    let scaled = v / largest;
    return scaled * inverseSqrt(dot(scaled, scaled));
}
