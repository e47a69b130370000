// A mesh with nothing but its normals: surface/flat.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "lib/normalize.wgsl"
#import "lib/surface_point.wgsl"
#import "lib/targets.wgsl"
#import "shading/shade.wgsl"
#import "shading/shadow_none.wgsl"

struct VertexIn {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
}

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
}

@vertex
fn vertex(in: VertexIn) -> Varyings {
    var out: Varyings;
    out.clip = frame.clip_from_relative * vec4f(relative_position(in.position), 1.0);
    out.position = in.position;
    out.normal = in.normal;
    out.uv = in.uv;
    return out;
}

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> Targets {
    // Seen from behind, a two-sided surface has its relief on that side.
    let side = select(-1.0, 1.0, front);
    var point: SurfacePoint;
    point.surface = SurfaceFrame(vec3f(0.0), vec3f(0.0), side * normalize_or(in.normal, vec3f(0.0, 0.0, 1.0)));
    point.tangent = vec4f(0.0);
    point.uv = in.uv;
    point.uv_dx = dpdx(in.uv);
    point.uv_dy = dpdy(in.uv);
    let albedo = albedo_at(in.uv, point.uv_dx, point.uv_dy);
    return targets(shade_mesh(in.position, shading_normal(point), in.uv, albedo));
}
