// normal: slopes baked from the heights, with mipmaps. They are kept per tile and turned into mesh
// units by the frame, so the surface is the one that bump and the searches show, whatever the texel
// density of the mesh. Source: Cohen, Olano, Manocha, "Appearance-Preserving Simplification",
// SIGGRAPH 1998; Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", 2010, for slopes as maps.
#import "lib/baked_slope.wgsl"
#import "lib/perturb.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    return perturb_general(point.surface, baked_slope(point));
}
