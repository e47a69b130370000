// Bisection over the whole segment without a linear phase: finds a crossing, not the first.
// Policarpo, Oliveira and Comba 2005 (refinement alone).
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/binary.rs.
#import "lib/layers.wgsl"

override steps: i32 = 16;

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    var above = 0.0;
    var below = 1.0;
    var found = delta.z < 0.0;
    for (var i = 0; i < steps; i++) {
        let middle = 0.5 * (above + below);
        if gap_at(start, delta, middle) <= 0.0 {
            below = middle;
            found = true;
        } else {
            above = middle;
        }
    }
    if !found {
        return found_left(u32(steps));
    }
    return found_hit(below, u32(steps));
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    // Halving towards the surface; closer than 1/256 the surface shadows itself by rounding.
    let lift = lift_from(start);
    var far = 1.0;
    for (var i = 0; i < min(steps, 8); i++) {
        far *= 0.5;
        if gap_at(start + lift, delta - lift, far) < 0.0 {
            return true;
        }
    }
    return false;
}

// How far outside of the heights that it met a hit may lie: what halving leaves.
fn slack(cos_theta: f32) -> f32 {
    return exp2(-f32(steps));
}
