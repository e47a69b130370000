// Cone ratios of a conservative map, by cell. Twin of `ratio` in crates/heightfield/src/search/cone_walk.rs.
#import "bindings/cone.wgsl"

// The ratio that holds in the whole cell at `index`.
fn cone_ratio(index: u32, local: vec2f) -> f32 {
    return cones[index];
}
