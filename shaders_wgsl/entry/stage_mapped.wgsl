// The vertex stage of meshes with tangents.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "lib/surface_point.wgsl"
#import "shading/shade.wgsl"

struct VertexIn {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(5) tangent: vec4f,
}

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(5) tangent: vec4f,
}

@vertex
fn vertex(in: VertexIn) -> Varyings {
    let clip = frame.clip_from_relative * vec4f(relative_position(in.position), 1.0);
    return Varyings(clip, in.position, in.normal, in.uv, in.tangent);
}

// What the fragment gets to see.
fn seen(in: Varyings, front: bool) -> SurfacePoint {
    var point: SurfacePoint;
    point.surface.normal = in.normal;
    point.tangent = in.tangent;
    point.uv = in.uv;
    point.uv_dx = dpdx(in.uv);
    point.uv_dy = dpdy(in.uv);
    return facing(point, front);
}
