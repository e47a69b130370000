// Group 0: what all draws of a frame share. Positions are relative to the camera, axes those of the
// world. Host: `crates/render/src/uniforms.rs`.

struct FrameInfo {
    clip_from_relative: mat4x4f,
    forward: vec4f,        // unit view axis; w: near plane, world units
    ambient: vec4f,        // rgb, linear light
    corner: vec4f,         // through the picture's upper left corner, world axes; 1 along the view axis
    pixel_right: vec4f,    // how that changes from one pixel to the next
    pixel_down: vec4f,     // and from one row to the next
    light_count: u32,
    pad_0: u32,
    pad_1: u32,
    pad_2: u32,
}

struct Light {
    place: vec4f,          // w = 1: camera-relative position; w = 0: unit direction towards the light
    color: vec4f,          // rgb, linear: irradiance, for a position at distance 1
}

@group(0) @binding(0) var<uniform> frame: FrameInfo;
@group(0) @binding(1) var<storage, read> lights: array<Light>;

// 0, which no compiler knows: there is room for a light at least. Mesa 22.3 crashes over some programs whose branches or
// ends of loops depend on a uniform at a place that it knows (lavapipe's inlining of uniforms). It does so over all that
// march where this group has a second uniform buffer, too: the first light stands in `DrawInfo` instead.
fn nought() -> u32 {
    return min(arrayLength(&lights), 1u) - 1u;
}
