// The height at a place, for entries that bind the heights of the exact search, which are never filtered.
#import "bindings/pyramid.wgsl"

// Height in 0..1 at texture coordinates `uv`, bilinear.
fn surface_height(uv: vec2f) -> f32 {
    let p = uv * height_info.size - 0.5;
    let cell = floor(p);
    let f = p - cell;
    let corners = corners_of(cell);
    return mix(mix(corners.x, corners.y, f.x), mix(corners.z, corners.w, f.x), f.y);
}
