// Steep parallax mapping with layers adapted to the view angle (linear in its cosine).
// McGuire and McGuire 2005; Tatarchuk 2006.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/steep_linear.rs.
#import "lib/layers.wgsl"

override min_steps: i32 = 8;
override max_steps: i32 = 64;

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    let bracket = first_below(start, delta, linear_layers(min_steps, max_steps, cos_theta), stretch.x);
    if !bracket.found {
        return found_left(bracket.steps);
    }
    return found_hit(bracket.below, bracket.steps);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    return any_below(start, delta, linear_layers(min_steps, max_steps, cos_theta), stretch.y);
}

// How far outside of the heights that it met a hit may lie: a layer.
fn slack(cos_theta: f32) -> f32 {
    return 1.0 / f32(linear_layers(min_steps, max_steps, cos_theta));
}
