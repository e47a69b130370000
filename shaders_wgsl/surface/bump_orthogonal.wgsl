// bump_orthogonal: as bump, as if the axes of the mapping were orthogonal.
// Source: Kilgard, "A Practical and Robust Bump-mapping Technique for Today's GPUs", GDC 2000.
#import "lib/perturb.wgsl"
#import "lib/read_slope.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    return perturb_orthogonal(point.surface, central_slope(point));
}
