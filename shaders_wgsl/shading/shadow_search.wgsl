// Self-shadow: the technique's own search from the hit towards the light.
#import "bindings/draw.wgsl"
#import "bindings/material.wgsl"
#import "lib/bounds.wgsl"
#import "lib/found.wgsl"
#import "lib/hidden.wgsl"
#import "lib/texture_ray.wgsl"

const SHADOW_RAYS: u32 = 1u;
// Heights between the surface and a start that lies on it, for searches that end on it: ON_SURFACE of search/exact.wgsl
// and of lib/cell_walk.wgsl.
const SETTLED: f32 = 1e-3;

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
fn hidden(point: ShadowPoint, to_light: vec3f, distant: bool) -> Hidden {
    let ray = shadow_ray(point.surface, to_light, distant, point.place.z, material.scale);
    if !ray.above {
        return Hidden(1.0, select(SHADOW_RAYS, 0u, skip_shadow));
    }
    if !(ray.delta.z > 0.0) {
        return Hidden(0.0, select(SHADOW_RAYS, 0u, skip_shadow));
    }
    var stretch = WHOLE_STRETCH;
    // Searches whose hits may lie anywhere promise nothing of what they meet from there.
    if skip_shadow && cast_shadows && slack(1.0) < 1.0 {
        let until = clears(point.place, ray.delta);
        if until <= 0.0 {
            return Hidden(0.0, 0u);
        }
        stretch.y = until;
    }
    return Hidden(select(0.0, 1.0, occluded(point.place, ray.delta, ray.cos_theta, stretch)), SHADOW_RAYS);
}

// Where along a segment that leaves the surface nothing stands in its way any more; 0 where nothing ever does: it
// starts above all that it passes, or rises faster than any of it.
fn clears(place: vec3f, delta: vec3f) -> f32 {
    var start = place;
    // Searches that end on the surface let what starts close to it start on it; what is deeper is hidden where it is.
    // Those with layers lift what starts below, and the rest of the segment rises by so much less.
    var below = height_at(start.xy) - start.z;
    let settles = slack(1.0) == 0.0;
    if settles && abs(below) <= SETTLED {
        start.z += below;
        below = 0.0;
    }
    let top = start.z + delta.z;
    let over = ground_ray(start, delta);
    var high = clamp(draw_info().span.y, start.z, top);
    high = clamp(ground_heights(ground_node(over, start.z, high)).y, start.z, high);
    let node = ground_node(over, start.z, high);
    high = clamp(ground_heights(node).y, start.z, high);
    var rise = dot(ground_slopes(node), abs(delta.xy) * vec2f(material.map_width, material.map_height));
    rise += select(max(below, 0.0), delta.z, settles && below > 0.0);
    return select((high - start.z) / delta.z, 0.0, delta.z > rise);
}
