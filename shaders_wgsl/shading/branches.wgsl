// Parameters to branch on. Mesa 22.3 compiles a program anew for each picture when what it branches on are uniforms
// only (lavapipe's inlining of uniforms), which takes longer than most pictures. The length of a buffer is none: the
// least of it and what can never be more is left alone.
#import "bindings/frame.wgsl"
#import "bindings/material.wgsl"

// Lights in the buffer that count.
fn light_count() -> u32 {
    return min(frame.light_count, arrayLength(&lights));
}

// Tiles after which the map repeats, 0 for never: at most 2, and the buffer has room for a light.
fn tile_period() -> f32 {
    return min(material.period, 2.0 * f32(arrayLength(&lights)));
}

// WRAP_* of lib/slope_wrap.wgsl: at most 2.
fn wrap_mode() -> u32 {
    return min(material.wrap, 2u * arrayLength(&lights));
}
