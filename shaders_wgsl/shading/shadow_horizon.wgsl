// Self-shadow from a baked horizon map, instead of a ray: for searches and for surfaces that stay on the
// mesh alike. Stands in for the other `shading/shadow_*.wgsl`.
//
// The map was baked for the plane: on a curved mesh each point takes its tangent plane for it. What hides
// a light that stands within the relief is not told from what stands behind it.
#import "bindings/horizon.wgsl"
#import "lib/hidden.wgsl"
#import "lib/horizon.wgsl"
#import "lib/surface_frame.wgsl"
#import "lib/surface_point.wgsl"

const SHADOW_RAYS: u32 = 0u;

struct ShadowPoint {
    surface: SurfaceFrame,
    place: vec3f,          // texture space
    position: vec3f,       // object space
}

fn tests_shadows() -> bool {
    return true;
}

// A point that is shaded where it lies on the mesh. Without texture axes the tangent tells them.
fn shadow_point_on_mesh(point: SurfacePoint) -> ShadowPoint {
    var surface = point.surface;
    if dot(surface.dpdu, surface.dpdu) == 0.0 {
        surface.dpdu = point.tangent.xyz * horizon_info.tile_size.x;
        surface.dpdv = cross(point.tangent.xyz, surface.normal) * (point.tangent.w * horizon_info.tile_size.y);
    }
    return ShadowPoint(surface, vec3f(point.uv, 0.0), vec3f(0.0));
}

// Sine of the horizon's elevation at `uv` towards a direction of the map's mesh space, y up.
fn horizon_sine(uv: vec2f, direction: vec2f) -> f32 {
    let place = horizon_turns(direction) * f32(horizon_info.azimuths);
    let before = floor(place);
    let layer = u32(before) % horizon_info.azimuths;
    let next = (layer + 1u) % horizon_info.azimuths;
    let a = textureSampleLevel(horizon_texture, horizon_sampler, uv, layer, 0.0).r;
    let b = textureSampleLevel(horizon_texture, horizon_sampler, uv, next, 0.0).r;
    return mix(a, b, place - before);
}

// The share of the light that the relief hides. `to_light`: object space.
fn hidden(point: ShadowPoint, to_light: vec3f, distant: bool) -> Hidden {
    // Texture space is the same on every mesh; the map's own mesh space is the one it was baked for.
    let coordinates = frame_coordinates(point.surface, to_light);
    let across = coordinates.xy * horizon_info.tile_size * vec2f(1.0, -1.0);
    let length_squared = dot(across, across) + coordinates.z * coordinates.z;
    if !(coordinates.z > 0.0) || !(length_squared > 0.0) {
        return Hidden(1.0, SHADOW_RAYS);
    }
    let light_sine = coordinates.z / sqrt(length_squared);
    let share = horizon_hides(light_sine, horizon_sine(point.place.xy, across), horizon_info.softness);
    return Hidden(share, SHADOW_RAYS);
}
