// dot3: the fixed-function diffuse of 1999. The light vector reaches the fragment interpolated and
// unnormalised, an 8-bit cube map normalises it, and the combiner multiplies it with an 8-bit normal.
// Source: Kilgard, "A Practical and Robust Bump-mapping Technique for Today's GPUs", GDC 2000.
#import "bindings/material.wgsl"
#import "bindings/normal_map.wgsl"
#import "bindings/normalization_cube.wgsl"
#import "lib/dot3.wgsl"
#import "lib/slope_wrap.wgsl"
#import "shading/branches.wgsl"

// The 8-bit normal at `uv`, each component n * 0.5 + 0.5.
fn stored_normal(uv: vec2f, uv_dx: vec2f, uv_dy: vec2f) -> vec3f {
    let normal = textureSampleGrad(normal_texture, normal_sampler, uv, uv_dx, uv_dy).xyz;
    if wrap_mode() == WRAP_MIRROR {
        let factor = slope_factor(uv, vec2f(textureDimensions(normal_texture)), WRAP_MIRROR);
        return vec3f((normal.xy - 0.5) * factor + 0.5, normal.z);
    }
    return normal;
}

// Diffuse share of the light, 0..1. `light_ts`: towards the light, tangent space, any length.
fn dot3_diffuse(normal: vec3f, light_ts: vec3f) -> f32 {
    let light = textureSampleLevel(normalization_cube, normalization_sampler, light_ts, 0.0).xyz;
    return dot3(normal, light);
}
