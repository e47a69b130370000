// The vertex stage of meshes with the axes of the texture mapping and the derivatives of the normal.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "lib/surface_point.wgsl"
#import "shading/shade.wgsl"

struct VertexIn {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) dpdu: vec3f,
    @location(4) dpdv: vec3f,
    @location(6) dndu: vec3f,
    @location(7) dndv: vec3f,
}

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) dpdu: vec3f,
    @location(4) dpdv: vec3f,
    @location(6) dndu: vec3f,
    @location(7) dndv: vec3f,
}

@vertex
fn vertex(in: VertexIn) -> Varyings {
    let clip = frame.clip_from_relative * vec4f(relative_position(in.position), 1.0);
    return Varyings(clip, in.position, in.normal, in.uv, in.dpdu, in.dpdv, in.dndu, in.dndv);
}

// What the fragment gets to see.
fn seen(in: Varyings, front: bool) -> SurfacePoint {
    var point: SurfacePoint;
    point.surface.normal = in.normal;
    point.surface.dpdu = in.dpdu;
    point.surface.dpdv = in.dpdv;
    point.dndu = in.dndu;
    point.dndv = in.dndv;
    point.uv = in.uv;
    point.uv_dx = dpdx(in.uv);
    point.uv_dy = dpdy(in.uv);
    return facing(point, front);
}
