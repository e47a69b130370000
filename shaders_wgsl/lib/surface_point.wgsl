// What every surface gets to see.
#import "lib/normalize.wgsl"
#import "lib/surface_frame.wgsl"

struct SurfacePoint {
    surface: SurfaceFrame,
    tangent: vec4f,        // glTF tangent, interpolated; 0 where the entry has none
    uv: vec2f,             // where to look, displaced or not
    uv_dx: vec2f,          // derivatives of the undisplaced uv along the screen: those of displaced
    uv_dy: vec2f,          // ones jump at every edge of the relief
}

// The point of a fragment from its interpolated attributes. Seen from behind, a two-sided surface has
// its relief on that side.
fn surface_point(
    surface: SurfaceFrame, tangent: vec4f, uv: vec2f, uv_dx: vec2f, uv_dy: vec2f, front: bool,
) -> SurfacePoint {
    let up = select(-1.0, 1.0, front) * normalize_or(surface.normal, vec3f(0.0, 0.0, 1.0));
    return SurfacePoint(SurfaceFrame(surface.dpdu, surface.dpdv, up), tangent, uv, uv_dx, uv_dy);
}
