// Slopes baked from the heights, with mipmaps, in mesh units a tile along u and v.
#import "bindings/material.wgsl"
#import "bindings/slopes.wgsl"
#import "lib/gloss.wgsl"
#import "lib/slope_wrap.wgsl"
#import "lib/surface_point.wgsl"
#import "shading/branches.wgsl"

fn baked_slope(point: SurfacePoint) -> vec2f {
    let texel = textureSampleGrad(slope_texture, slope_sampler, point.uv, point.uv_dx, point.uv_dy);
    let tile = max(vec2f(length(point.surface.dpdu), length(point.surface.dpdv)), vec2f(1e-30));
    let deviation = texel.zw * material.scale / tile;
    slope_variance = 0.5 * dot(deviation, deviation);
    let factor = slope_factor(point.uv, vec2f(material.map_width, material.map_height), wrap_mode());
    return texel.xy * factor * material.scale;
}
