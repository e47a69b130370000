// Steep parallax mapping with layers adapted to the view angle (linear in its cosine).
// McGuire and McGuire 2005; Tatarchuk 2006.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal.
// Twin of crates/heightfield/src/search/steep_linear.rs.
#import "lib/layers.wgsl"

override min_steps: i32 = 8;
override max_steps: i32 = 64;

fn search(start: vec3f, delta: vec3f, cos_theta: f32) -> Found {
    let bracket = first_below(start, delta, linear_layers(min_steps, max_steps, cos_theta));
    if !bracket.found {
        return found_left(bracket.steps);
    }
    return found_hit(bracket.below, bracket.steps);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32) -> bool {
    return any_below(start, delta, linear_layers(min_steps, max_steps, cos_theta));
}
