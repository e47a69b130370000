// Relief mapping: equal layers, then bisection inside the bracket of the last sample above and the
// first below. Policarpo, Oliveira and Comba 2005.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/relief.rs.
#import "lib/layers.wgsl"

override linear: i32 = 32;
override refine: i32 = 8;

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    let bracket = first_below(start, delta, linear, stretch.x);
    if !bracket.found {
        return found_left(bracket.steps);
    }
    var above = bracket.above;
    var below = bracket.below;
    for (var i = 0; i < refine; i++) {
        let middle = 0.5 * (above + below);
        if gap_at(start, delta, middle) <= 0.0 {
            below = middle;
        } else {
            above = middle;
        }
    }
    return found_hit(0.5 * (above + below), bracket.steps + u32(refine));
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    return any_below(start, delta, linear, stretch.y);
}

// How far outside of the heights that it met a hit may lie: a layer cut in halves.
fn slack(cos_theta: f32) -> f32 {
    return 1.0 / f32(linear) * exp2(-f32(refine));
}
