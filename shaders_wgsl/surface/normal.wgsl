// normal: slopes baked from the heights, with mipmaps. They are kept per tile and turned into mesh
// units by the frame, so the surface is the one that bump and the searches show, whatever the texel
// density of the mesh. Source: Cohen, Olano, Manocha, "Appearance-Preserving Simplification",
// SIGGRAPH 1998; Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", 2010, for slopes as maps.
#import "lib/surface_point.wgsl"
#import "bindings/material.wgsl"
#import "bindings/slopes.wgsl"
#import "lib/perturb.wgsl"
#import "lib/slope_wrap.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    let slope = textureSampleGrad(slope_texture, slope_sampler, point.uv, point.uv_dx, point.uv_dy).xy;
    let factor = slope_factor(point.uv, vec2f(material.map_width, material.map_height), material.wrap);
    return perturb_by_slope(point.surface, slope * factor * material.scale);
}
