// bump_derivative: as bump, but the axes come from derivatives along the screen: the mesh needs no tangents.
// Source: Mikkelsen, "Bump Mapping Unparametrized Surfaces on the GPU", 2010.
#import "lib/perturb.wgsl"
#import "lib/read_slope.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    let slope = central_slope(point);
    // The screen's own axes are the frame, and the heights change along them.
    let screen = SurfaceFrame(point.position_dx, point.position_dy, point.surface.normal);
    return perturb_general(screen, vec2f(dot(slope, point.uv_dx), dot(slope, point.uv_dy)));
}
