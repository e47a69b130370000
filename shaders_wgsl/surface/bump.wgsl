// bump: the normal bent by the heights themselves, read on both sides of the point, in axes at any angle.
// No normal map is baked. Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978, in the form of
// Mikkelsen, JCGT 2020, which keeps the smooth normal.
#import "lib/perturb.wgsl"
#import "lib/read_slope.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    return perturb_general(point.surface, central_slope(point));
}
