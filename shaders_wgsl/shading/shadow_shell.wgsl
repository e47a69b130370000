// Shadows of the relief by rays through the shell: everything the displaced mesh hides, across its triangles and
// charts. Stands beside the other `shading/shadow_*.wgsl`.
#import "bindings/material.wgsl"
#import "lib/normalize.wgsl"
#import "lib/surface_frame.wgsl"
#import "shading/shell.wgsl"

const SHADOW_RAYS: u32 = 1u;

// Without it no shadow ray is compiled.
override cast_shadows: bool = true;

struct ShadowPoint {
    surface: SurfaceFrame,
    place: vec3f,
    position: vec3f,       // on the displaced surface, object space
}

fn tests_shadows() -> bool {
    return cast_shadows;
}

// The share of the light that the relief hides: all or nothing. `to_light`: object space, its full distance.
fn hidden(point: ShadowPoint, to_light: vec3f, distant: bool) -> f32 {
    let last = select(length(to_light), 1e30, distant);
    let ray = shell_ray(point.position, to_light, 0.0, true);
    return select(0.0, 1.0, trace_shell(ray, to_light, last).found);
}

// The point of the displaced surface over a place of the mesh. weights: of the second and third corner.
fn displaced_position(face: u32, weights: vec2f, height: f32) -> vec3f {
    let a = vertices[triangles[3u * face]];
    let b = vertices[triangles[3u * face + 1u]];
    let c = vertices[triangles[3u * face + 2u]];
    let w = vec3f(1.0 - weights.x - weights.y, weights);
    let normal = normalize_or(w.x * a.up.xyz + w.y * b.up.xyz + w.z * c.up.xyz, vec3f(0.0));
    let on_mesh = w.x * a.place.xyz + w.y * b.place.xyz + w.z * c.place.xyz;
    return on_mesh + material.scale * (height - material.base) * normal;
}
