// bump_blinn: the formula as it was published; the normal of the axes is bent.
// Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.
#import "lib/perturb.wgsl"
#import "lib/read_slope.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    return perturb_blinn(point.surface, central_slope(point));
}
