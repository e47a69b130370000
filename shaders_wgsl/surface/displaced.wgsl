// displaced: the normal of the surface that a search found, from baked slopes and the height where it ended,
// with the bend of the mesh: what truly displaced geometry would have there.
// Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978, before the approximation; Cook, "Shade
// Trees", SIGGRAPH 1984.
#import "lib/baked_slope.wgsl"
#import "lib/perturb.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    let rise = material.scale * (point.height - material.base);
    return perturb_exact(point.surface, point.dndu, point.dndv, baked_slope(point), rise);
}
