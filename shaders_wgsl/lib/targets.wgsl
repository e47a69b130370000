// What a fragment writes. A target that nobody asked for has no attachment and is dropped.

struct Shaded {
    color: vec4f,      // linear
    trace: u32,        // see pack_trace
    place: vec4f,      // u, v, depth along the view axis, height
    position: vec4f,   // camera-relative world position, share of lights blocked
    normal: vec4f,     // world space, cosine between ray and frame normal
    ray_start: vec4f,  // texture space (u, v, z), and whole periods taken off u
    ray_delta: vec4f,  // texture space, and whole periods taken off v
}

struct Targets {
    @location(0) color: vec4f,
    @location(1) trace: u32,
    @location(2) place: vec4f,
    @location(3) position: vec4f,
    @location(4) normal: vec4f,
    @location(5) ray_start: vec4f,
    @location(6) ray_delta: vec4f,
}

fn targets(shaded: Shaded) -> Targets {
    return Targets(
        shaded.color, shaded.trace, shaded.place, shaded.position,
        shaded.normal, shaded.ray_start, shaded.ray_delta);
}

const TRACE_COVERED: u32 = 0x80000000u;
const TRACE_MARCHED: u32 = 0x40000000u;
// Not marched: in place of a status, why.
const TRACE_FLAT: u32 = 0x10000000u;
const TRACE_PARALLAX: u32 = 0x20000000u;
const TRACE_ON_MESH: u32 = 0x30000000u;
// Marched over a part of the segment.
const TRACE_RANGE: u32 = 0x80000u;
// Shadow rays are cast: one a light, but for those that were left out.
const TRACE_SHADOWED: u32 = 0x40000u;
const MOST_STEPS: u32 = 0x3ffffu;

// Bit 31 covered, 30 marched, 28-29 status or why not marched, 20-27 shadow rays, 18-19 flags, 0-17 steps; numbers
// saturate.
fn pack_trace(flags: u32, status: u32, shadow_rays: u32, steps: u32) -> u32 {
    return flags | (min(status, 3u) << 28u) | (min(shadow_rays, 255u) << 20u) | min(steps, MOST_STEPS);
}
