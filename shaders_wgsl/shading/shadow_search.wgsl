// Self-shadow: the technique's own search from the hit towards the light.
#import "bindings/material.wgsl"
#import "lib/texture_ray.wgsl"

// Without it no shadow ray is compiled.
override cast_shadows: bool = true;

struct ShadowPoint {
    surface: SurfaceFrame,
    place: vec3f,          // the hit in texture space, u and v within the first period
}

fn tests_shadows() -> bool {
    return cast_shadows;
}

// Whether the relief hides the light. `to_light`: object space, see shadow_ray.
fn shadowed(point: ShadowPoint, to_light: vec3f, distant: bool) -> bool {
    let ray = shadow_ray(point.surface, to_light, distant, point.place.z, material.scale);
    if !ray.above {
        return true;
    }
    if !(ray.delta.z > 0.0) {
        return false;
    }
    return occluded(point.place, ray.delta, ray.cos_theta);
}
