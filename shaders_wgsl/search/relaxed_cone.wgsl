// Relaxed cone stepping that misses nothing: steps through cones that a ray pierces at most once; where one
// ends below the surface, halving finds the crossing. Rays that rise step by empty cones.
// Policarpo and Oliveira 2007; Ban, Valasek, Balint and Vad 2024.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/relaxed_cone.rs.
#import "lib/cone_walk.wgsl"
#import "lib/cone_by_cell.wgsl"

override steps: i32 = 16384;
override refine: i32 = 12;

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    return walk(start, delta, false, steps, true, refine, stretch);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    let found = walk(start, delta, true, steps, true, refine, stretch);
    return found.status == 0u && found.tau <= 1.0;
}

// How far outside of the heights that it met a hit may lie: on the surface, or it is none.
fn slack(cos_theta: f32) -> f32 {
    return 0.0;
}
