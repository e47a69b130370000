// What a mesh has at a point inside one of its triangles.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "bindings/solids.wgsl"
#import "lib/footprint.wgsl"
#import "lib/surface_point.wgsl"

// weights: of the triangle's second and third corner.
fn gathered(face: u32, weights: vec2f) -> SurfacePoint {
    let a = corner_of(face, 0u);
    let b = corner_of(face, 1u);
    let c = corner_of(face, 2u);
    let w = vec3f(1.0 - weights.x - weights.y, weights);
    var point: SurfacePoint;
    point.surface.normal = w.x * a.up.xyz + w.y * b.up.xyz + w.z * c.up.xyz;
    let dpdu = w.x * a.dpdu + w.y * b.dpdu + w.z * c.dpdu;
    let dpdv = w.x * a.dpdv + w.y * b.dpdv + w.z * c.dpdv;
    let dndu = w.x * a.dndu + w.y * b.dndu + w.z * c.dndu;
    let dndv = w.x * a.dndv + w.y * b.dndv + w.z * c.dndv;
    point.surface.dpdu = dpdu.xyz;
    point.surface.dpdv = dpdv.xyz;
    point.dndu = dndu.xyz;
    point.dndv = dndv.xyz;
    point.tangent = vec4f(dpdu.w, dpdv.w, dndu.w, dndv.w);
    point.uv = w.x * vec2f(a.place.w, a.up.w) + w.y * vec2f(b.place.w, b.up.w) + w.z * vec2f(c.place.w, c.up.w);
    return point;
}

// The derivatives of the uv along the screen, were the point on the mesh. position: object space.
fn with_footprint(point: SurfacePoint, position: vec3f) -> SurfacePoint {
    let depth = dot((draw_info().relative_from_object * vec4f(position, 1.0)).xyz, frame.forward.xyz);
    let right = depth * (draw_info().object_from_relative * vec4f(frame.pixel_right.xyz, 0.0)).xyz;
    let down = depth * (draw_info().object_from_relative * vec4f(frame.pixel_down.xyz, 0.0)).xyz;
    let away = position - draw_info().eye.xyz;
    var seen = point;
    seen.uv_dx = footprint(point.surface, away, right);
    seen.uv_dy = footprint(point.surface, away, down);
    return seen;
}
