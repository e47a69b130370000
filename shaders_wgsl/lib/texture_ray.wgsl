// The view ray, seen from texture space.
#import "lib/surface_frame.wgsl"

// Most tiles that a ray may cross between lid and floor. A view so flat that it would cross more
// is bent down until it does not: at scale 0.1 and one tile a mesh unit, views below 0.09 degrees.
const MAX_LATERAL_TILES: f32 = 64.0;
// The flattest ray that a degenerate texture mapping may have, as sine of its elevation.
const MIN_SINE: f32 = 1e-5;

struct TextureRay {
    start: vec3f,      // (u, v, z) on the lid, or at the eye when the eye is below the lid; u, v within the first period
    delta: vec3f,      // from start to the floor z = 0
    tile: vec2f,       // whole periods taken off the start
    cos_theta: f32,    // between ray and normal, mesh units
    t_start: f32,      // position along the ray from the mesh surface, in units of its direction: 0 is the
    t_length: f32,     // mesh surface, -1 the eye
}

// `direction`: from the eye to the point of the mesh surface at `uv`, object space.
// `scale`, `base`: of the relief; `period`: tiles after which the map repeats, 0 for never.
fn texture_ray(
    surface: SurfaceFrame, direction: vec3f, uv: vec2f, scale: f32, base: f32, period: f32,
) -> TextureRay {
    let coordinates = frame_coordinates(surface, direction);
    // Mesh units that the ray sinks per unit of t, and how far that takes it sideways over the whole
    // height. Interpolated normals may turn away from the eye: such rays graze.
    let sideways = length(coordinates.xy) * scale;
    let least = max(sideways / MAX_LATERAL_TILES, length(direction) * MIN_SINE);
    let sink = max(max(-coordinates.z, least), 1e-30);
    let t_height = scale / sink;
    var t_start = -(1.0 - base) * t_height;
    var z_start = 1.0;
    if t_start < -1.0 {
        t_start = -1.0;
        z_start = clamp(base + 1.0 / t_height, 0.0, 1.0);
    }
    let t_length = z_start * t_height;
    let start_uv = uv + coordinates.xy * t_start;
    var tile = vec2f(0.0);
    if period > 0.0 {
        tile = floor(start_uv / period) * period;
    }
    var ray: TextureRay;
    ray.start = vec3f(start_uv - tile, z_start);
    ray.delta = vec3f(coordinates.xy * t_length, -z_start);
    ray.tile = tile;
    ray.cos_theta = clamp(sink / max(length(direction), 1e-30), 0.0, 1.0);
    ray.t_start = t_start;
    ray.t_length = t_length;
    return ray;
}

struct ShadowRay {
    delta: vec3f,      // from the start to the lid, or to the light below it
    cos_theta: f32,
    above: bool,       // whether the light stands above the mesh surface's horizon at all
}

// The way from height `z` towards a light. `to_light`: object space, its full distance (a point
// light) or any length beyond the lid (`distant`).
fn shadow_ray(surface: SurfaceFrame, to_light: vec3f, distant: bool, z: f32, scale: f32) -> ShadowRay {
    let coordinates = frame_coordinates(surface, to_light);
    var ray: ShadowRay;
    ray.above = coordinates.z > 0.0;
    if !ray.above {
        ray.delta = vec3f(0.0, 0.0, 1.0);
        ray.cos_theta = 0.0;
        return ray;
    }
    let sideways = length(coordinates.xy) * scale;
    let least = max(sideways / MAX_LATERAL_TILES, length(to_light) * MIN_SINE);
    let rise = max(max(coordinates.z, least), 1e-30);
    var part = (1.0 - z) * scale / rise;
    if !distant {
        part = min(part, 1.0);
    }
    let height = select(1.0 - z, min(part * rise / max(scale, 1e-30), 1.0 - z), scale > 0.0);
    ray.delta = vec3f(coordinates.xy * part, height);
    ray.cos_theta = clamp(rise / max(length(to_light), 1e-30), 0.0, 1.0);
    return ray;
}
