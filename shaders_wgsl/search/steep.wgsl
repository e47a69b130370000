// Steep parallax mapping: equal layers, the first sample below the surface is the hit.
// McGuire and McGuire 2005.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/steep.rs.
#import "lib/layers.wgsl"

override steps: i32 = 32;

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    let bracket = first_below(start, delta, steps, stretch.x);
    if !bracket.found {
        return found_left(bracket.steps);
    }
    return found_hit(bracket.below, bracket.steps);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    return any_below(start, delta, steps, stretch.y);
}

// How far outside of the heights that it met a hit may lie: a layer.
fn slack(cos_theta: f32) -> f32 {
    return 1.0 / f32(steps);
}
