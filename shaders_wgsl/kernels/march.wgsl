// Marches many segments with one search: parity tests, benches and `march(device="gpu")`.
//
// The host clips rays to the slab 0 <= z <= 1 in f64 (heightfield `Segment::clip`) and turns tau back
// into a ray parameter, so coordinates far from the origin keep their precision. A `search/` file is
// composed in front of this one.
#import "lib/found.wgsl"

struct MarchSegment {
    // Texture space (u, v, z), u and v on the tile at the origin.
    start: vec3f,
    // Cosine between ray and normal in mesh units.
    cos_theta: f32,
    // End minus start.
    delta: vec3f,
    unused: f32,
    // The part of it that can meet the surface, from 0 to 1.
    stretch: vec2f,
    unused_too: vec2f,
}

struct MarchResult {
    tau: f32,
    status: u32,
    steps: u32,
    unused: u32,
}

@group(0) @binding(0) var<storage, read> segments: array<MarchSegment>;
@group(0) @binding(1) var<storage, read_write> results: array<MarchResult>;

// Asks for `occluded` (status 0 = blocked) instead of `search`.
override shadow_rays: bool = false;

@compute @workgroup_size(64)
fn march(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let index = id.x + id.y * groups.x * 64u;
    if index >= arrayLength(&segments) {
        return;
    }
    let segment = segments[index];
    if shadow_rays {
        let blocked = occluded(segment.start, segment.delta, segment.cos_theta, segment.stretch);
        results[index] = MarchResult(1.0, select(1u, 0u, blocked), 0u, 0u);
    } else {
        let found = search(segment.start, segment.delta, segment.cos_theta, segment.stretch);
        results[index] = MarchResult(found.tau, found.status, found.steps, 0u);
    }
}
