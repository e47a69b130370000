// Diffuse and specular light of one source.
// Source: Blinn, "Models of Light Reflection for Computer Synthesized Pictures", SIGGRAPH 1977.
#import "lib/gloss.wgsl"
#import "lib/normalize.wgsl"

// Linear light that reaches the eye. All directions unit and pointing away from the surface;
// `radiance`: of the light at the surface.
fn blinn_phong(
    normal: vec3f, to_light: vec3f, to_eye: vec3f, albedo: vec3f, radiance: vec3f, gloss: Gloss,
) -> vec3f {
    let facing = dot(normal, to_light);
    if facing <= 0.0 {
        return vec3f(0.0);
    }
    let halfway = normalize_or(to_light + to_eye, normal);
    return radiance * (albedo * facing + vec3f(highlight(gloss, normal, halfway)));
}
