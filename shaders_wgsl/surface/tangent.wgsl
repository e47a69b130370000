// tangent: the user's own tangent-space normal map in the mesh's tangent frame, as it is.
// Source: glTF 2.0, "normalTexture"; Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008.
#import "lib/surface_point.wgsl"
#import "bindings/material.wgsl"
#import "bindings/normal_map.wgsl"
#import "lib/gloss.wgsl"
#import "lib/perturb.wgsl"
#import "lib/slope_wrap.wgsl"
#import "shading/branches.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    let texel = textureSampleGrad(normal_texture, normal_sampler, point.uv, point.uv_dx, point.uv_dy);
    if specular_aa {
        // The length of a mean of normals does not tell which way they lean: the same all around.
        let deviation = sqrt((1.0 - texel.w) / max(texel.w, 1e-3));
        lean_u = deviation * point.tangent.xyz;
        lean_v = deviation * cross(point.surface.normal, point.tangent.xyz);
    }
    var normal_ts = texel.xyz * 2.0 - 1.0;
    if wrap_mode() == WRAP_MIRROR {
        let size = vec2f(textureDimensions(normal_texture));
        normal_ts = vec3f(normal_ts.xy * slope_factor(point.uv, size, WRAP_MIRROR), normal_ts.z);
    }
    return perturb_by_map(point.surface.normal, point.tangent, normal_ts);
}
