// Fixed-function bump mapping: surface/dot3. Diffuse, one light.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "lib/normalize.wgsl"
#import "lib/perturb.wgsl"
#import "lib/targets.wgsl"
#import "shading/shade.wgsl"
#import "shading/shadow_none.wgsl"

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
    @location(3) tangent: vec4f,
    @location(4) light_ts: vec3f,
}

@vertex
fn vertex(in: VertexIn) -> Varyings {
    var out: Varyings;
    out.clip = frame.clip_from_relative * vec4f(relative_position(in.position), 1.0);
    out.position = in.position;
    out.normal = in.normal;
    out.uv = in.uv;
    out.tangent = in.tangent;
    // The light vector is found here and interpolated as it is, as fixed-function hardware did.
    out.light_ts = vec3f(0.0, 0.0, 1.0);
    if light_count() > 0u {
        let light = light_at(0u);
        let offset = light.place.xyz - light.place.w * relative_position(in.position);
        let offset_object = normalize_or((draw_info().object_from_relative * vec4f(offset, 0.0)).xyz, in.normal);
        let bitangent = in.tangent.w * cross(in.normal, in.tangent.xyz);
        out.light_ts = vec3f(
            dot(offset_object, in.tangent.xyz), dot(offset_object, bitangent), dot(offset_object, in.normal));
    }
    return out;
}

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> Targets {
    let side = select(-1.0, 1.0, front);
    let uv_dx = dpdx(in.uv);
    let uv_dy = dpdy(in.uv);
    let stored = stored_normal(in.uv, uv_dx, uv_dy);
    let diffuse = dot3_diffuse(stored, vec3f(in.light_ts.xy, in.light_ts.z * side));
    let albedo = albedo_at(in.uv, uv_dx, uv_dy).rgb;
    let relative = relative_position(in.position);

    var color = albedo * frame.ambient.rgb;
    if light_count() > 0u {
        // Attenuation was a texture of its own; it is exact here.
        let light = light_at(0u);
        let offset = light.place.xyz - light.place.w * relative;
        let falloff = select(1.0 / max(dot(offset, offset), 1e-12), 1.0, light.place.w == 0.0);
        color += albedo * light.color.rgb * (diffuse * falloff);
    }
    let up = side * normalize_or(in.normal, vec3f(0.0, 0.0, 1.0));
    let normal = perturb_by_map(up, in.tangent, stored * 2.0 - 1.0);
    var shaded: Shaded;
    shaded.color = displayable(color);
    shaded.trace = pack_trace(TRACE_COVERED, 0u, 0u, 0u);
    shaded.place = vec4f(in.uv, dot(relative, frame.forward.xyz), material.base);
    shaded.position = vec4f(relative, 0.0);
    shaded.normal = vec4f(world_normal(normal), 0.0);
    return targets(shaded);
}
