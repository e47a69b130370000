// A searched relief with a tangent-space normal map of its own: search/*, surface/tangent.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "lib/surface_point.wgsl"
#import "shading/relief.wgsl"

struct VertexIn {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) dpdu: vec3f,
    @location(4) dpdv: vec3f,
    @location(5) tangent: vec4f,
}

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) dpdu: vec3f,
    @location(4) dpdv: vec3f,
    @location(5) tangent: vec4f,
}

@vertex
fn vertex(in: VertexIn) -> Varyings {
    var out: Varyings;
    out.clip = frame.clip_from_relative * vec4f(relative_position(in.position), 1.0);
    out.position = in.position;
    out.normal = in.normal;
    out.uv = in.uv;
    out.dpdu = in.dpdu;
    out.dpdv = in.dpdv;
    out.tangent = in.tangent;
    return out;
}

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> ReliefTargets {
    let surface = SurfaceFrame(in.dpdu, in.dpdv, in.normal);
    let point = surface_point(surface, in.tangent, in.uv, dpdx(in.uv), dpdy(in.uv), front);
    return shade_relief(in.position, point);
}
