// The same walk as relaxed_cone.wgsl with the published maps, interpolated between texels: what a cone that
// is pierced more than once jumps over is missed. Policarpo and Oliveira 2007.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/relaxed_cone_texel.rs.
#import "lib/cone_walk.wgsl"
#import "lib/cone_by_corner.wgsl"

override steps: i32 = 16384;
override refine: i32 = 12;

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    return walk(start, delta, false, steps, true, refine, WHOLE_STRETCH);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    let found = walk(start, delta, true, steps, true, refine, stretch);
    return found.status == 0u && found.tau <= 1.0;
}

// How far outside of the heights that it met a hit may lie: anywhere below a feature it has missed.
fn slack(cos_theta: f32) -> f32 {
    return 1.0;
}
