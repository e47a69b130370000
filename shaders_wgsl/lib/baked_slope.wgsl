// Slopes baked from the heights, with mipmaps, in mesh units a tile along u and v.
#import "bindings/material.wgsl"
#import "bindings/slopes.wgsl"
#import "lib/gloss.wgsl"
#import "lib/slope_wrap.wgsl"
#import "lib/surface_point.wgsl"
#import "shading/branches.wgsl"

fn baked_slope(point: SurfacePoint) -> vec2f {
    let texel = textureSampleGrad(slope_texture, slope_sampler, point.uv, point.uv_dx, point.uv_dy);
    if specular_aa {
        let surface = point.surface;
        let volume = dot(cross(surface.dpdu, surface.dpdv), surface.normal);
        let deviation = texel.zw * (material.scale / max(abs(volume), 1e-30));
        lean_u = steepest(deviation.x * cross(surface.normal, surface.dpdv));
        lean_v = steepest(deviation.y * cross(surface.dpdu, surface.normal));
    }
    let factor = slope_factor(point.uv, vec2f(material.map_width, material.map_height), wrap_mode());
    return texel.xy * factor * material.scale;
}
