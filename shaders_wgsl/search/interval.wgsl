// Interval mapping: equal layers, then secant steps that keep the crossing bracketed (regula falsi).
// Risser, Shah and Pattanaik 2007.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal.
// Twin of crates/heightfield/src/search/interval.rs.
#import "lib/layers.wgsl"

override linear: i32 = 24;
override refine: i32 = 4;

fn search(start: vec3f, delta: vec3f, cos_theta: f32) -> Found {
    var bracket = first_below(start, delta, linear);
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

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32) -> bool {
    return any_below(start, delta, linear);
}
