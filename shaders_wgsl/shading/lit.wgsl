// All lights on one point. Needs a `shading/shadow_*.wgsl`.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "bindings/material.wgsl"
#import "lib/blinn_phong.wgsl"
#import "lib/gloss.wgsl"
#import "lib/normalize.wgsl"
#import "shading/branches.wgsl"

struct Lit {
    color: vec3f,          // linear
    shadow_rays: u32,      // rays sent to lights
    blocked: f32,          // share of the lights facing the point that the relief hides
}

// `position`: camera-relative world; `normal`: unit, world.
fn lit(albedo: vec3f, position: vec3f, normal: vec3f, point: ShadowPoint) -> Lit {
    let to_eye = normalize_or(-position, normal);
    var result: Lit;
    result.color = albedo * frame.ambient.rgb;
    let gloss = spread_gloss(material.specular, material.shininess);
    var facing = 0u;
    var blocked = 0.0;
    let count = light_count();
    for (var i = 0u; i < count; i++) {
        let light = lights[i];
        let distant = light.place.w == 0.0;
        let offset = light.place.xyz - light.place.w * position;
        let to_light = normalize_or(offset, normal);
        if dot(normal, to_light) <= 0.0 {
            continue;
        }
        facing += 1u;
        var share_hidden = 0.0;
        if tests_shadows() {
            let offset_object = (draw.object_from_relative * vec4f(offset, 0.0)).xyz;
            result.shadow_rays += SHADOW_RAYS;
            share_hidden = hidden(point, offset_object, distant);
            blocked += share_hidden;
            if share_hidden >= 1.0 {
                continue;
            }
        }
        let falloff = select(1.0 / max(dot(offset, offset), 1e-12), 1.0, distant);
        result.color += (1.0 - share_hidden) * blinn_phong(
            normal, to_light, to_eye, albedo, light.color.rgb * falloff,
            gloss.x, gloss.y);
    }
    result.blocked = blocked / f32(max(facing, 1u));
    return result;
}
