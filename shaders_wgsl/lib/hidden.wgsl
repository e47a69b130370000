// What a `shading/shadow_*.wgsl` says of one light.

struct Hidden {
    share: f32,    // of the light that the relief hides
    rays: u32,     // rays that were followed to find out
}
