// bump_exact: the normal of the displaced surface, with the term h dN/du that Blinn drops.
// Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978, equation before the approximation.
#import "lib/perturb.wgsl"
#import "lib/read_slope.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    let rise = material.scale * (height_at(point.uv) - material.base);
    return perturb_exact(point.surface, point.dndu, point.dndv, central_slope(point), rise);
}
