// Self-shadow: the technique's own search from the hit towards the light.
#import "bindings/material.wgsl"
#import "lib/texture_ray.wgsl"

const SHADOW_RAYS: u32 = 1u;

// Without it no shadow ray is compiled.
override cast_shadows: bool = true;

struct ShadowPoint {
    surface: SurfaceFrame,
    place: vec3f,          // the hit in texture space, u and v within the first period
    position: vec3f,       // object space
}

fn tests_shadows() -> bool {
    return cast_shadows;
}

// The share of the light that the relief hides: all or nothing. `to_light`: object space, see shadow_ray.
fn hidden(point: ShadowPoint, to_light: vec3f, distant: bool) -> f32 {
    let ray = shadow_ray(point.surface, to_light, distant, point.place.z, material.scale);
    if !ray.above {
        return 1.0;
    }
    if !(ray.delta.z > 0.0) {
        return 0.0;
    }
    return select(0.0, 1.0, occluded(point.place, ray.delta, ray.cos_theta));
}
