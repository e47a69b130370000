// Cone ratios of a published map, by corner. Twin of `ratio` in crates/heightfield/src/search/cone_walk.rs.
#import "bindings/cone.wgsl"

// The ratio interpolated between the corners of the cell whose first is at `index`.
fn cone_ratio(index: u32, local: vec2f) -> f32 {
    let below = index + height_info.cells.x + 1u;
    let upper = mix(cones[index], cones[index + 1u], local.x);
    let lower = mix(cones[below], cones[below + 1u], local.x);
    return mix(upper, lower, local.y);
}
