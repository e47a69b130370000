// What every surface gets to see.
#import "lib/surface_frame.wgsl"

struct SurfacePoint {
    surface: SurfaceFrame,
    tangent: vec4f,        // glTF tangent, interpolated; 0 where the entry has none
    uv: vec2f,             // where to look, displaced or not
    uv_dx: vec2f,          // derivatives of the undisplaced uv along the screen: those of displaced
    uv_dy: vec2f,          // ones jump at every edge of the relief
}
