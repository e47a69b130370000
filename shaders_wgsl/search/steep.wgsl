// Steep parallax mapping: equal layers, the first sample below the surface is the hit.
// McGuire and McGuire 2005.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal.
// Twin of crates/heightfield/src/search/steep.rs.
#import "lib/layers.wgsl"

override steps: i32 = 32;

fn search(start: vec3f, delta: vec3f, cos_theta: f32) -> Found {
    let bracket = first_below(start, delta, steps);
    if !bracket.found {
        return found_left(bracket.steps);
    }
    return found_hit(bracket.below, bracket.steps);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32) -> bool {
    return any_below(start, delta, steps);
}
