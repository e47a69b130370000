// Cone stepping that misses nothing: each step goes as far as an empty cone reaches, or to the cell's wall
// after the bilinear cell was solved in closed form. Dummer 2006; Ban, Valasek, Balint and Vad 2024.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/cone.rs.
#import "lib/cone_walk.wgsl"
#import "lib/cone_by_cell.wgsl"

override steps: i32 = 16384;

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    return walk(start, delta, false, steps, false, 0, stretch);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    let found = walk(start, delta, true, steps, false, 0, stretch);
    return found.status == 0u && found.tau <= 1.0;
}

// How far outside of the heights that it met a hit may lie: on the surface, or it is none.
fn slack(cos_theta: f32) -> f32 {
    return 0.0;
}
