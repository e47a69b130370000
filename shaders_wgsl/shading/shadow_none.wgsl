// No self-shadow: techniques that do not search, and entries that do not ask.
#import "lib/hidden.wgsl"
#import "lib/surface_frame.wgsl"
#import "lib/surface_point.wgsl"

const SHADOW_RAYS: u32 = 0u;

struct ShadowPoint {
    surface: SurfaceFrame,
    place: vec3f,
    position: vec3f,       // object space
}

fn tests_shadows() -> bool {
    return false;
}

fn shadow_point_on_mesh(point: SurfacePoint) -> ShadowPoint {
    return ShadowPoint(point.surface, vec3f(point.uv, 0.0), vec3f(0.0));
}

fn hidden(point: ShadowPoint, to_light: vec3f, distant: bool) -> Hidden {
    return Hidden(0.0, SHADOW_RAYS);
}
