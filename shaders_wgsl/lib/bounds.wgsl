// What a ray can meet: the heights and slopes of the surface around a stretch of it, from a quadtree. Each node
// holds half a node around it too, so one read answers for whatever is no longer than a node.
#import "bindings/bounds.wgsl"
#import "lib/height_info.wgsl"

// What rounding of positions and of the heights themselves may take.
const BOUNDS_ROUNDING: f32 = 2.5e-7;

// A ray over the quadtree.
struct GroundRay {
    start: vec2f,          // in periods, at height `z`
    per_height: vec2f,     // periods for one height up
    z: f32,
}

fn ground_ray(start: vec3f, delta: vec3f) -> GroundRay {
    let periods = 1.0 / vec2f(height_info.cells);
    let place = (start.xy * height_info.size - (0.5 + f32(height_info.first_texel))) * periods;
    let rise = select(1e-30, delta.z, abs(delta.z) > 1e-30);
    return GroundRay(place, delta.xy * height_info.size * periods * (1.0 / rise), start.z);
}

// The node that holds all that the ray passes between two heights.
fn ground_node(ray: GroundRay, low: f32, high: f32) -> u32 {
    let place = ray.start + ray.per_height * (0.5 * (low + high) - ray.z);
    let across = abs(ray.per_height) * (high - low);
    // The finest nodes that are not narrower: 2^exponent is more than the reach.
    let exponent = i32(bitcast<u32>(1.01 * max(across.x, across.y)) >> 23u) - 126;
    let depth = u32(clamp(-exponent, 0, i32(height_info.bounds_depth)));
    let last = (1 << depth) - 1;
    let raw = vec2i(floor(place * f32(last + 1)));
    // Beyond a clamped map the nodes at the border go on.
    let id = select(raw & vec2i(last), clamp(raw, vec2i(0), vec2i(last)), height_info.wrap == 1u);
    return (0x55555555u & u32((1 << (2u * depth)) - 1)) + u32((id.y << depth) + id.x);
}

// The lowest and the highest surface there.
fn ground_heights(node: u32) -> vec2f {
    return unpack2x16unorm(bounds[node]) + vec2f(-BOUNDS_ROUNDING, BOUNDS_ROUNDING);
}

// The steepest rises there, along u and v.
fn ground_slopes(node: u32) -> vec2f {
    let nodes = 0x55555555u & ((1u << (2u * (height_info.bounds_depth + 1u))) - 1u);
    return unpack2x16unorm(bounds[nodes + node]);
}
