// What every surface gets to see.
#import "lib/normalize.wgsl"
#import "lib/surface_frame.wgsl"

struct SurfacePoint {
    surface: SurfaceFrame,
    dndu: vec3f,           // dN/du and dN/dv, per tile, object space; 0 where the entry has none
    dndv: vec3f,
    tangent: vec4f,        // glTF tangent, interpolated; 0 where the entry has none
    uv: vec2f,             // where to look, displaced or not
    uv_dx: vec2f,          // derivatives of the undisplaced uv along the screen: those of displaced
    uv_dy: vec2f,          // ones jump at every edge of the relief
    position_dx: vec3f,    // derivatives of the mesh surface along the screen, object space; 0 where the
    position_dy: vec3f,    // entry has none
    height: f32,           // where a search ended, 0..1; 0 where none did
}

// A point with its normal made unit. Seen from behind, a two-sided surface has its relief on that side.
fn facing(point: SurfacePoint, front: bool) -> SurfacePoint {
    let side = select(-1.0, 1.0, front);
    var turned = point;
    turned.surface.normal = side * normalize_or(point.surface.normal, vec3f(0.0, 0.0, 1.0));
    turned.dndu = side * point.dndu;
    turned.dndv = side * point.dndv;
    return turned;
}
