// Shadows by rays through shells: everything that a displaced mesh hides, across its triangles and charts, and what
// all other meshes of the scene hide. Stands beside the other `shading/shadow_*.wgsl`.
#import "bindings/draw.wgsl"
#import "bindings/material.wgsl"
#import "bindings/solid_heights.wgsl"
#import "lib/hidden.wgsl"
#import "lib/normalize.wgsl"
#import "lib/surface_frame.wgsl"
#import "shading/shell.wgsl"

const SHADOW_RAYS: u32 = 1u;
// Boxes of instances put off at a time; the host keeps the topmost tree lower than that.
const TOP_STACK: u32 = 48u;

// Without it no shadow ray is compiled.
override cast_shadows: bool = true;

struct ShadowPoint {
    surface: SurfaceFrame,
    place: vec3f,
    position: vec3f,       // on the displaced surface, object space
    start: ShellStart,
}

fn tests_shadows() -> bool {
    return cast_shadows;
}

// Whether an instance is in the way. relative: the start; to_light: from there. Both in camera-relative world space.
fn blocks(at: u32, point: ShadowPoint, relative: vec3f, to_light: vec3f, last: f32) -> bool {
    let instance = instances[at];
    enter_solid(instance.solid);
    let direction = (instance.object_from_relative * vec4f(to_light, 0.0)).xyz;
    let starts_here = at == draw_info().own.x;
    var origin = point.position;
    if !starts_here {
        origin = (instance.object_from_relative * vec4f(relative, 1.0)).xyz;
    }
    var ray = shell_ray(origin, direction, 0.0);
    ray.for_shadow = true;
    ray.starts_here = starts_here;
    ray.start = point.start;
    return trace_solid(ray, min(last * length(direction), 1e30)).found;
}

// The share of the light that is hidden: all or nothing. `to_light`: object space, its full distance.
fn hidden(point: ShadowPoint, to_light: vec3f, distant: bool) -> Hidden {
    let relative = (draw_info().relative_from_object * vec4f(point.position, 1.0)).xyz;
    let direction = (draw_info().relative_from_object * vec4f(to_light, 0.0)).xyz;
    let last = select(1.0, 1e30, distant);
    let inverse = inverse_of(direction);
    var stack: array<u32, TOP_STACK>;
    var height = 1u;
    var found = false;
    // What is left of a leaf.
    var item = 0u;
    var end = 0u;
    loop {
        while height > 0u && item == end {
            height -= 1u;
            let node = top_nodes[stack[height]];
            if enters_box(relative, inverse, node, 0.0, last) < 1e30 {
                if node.count != INNER_NODE {
                    item = node.first;
                    end = item + node.count;
                } else if height + 2u <= TOP_STACK {
                    stack[height] = node.first;
                    stack[height + 1u] = node.first + 1u;
                    height += 2u;
                }
            }
        }
        if item == end || found {
            break;
        }
        found = blocks(item, point, relative, direction, last);
        item += 1u;
    }
    return Hidden(select(0.0, 1.0, found), SHADOW_RAYS);
}

// The point of the displaced surface over a place of the mesh. weights: of the second and third corner.
fn displaced_position(face: u32, weights: vec2f, height: f32) -> vec3f {
    let a = corner_of(face, 0u);
    let b = corner_of(face, 1u);
    let c = corner_of(face, 2u);
    let w = vec3f(1.0 - weights.x - weights.y, weights);
    let normal = normalize_or(w.x * a.up.xyz + w.y * b.up.xyz + w.z * c.up.xyz, vec3f(0.0));
    let on_mesh = w.x * a.place.xyz + w.y * b.place.xyz + w.z * c.place.xyz;
    return on_mesh + material.scale * (height - material.base) * normal;
}
