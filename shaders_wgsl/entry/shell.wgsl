// Relief and meshes without any, traced through the shell around the mesh, outline, depth and shadows included: search/exact,
// surface/displaced, surface/tangent. Drawn for the far sides of a box around the shell, so that the camera may
// stand inside.
#import "shading/gather.wgsl"
#import "shading/relief_targets.wgsl"
#import "shading/shade.wgsl"
#import "shading/shadow_shell.wgsl"

struct Varyings {
    @builtin(position) clip: vec4f,
}

@vertex
fn vertex(@location(0) position: vec3f) -> Varyings {
    return Varyings(frame.clip_from_relative * vec4f(relative_position(position), 1.0));
}

@fragment
fn fragment(in: Varyings) -> ReliefTargets {
    // 1 along the view axis.
    let away = frame.corner.xyz + in.clip.x * frame.pixel_right.xyz + in.clip.y * frame.pixel_down.xyz;
    let direction = (draw_info().object_from_relative * vec4f(away, 0.0)).xyz;
    let stretch = length(direction);
    enter_solid(draw_info().own.y);
    let hit = trace_solid(shell_ray(draw_info().eye.xyz, direction, frame.forward.w * stretch), 1e30);
    if !hit.found {
        discard;
    }
    let depth = hit.t / stretch;
    let relative = away * depth;
    let position = draw_info().eye.xyz + direction * depth;
    var point = facing(gathered(hit.face, hit.weights), !hit.inside);
    point = with_footprint(point, position);
    // The chord's place is off by its sag; that of the weights lies on the surface itself.
    point.height = surface_height(point.uv);
    let normal = world_normal(shading_normal(point));
    let albedo = albedo_at(point.uv, point.uv_dx, point.uv_dy);
    let place = vec3f(point.uv, point.height);
    var on_surface: vec3f;
    if hit.strip == PRISM {
        on_surface = displaced_position(hit.face, hit.weights, point.height);
    } else {
        on_surface = on_flat(hit, position);
    }
    let start = ShellStart(hit.face, hit.strip, hit.weights, point.height);
    let light = lit(albedo.rgb, relative, normal, ShadowPoint(point.surface, place, on_surface, start));

    var out: ReliefTargets;
    out.color = displayable(light.color);
    out.trace = pack_trace(TRACE_COVERED | TRACE_MARCHED | light.trace, hit.status, light.shadow_rays, hit.steps);
    out.place = vec4f(point.uv, depth, point.height);
    out.position = vec4f(relative, light.blocked);
    out.normal = vec4f(normal, 0.0);
    out.depth = target_depth(depth);
    return out;
}
