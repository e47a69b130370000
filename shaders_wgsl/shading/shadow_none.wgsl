// No self-shadow: techniques that do not search, and entries that do not ask.
#import "lib/surface_frame.wgsl"

struct ShadowPoint {
    surface: SurfaceFrame,
    place: vec3f,
}

fn tests_shadows() -> bool {
    return false;
}

fn shadowed(point: ShadowPoint, to_light: vec3f, distant: bool) -> bool {
    return false;
}
