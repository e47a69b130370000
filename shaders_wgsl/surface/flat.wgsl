// flat: the mesh's own normal; the height map plays no part.
#import "lib/surface_point.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    return point.surface.normal;
}
