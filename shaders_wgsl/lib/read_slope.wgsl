// Slopes of the heights next to a point, in mesh units a tile along u and v.
// Twin: `crates/render/src/surface/slope.rs`.
#import "bindings/material.wgsl"
#import "lib/height.wgsl"
#import "lib/surface_point.wgsl"

// How far to look along u and v: one texel, or half a pixel where that is wider.
fn slope_reach(point: SurfacePoint) -> vec2f {
    let texel = 1.0 / vec2f(material.map_width, material.map_height);
    return max(texel, 0.5 * max(abs(point.uv_dx), abs(point.uv_dy)));
}

// Half the difference between the two sides: second order in the reach.
fn central_slope(point: SurfacePoint) -> vec2f {
    let reach = slope_reach(point);
    let across_u = vec2f(reach.x, 0.0);
    let across_v = vec2f(0.0, reach.y);
    let rise = vec2f(
        height_at(point.uv + across_u) - height_at(point.uv - across_u),
        height_at(point.uv + across_v) - height_at(point.uv - across_v));
    return material.scale * rise / (2.0 * reach);
}

// The difference to the next point along each axis: one read less, first order, and shifted by half the
// reach towards the upper left.
fn forward_slope(point: SurfacePoint) -> vec2f {
    let reach = slope_reach(point);
    let here = height_at(point.uv);
    let rise = vec2f(
        height_at(point.uv + vec2f(reach.x, 0.0)) - here,
        height_at(point.uv + vec2f(0.0, reach.y)) - here);
    return material.scale * rise / reach;
}
