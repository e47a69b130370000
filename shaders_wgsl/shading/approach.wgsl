// How much of a fragment's march the picture needs: all of it, the stretch between the highest and the lowest ground
// that the ray can meet, or none, where the ground varies so little that no one could tell.
// What each kind promises: docs/skipping.md.
#import "bindings/draw.wgsl"
#import "bindings/material.wgsl"
#import "lib/bounds.wgsl"
#import "lib/found.wgsl"
#import "lib/targets.wgsl"
#import "lib/texture_ray.wgsl"

// Each kind by itself; without any, nothing of this is compiled.
override skip_flat: bool = false;
override skip_parallax: bool = false;
override skip_range: bool = false;
// The host has shown that the parallax of no pixel can be seen.
override skip_march: bool = false;

// Looks at the bounds, each at the ground that the one before has left.
const LOOKS: i32 = 2;
// Two steps of 16 bits: what the bounds of level ground may be apart, rounded as they are.
const LEVEL_GROUND: f32 = 2.1 / 65535.0;

struct Approach {
    stretch: vec2f,    // the part of the segment that can meet the surface
    spared: bool,      // whether to look the surface up at height `z` of the ray, and not to march
    z: f32,
    trace: u32,        // what to note of it
}

// What is left of the heights that a ray can meet, lowest and highest: what lies below that part of it tells which part
// can meet the surface, and that lies over less.
fn narrowed(over: GroundRay, left: vec2f) -> vec2f {
    let ground = ground_heights(ground_node(over, left.x, left.y));
    let high = max(min(left.y, ground.y), left.x);
    return vec2f(min(max(left.x, ground.x), high), high);
}

// direction: from the eye to the mesh surface, object space. own: how far outside of the ground's heights the hits
// of the search may lie.
fn approach(ray: TextureRay, direction: vec3f, own: f32) -> Approach {
    var result = Approach(WHOLE_STRETCH, false, 0.0, TRACE_MARCHED);
    if !(skip_flat || skip_parallax || skip_range || skip_march) || own >= NO_MARCH {
        return result;
    }
    let sideways = length(ray.delta.xy * vec2f(material.map_width, material.map_height));
    let drop = max(-ray.delta.z, 1e-30);
    // How far a hit may be off, in heights.
    let allowed = max(draw_info().most_texels * drop / max(sideways, 1e-30), dot(direction, draw_info().most_heights)) - own;
    var left = vec2f(draw_info().span.x, max(min(draw_info().span.y, ray.start.z), draw_info().span.x));
    let over = ground_ray(ray.start, ray.delta);
    if !skip_march {
        for (var i = 0; i < LOOKS; i++) {
            left = narrowed(over, left);
        }
    }
    let off_mesh = max(left.y - material.base, material.base - left.x);
    let flat_ground = skip_flat && left.y - left.x <= LEVEL_GROUND && (skip_march || left.y - left.x <= 2.0 * allowed);
    let on_mesh = skip_parallax && off_mesh <= allowed;
    let near = on_mesh || (skip_parallax && left.y - left.x <= 2.0 * allowed);
    result.spared = flat_ground || near || skip_march;
    result.z = select(0.5 * (left.x + left.y), material.base, on_mesh && !flat_ground);
    if skip_range {
        let clear = clamp((ray.start.z - left.y) / drop, 0.0, 1.0);
        let sure = clamp((ray.start.z - left.x) / drop, clear, 1.0);
        result.stretch = vec2f(clear, sure);
        result.trace = TRACE_MARCHED | select(0u, TRACE_RANGE, clear > 0.0 || sure < 1.0);
    }
    if result.spared {
        result.trace = select(TRACE_PARALLAX, TRACE_ON_MESH, on_mesh);
        result.trace = select(result.trace, TRACE_FLAT, flat_ground);
    }
    return result;
}
