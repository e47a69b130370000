// Parallax occlusion mapping: equal layers, then one secant step inside the bracket. Tatarchuk 2006.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal.
// Twin of crates/heightfield/src/search/pom.rs.
#import "lib/layers.wgsl"

override steps: i32 = 32;

fn search(start: vec3f, delta: vec3f, cos_theta: f32) -> Found {
    let bracket = first_below(start, delta, steps);
    if !bracket.found {
        return found_left(bracket.steps);
    }
    let tau = secant(bracket.above, bracket.below, bracket.gap_above, bracket.gap_below);
    return found_hit(tau, bracket.steps);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32) -> bool {
    return any_below(start, delta, steps);
}
