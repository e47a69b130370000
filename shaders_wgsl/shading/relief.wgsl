// The march of one fragment: from the mesh surface to the hit, its normal and its light.
#import "lib/found.wgsl"
#import "lib/texture_ray.wgsl"
#import "shading/approach.wgsl"
#import "shading/shadow_search.wgsl"
#import "shading/branches.wgsl"
#import "shading/relief_targets.wgsl"
#import "shading/shade.wgsl"
#import "lib/surface_point.wgsl"

// Shadow rays start this much above the hit, in heights: one step of a 16-bit map. What is left of
// rounding in the hit then cannot put them below the surface of the next cell.
const SHADOW_LIFT: f32 = 1.0 / 65536.0;

// The depth that decides what hides what: that of the hit, unless the ray has left the box around the draw by then.
// What lies in boxes that a plane parts is thus sorted as the meshes are (crates/render/src/sorting.rs).
// `t`: of the hit along `direction`, from the mesh surface; `depth`: there.
fn sorting_depth(position: vec3f, direction: vec3f, t: f32, depth: f32) -> f32 {
    let inverse = 1.0 / select(vec3f(1e-30), direction, abs(direction) > vec3f(1e-30));
    let to_low = (draw_info().low.xyz - position) * inverse;
    let to_high = (draw_info().high.xyz - position) * inverse;
    let enters = min(to_low, to_high);
    let leaves = max(to_low, to_high);
    let first = min(max(max(enters.x, enters.y), enters.z), 0.0);
    let last = max(min(min(leaves.x, leaves.y), leaves.z), 0.0);
    return depth * (1.0 + clamp(t, first, last)) / max(1.0 + t, 1e-30);
}

// `position`: of the mesh surface, object space; `point.uv`: there.
fn shade_relief(position: vec3f, point: SurfacePoint) -> ReliefTargets {
    let direction = position - draw_info().eye.xyz;
    let ray = texture_ray(
        point.surface, direction, point.uv, material.scale, material.base, tile_period());
    let need = approach(ray, direction, slack(ray.cos_theta));
    var found = found_left(0u);
    if need.spared {
        let tau = clamp((ray.start.z - need.z) / max(-ray.delta.z, 1e-30), 0.0, 1.0);
        found = found_hit(tau, 1u);
    } else {
        found = search(ray.start, ray.delta, ray.cos_theta, need.stretch);
    }

    var hit = ray.start + ray.delta * found.tau;
    if need.spared {
        // On the surface that is there; its distance is where the ray has that height.
        hit.z = height_at(hit.xy);
        found.tau = clamp((ray.start.z - hit.z) / max(-ray.delta.z, 1e-30), 0.0, 1.0);
    }
    let hit_position = position + direction * (ray.t_start + found.tau * ray.t_length);
    var at_hit = point;
    at_hit.uv = hit.xy;
    at_hit.height = hit.z;
    let normal = world_normal(shading_normal(at_hit));
    let albedo = albedo_at(hit.xy, point.uv_dx, point.uv_dy);
    let relative = relative_position(hit_position);
    let light = lit(albedo.rgb, relative, normal, ShadowPoint(point.surface, hit + vec3f(0.0, 0.0, SHADOW_LIFT), hit_position));

    let depth = dot(relative, frame.forward.xyz);
    var out: ReliefTargets;
    out.color = displayable(light.color);
    out.trace = pack_trace(TRACE_COVERED | need.trace | light.trace, found.status, light.shadow_rays, found.steps);
    out.place = vec4f(hit.xy + ray.tile, depth, hit.z);
    out.position = vec4f(relative, light.blocked);
    out.normal = vec4f(normal, ray.cos_theta);
    out.ray_start = vec4f(ray.start, ray.tile.x);
    out.ray_delta = vec4f(ray.delta, ray.tile.y);
    out.depth = target_depth(sorting_depth(position, direction, ray.t_start + found.tau * ray.t_length, depth));
    return out;
}
