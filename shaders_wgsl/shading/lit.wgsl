// All lights on one point. Needs a `shading/shadow_*.wgsl`.
#import "bindings/draw.wgsl"
#import "bindings/frame.wgsl"
#import "bindings/material.wgsl"
#import "lib/blinn_phong.wgsl"
#import "lib/gloss.wgsl"
#import "lib/hidden.wgsl"
#import "lib/normalize.wgsl"
#import "lib/targets.wgsl"
#import "shading/branches.wgsl"

// Whether lights that cannot be seen on the point, hidden or not, cast no rays.
override skip_shadow: bool = false;
// Nor lights that change the picture by less than one of its 8 bits; not where the shadow itself is asked for.
override skip_faint: bool = false;
// The darkest step of 8-bit sRGB, linear: elsewhere they are larger.
const LEAST_STEP: f32 = 1.0 / (255.0 * 12.92);

struct Lit {
    color: vec3f,          // linear
    shadow_rays: u32,      // rays sent to lights
    blocked: f32,          // share of the lights facing the point that the relief hides
    trace: u32,            // what to note of it
}

// The lobe around a world normal: what leans in the mesh's space leans like normals do, by the inverse transpose.
fn lit_gloss(normal: vec3f) -> Gloss {
    if !specular_aa {
        return spread_gloss(material.specular, material.shininess, vec3f(0.0), vec3f(0.0));
    }
    let unit = length((vec4f(normal, 0.0) * draw_info().relative_from_object).xyz);
    let u = (vec4f(lean_u, 0.0) * draw_info().object_from_relative).xyz * unit;
    let v = (vec4f(lean_v, 0.0) * draw_info().object_from_relative).xyz * unit;
    return spread_gloss(
        material.specular, material.shininess,
        steepest(u - normal * dot(normal, u)), steepest(v - normal * dot(normal, v)));
}

// `position`: camera-relative world; `normal`: unit, world.
fn lit(albedo: vec3f, position: vec3f, normal: vec3f, point: ShadowPoint) -> Lit {
    let to_eye = normalize_or(-position, normal);
    var result: Lit;
    result.color = albedo * frame.ambient.rgb;
    let gloss = lit_gloss(normal);
    result.trace = select(0u, TRACE_SHADOWED, tests_shadows() && SHADOW_RAYS > 0u);
    let brightest = max(albedo.r, max(albedo.g, albedo.b));
    var facing = 0u;
    var blocked = 0.0;
    let count = light_count();
    let unseen = LEAST_STEP / f32(max(count, 1u));
    for (var i = 0u; i < count; i++) {
        let light = light_at(i);
        let distant = light.place.w == 0.0;
        let offset = light.place.xyz - light.place.w * position;
        let to_light = normalize_or(offset, normal);
        let cosine = dot(normal, to_light);
        let faces = cosine > 0.0;
        if !faces && (skip_shadow || !tests_shadows()) {
            continue;
        }
        let radiance = light.color.rgb * select(1.0 / max(dot(offset, offset), 1e-12), 1.0, distant);
        var share_hidden = 0.0;
        var faint = false;
        if skip_faint {
            let most = max(radiance.r, max(radiance.g, radiance.b)) * (brightest * cosine + gloss.share);
            faint = most <= unseen || min(result.color.r, min(result.color.g, result.color.b)) >= 1.0;
        }
        if tests_shadows() && !faint {
            let offset_object = (draw_info().object_from_relative * vec4f(offset, 0.0)).xyz;
            let shadow = hidden(point, offset_object, distant);
            result.shadow_rays += shadow.rays;
            share_hidden = shadow.share;
        }
        if !faces {
            continue;
        }
        facing += 1u;
        blocked += share_hidden;
        if share_hidden >= 1.0 {
            continue;
        }
        result.color += (1.0 - share_hidden) * blinn_phong(
            normal, to_light, to_eye, albedo, radiance, gloss);
    }
    result.blocked = blocked / f32(max(facing, 1u));
    return result;
}
