// Parameters to branch on. Mesa 22.3 compiles a program anew for each picture when what it branches on are uniforms
// only (lavapipe's inlining of uniforms), which takes longer than most pictures. The length of a buffer is none: the
// least of it and what can never be more is left alone.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "bindings/material.wgsl"

// Whether there is one light and no more.
override single_light: bool = false;

// Lights in the buffer that count.
fn light_count() -> u32 {
    if single_light {
        return 1u;
    }
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

// One of the lights.
fn light_at(i: u32) -> Light {
    if single_light {
        return Light(draw_info().light_place, draw_info().light_color);
    }
    return lights[i];
}
