// bump: the normal bent by the heights themselves, read next to the point. No normal map is baked.
// Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.
#import "lib/surface_point.wgsl"
#import "bindings/material.wgsl"
#import "lib/height.wgsl"
#import "lib/perturb.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    // Central differences one texel, or half a pixel where that is wider, to each side.
    let texel = 1.0 / vec2f(material.map_width, material.map_height);
    let reach = max(texel, 0.5 * max(abs(point.uv_dx), abs(point.uv_dy)));
    let across_u = vec2f(reach.x, 0.0);
    let across_v = vec2f(0.0, reach.y);
    let rise = vec2f(
        height_at(point.uv + across_u) - height_at(point.uv - across_u),
        height_at(point.uv + across_v) - height_at(point.uv - across_v));
    return perturb_by_slope(point.surface, material.scale * rise / (2.0 * reach));
}
