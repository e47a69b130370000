// Micro-polygons of a displaced mesh: surface/displaced, surface/tangent.
#import "lib/surface_height.wgsl"
#import "shading/gather.wgsl"
#import "shading/shade.wgsl"
#import "shading/shadow_shell.wgsl"

// In the number of a triangle: that what is drawn is a strip along one of its edges.
const ON_STRIP: u32 = 0x80000000u;

struct VertexIn {
    @location(0) position: vec3f,
    @location(8) face: u32,
    @location(9) weights: vec2f,
}

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(8) @interpolate(flat, first) face: u32,
    @location(9) weights: vec2f,
}

@vertex
fn vertex(in: VertexIn) -> Varyings {
    let clip = frame.clip_from_relative * vec4f(relative_position(in.position), 1.0);
    return Varyings(clip, in.position, in.face, in.weights);
}

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> Targets {
    enter_solid(draw_info().own.y);
    let face = in.face & ~ON_STRIP;
    var point = facing(gathered(face, in.weights), front);
    point = with_footprint(point, in.position);
    point.height = surface_height(point.uv);
    let albedo = albedo_at(point.uv, point.uv_dx, point.uv_dy);
    var start = ShellStart(face, select(PRISM, PLAIN, material.scale == 0.0), in.weights, point.height);
    var on_surface = displaced_position(face, in.weights, point.height);
    if face != in.face {
        start.strip = ANY_STRIP;
        on_surface = in.position;
    }
    let shadow = ShadowPoint(point.surface, vec3f(point.uv, point.height), on_surface, start);
    var shaded = shade_mesh(in.position, shading_normal(point), point.uv, albedo, shadow);
    shaded.place.w = point.height;
    return targets(shaded);
}
