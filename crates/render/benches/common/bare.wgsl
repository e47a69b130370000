// One directional light on a coloured mesh: all that a picture without relief needs.

struct Draw {
    clip_from_object: mat4x4f,
    object: mat4x4f,         // to camera-relative world axes; rigid
    to_light: vec4f,
    light: vec4f,
    ambient: vec4f,
    albedo: vec4f,
    specular: f32,
    shininess: f32,
}

@group(0) @binding(0) var<uniform> draw: Draw;

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
}

@vertex
fn vertex(@location(0) position: vec3f, @location(1) normal: vec3f) -> Varyings {
    let place = vec4f(position, 1.0);
    return Varyings(draw.clip_from_object * place, (draw.object * place).xyz, (draw.object * vec4f(normal, 0.0)).xyz);
}

@fragment
fn fragment(in: Varyings) -> @location(0) vec4f {
    let normal = normalize(in.normal);
    let facing = max(dot(normal, draw.to_light.xyz), 0.0);
    let halfway = normalize(draw.to_light.xyz + normalize(-in.position));
    let gloss = pow(max(dot(normal, halfway), 1e-6), draw.shininess);
    let lit = draw.albedo.rgb * facing + vec3f(select(0.0, draw.specular * gloss, facing > 0.0));
    return vec4f(clamp(draw.albedo.rgb * draw.ambient.rgb + draw.light.rgb * lit, vec3f(0.0), vec3f(1.0)), 1.0);
}
