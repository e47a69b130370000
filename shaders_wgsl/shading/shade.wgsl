// From a point with its shading normal to what the targets get.
#import "shading/lit.wgsl"
#import "lib/targets.wgsl"
#import "lib/normalize.wgsl"

// Whether the material has a map of colours: without one nothing is looked up.
override albedo_map: bool = true;

fn albedo_at(uv: vec2f, uv_dx: vec2f, uv_dy: vec2f) -> vec4f {
    if !albedo_map {
        return material.albedo_factor;
    }
    return textureSampleGrad(albedo_texture, albedo_sampler, uv, uv_dx, uv_dy) * material.albedo_factor;
}

// Camera-relative world position of a point in object space.
fn relative_position(position: vec3f) -> vec3f {
    return (draw_info().relative_from_object * vec4f(position, 1.0)).xyz;
}

// World normal of an object-space normal: by the inverse transpose, so that stretched meshes keep theirs.
fn world_normal(normal: vec3f) -> vec3f {
    return normalize_or((vec4f(normal, 0.0) * draw_info().object_from_relative).xyz, vec3f(0.0, 0.0, 1.0));
}

// Linear colour fit for an image: no negative, huge or undefined values.
fn displayable(color: vec3f) -> vec4f {
    return vec4f(clamp(color, vec3f(0.0), vec3f(1.0)), 1.0);
}

// Whether a search was left out because there is no relief at all.
override flat_ground: bool = false;

// A point that lies on the mesh. `position`, `normal`: object space.
fn shade_mesh(position: vec3f, normal: vec3f, uv: vec2f, albedo: vec4f, point: ShadowPoint) -> Shaded {
    let relative = relative_position(position);
    let light = lit(albedo.rgb, relative, world_normal(normal), point);
    var shaded: Shaded;
    shaded.color = displayable(light.color);
    shaded.trace = pack_trace(TRACE_COVERED | select(0u, TRACE_FLAT, flat_ground) | light.trace, 0u, light.shadow_rays, 0u);
    shaded.place = vec4f(uv, dot(relative, frame.forward.xyz), material.base);
    shaded.position = vec4f(relative, light.blocked);
    shaded.normal = vec4f(world_normal(normal), 0.0);
    return shaded;
}
