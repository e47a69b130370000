// Highlights of a surface seen from so far that a pixel holds many of its slopes: as wide as those spread them along
// each of its axes, and as much weaker. Source: Olano and Baker, "LEAN Mapping", I3D 2010; Toksvig, "Mipmapping Normal
// Maps", Journal of Graphics Tools 10(3), 2005, where the spread is the same all around.

// Whether highlights widen.
override specular_aa: bool = true;

// By what the normal leans at one standard deviation of the slopes within the pixel, along u and along v: in the space of
// the surface frame, as parts of a normal of length 1. A surface/*.wgsl sets them.
var<private> lean_u: vec3f;
var<private> lean_v: vec3f;
// Steeper is all the same, and squares stay finite.
const STEEPEST_LEAN: f32 = 1e3;

// A lobe around a normal. A Blinn-Phong lobe of exponent n is close to a Gaussian of slopes with variance 1 / n; spread by
// the slopes in the pixel it keeps its light. Without spread it is the Blinn-Phong lobe to the last term.
struct Gloss {
    share: f32,        // at its peak
    shininess: f32,
    lean_u: vec3f,     // in the space of the lights
    lean_v: vec3f,
    metric: vec3f,     // inverse of 1 + shininess lean^T lean: uu, uv, vv
}

fn steepest(lean: vec3f) -> vec3f {
    return lean * min(1.0, STEEPEST_LEAN / max(length(lean), 1e-30));
}

// The lobe, given both leans in the space of the lights and at right angles to the normal.
fn spread_gloss(specular: f32, shininess: f32, along_u: vec3f, along_v: vec3f) -> Gloss {
    let uu = 1.0 + shininess * dot(along_u, along_u);
    let vv = 1.0 + shininess * dot(along_v, along_v);
    let uv = shininess * dot(along_u, along_v);
    // Of a matrix that is 1 and something positive.
    let determinant = max(uu * vv - uv * uv, 1.0);
    let metric = vec3f(vv, -uv, uu) / determinant;
    return Gloss(specular / sqrt(determinant), shininess, along_u, along_v, metric);
}

// How bright the highlight is for a light, 0..1; `halfway`: unit, between light and eye.
fn highlight(gloss: Gloss, normal: vec3f, halfway: vec3f) -> f32 {
    let cosine = max(dot(normal, halfway), 1e-6);
    let part = vec2f(dot(gloss.lean_u, halfway), dot(gloss.lean_v, halfway));
    let gained = gloss.metric.x * part.x * part.x + 2.0 * gloss.metric.y * part.x * part.y
        + gloss.metric.z * part.y * part.y;
    // cosine^2 / (1 - shininess gained): what spread leaves of the squared slope from the normal to halfway.
    let left = max(1.0 - gloss.shininess * gained, cosine * cosine);
    return gloss.share * pow(cosine * cosine / left, 0.5 * gloss.shininess);
}
