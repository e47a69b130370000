// The light of one fragment whose surface stays on the mesh: a `surface/*.wgsl` gives the normal.
#import "lib/surface_point.wgsl"
#import "lib/targets.wgsl"
#import "shading/shade.wgsl"
#import "shading/shadow_none.wgsl"

// `position`: of the mesh surface, object space; `point.uv`: there.
fn shade_on_mesh(position: vec3f, point: SurfacePoint) -> Targets {
    let albedo = albedo_at(point.uv, point.uv_dx, point.uv_dy);
    let shadow = shadow_point_on_mesh(point);
    return targets(shade_mesh(position, shading_normal(point), point.uv, albedo, shadow));
}
