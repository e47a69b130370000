// What a pixel covers of the texture, without derivatives along the screen: rays know nothing of their
// neighbours. Igehy, "Tracing Ray Differentials", SIGGRAPH 1999.
#import "lib/surface_frame.wgsl"

// Views flatter than this, as sine of their elevation, cover no more.
const FLATTEST_FOOTPRINT: f32 = 0.02;

// How far the uv moves from one pixel to the next. away: from the eye to the point; step: how far the next
// pixel's ray is from this one's there. Both object space.
fn footprint(surface: SurfaceFrame, away: vec3f, step: vec3f) -> vec2f {
    let least = FLATTEST_FOOTPRINT * length(away);
    let sink = dot(surface.normal, away);
    let held = select(min(sink, -least), max(sink, least), sink > 0.0);
    let on_surface = step - away * (dot(surface.normal, step) / select(held, 1.0, held == 0.0));
    return frame_coordinates(surface, on_surface).xy;
}
