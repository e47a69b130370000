// Interval mapping: equal layers, then secant steps that keep the crossing bracketed (regula falsi).
// Risser, Shah and Pattanaik 2007.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/interval.rs.
#import "lib/layers.wgsl"

override linear: i32 = 24;
override refine: i32 = 4;

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    var bracket = first_below(start, delta, linear, stretch.x);
    if !bracket.found {
        return found_left(bracket.steps);
    }
    for (var i = 0; i < refine; i++) {
        let tau = secant(bracket.above, bracket.below, bracket.gap_above, bracket.gap_below);
        let gap = gap_at(start, delta, tau);
        if gap <= 0.0 {
            bracket.below = tau;
            bracket.gap_below = gap;
        } else {
            bracket.above = tau;
            bracket.gap_above = gap;
        }
    }
    let tau = secant(bracket.above, bracket.below, bracket.gap_above, bracket.gap_below);
    return found_hit(tau, bracket.steps + u32(refine));
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    return any_below(start, delta, linear, stretch.y);
}

// How far outside of the heights that it met a hit may lie: a layer.
fn slack(cos_theta: f32) -> f32 {
    return 1.0 / f32(linear);
}
