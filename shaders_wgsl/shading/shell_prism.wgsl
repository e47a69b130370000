// Rays through one prism of a shell, along the curve that a straight ray is in texture space. Ogaki, "Nonlinear
// Ray Tracing for Displacement and Shell Mapping", SIGGRAPH Asia 2023.
//
// The curve is followed by chords that stay within SAG of it; each is searched exactly. On flat triangles with
// one normal it is one chord, and nothing is approximated.
#import "bindings/material.wgsl"
#import "bindings/shell.wgsl"
#import "bindings/triangles.wgsl"
#import "lib/emerge.wgsl"
#import "lib/prism.wgsl"
#import "search/exact.wgsl"
#import "shading/branches.wgsl"

// How far a chord may be from the curve, in texels and in heights.
const SAG: vec2f = vec2f(0.02, 5e-4);
const MAX_CHORDS: f32 = 48.0;
// Deeper than this below the surface, a ray has not met it by rounding: it is on the other side.
const ROUNDED_BELOW: f32 = 2e-3;

// Whether surfaces seen from inside are seen.
override sees_inside: bool = false;

struct ShellHit {
    found: bool,
    inside: bool,          // whether the surface was met from inside
    status: u32,           // 0 hit, 1 left, 2 unconverged
    steps: u32,
    t: f32,
    face: u32,
    weights: vec2f,        // of the second and third corner
}

struct ShellRay {
    origin: vec3f,
    across: mat3x3f,       // to the ray's own axes: the third runs along it
    first: f32,            // where it begins
    for_shadow: bool,      // starts on the surface; anything hit will do
}

fn shell_ray(origin: vec3f, direction: vec3f, first: f32, for_shadow: bool) -> ShellRay {
    let z = normalize_or(direction, vec3f(0.0, 0.0, 1.0));
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(z.x) > 0.7);
    let x = normalize_or(cross(other, z), vec3f(1.0, 0.0, 0.0));
    return ShellRay(origin, transpose(mat3x3f(x, cross(z, x), z)), first, for_shadow);
}

// Texture space coordinates of a point of a prism.
fn in_texture(point: PrismPoint, uvs: mat3x2f, prism: Prism) -> vec3f {
    let w = vec3f(1.0 - point.weights.x - point.weights.y, point.weights);
    let normal = w.x * prism.n0 + w.y * prism.n1 + w.z * prism.n2;
    return vec3f(uvs * w, material.base + point.rise * length(normal) / material.scale);
}

// Follows a ray through one prism, nearer than `best`.
fn through_prism(ray: ShellRay, shell_prism: ShellPrism, best: ShellHit) -> ShellHit {
    let at = 3u * shell_prism.face;
    let a = vertices[triangles[at]];
    let b = vertices[triangles[at + 1u]];
    let c = vertices[triangles[at + 2u]];
    var prism: Prism;
    prism.p0 = ray.across * (a.place.xyz - ray.origin);
    prism.p1 = ray.across * (b.place.xyz - ray.origin);
    prism.p2 = ray.across * (c.place.xyz - ray.origin);
    prism.n0 = ray.across * a.up.xyz;
    prism.n1 = ray.across * b.up.xyz;
    prism.n2 = ray.across * c.up.xyz;
    var span = prism_span(prism, shell_prism.low, shell_prism.high);
    var result = best;
    if !(span.leave.t > max(span.enter.t, ray.first)) || span.enter.t >= best.t {
        return result;
    }
    let at_start = span.enter.t < ray.first;
    if at_start {
        let share = (ray.first - span.enter.t) / (span.leave.t - span.enter.t);
        span.enter = prism_point(prism, ray.first, mix_points(span.enter, span.leave, share));
    }
    let uvs = mat3x2f(vec2f(a.place.w, a.up.w), vec2f(b.place.w, b.up.w), vec2f(c.place.w, c.up.w));
    let size = vec2f(material.map_width, material.map_height);
    let enter = in_texture(span.enter, uvs, prism);
    let leave = in_texture(span.leave, uvs, prism);
    let halfway = prism_point(prism, mix(span.enter.t, span.leave.t, 0.5), mix_points(span.enter, span.leave, 0.5));
    let off = in_texture(halfway, uvs, prism) - 0.5 * (enter + leave);
    let sag = max(length(off.xy * size) / SAG.x, abs(off.z) / SAG.y);
    let chords = clamp(ceil(sqrt(min(sag, 1e6))), 1.0, MAX_CHORDS);

    var here = span.enter;
    var start = enter;
    var inside = false;
    var from_inside = false;
    for (var chord = 0.0; chord < chords; chord += 1.0) {
        var there = span.leave;
        var end = leave;
        if chord + 1.0 < chords {
            let share = (chord + 1.0) / chords;
            there = prism_point(prism, mix(span.enter.t, span.leave.t, share), mix_points(span.enter, span.leave, share));
            end = in_texture(there, uvs, prism);
        }
        // No branch on what is the same for the whole draw: Mesa 22.3 takes such branches out of loops, and fails.
        let period = tile_period();
        let tile = floor(start.xy / select(1.0, period, period > 0.0)) * period;
        let home = start - vec3f(tile, 0.0);
        let delta = end - start;
        var found: Found;
        var skipped = 0.0;
        if chord == 0.0 {
            inside = gap_above(home) < -ROUNDED_BELOW;
        }
        if inside {
            skipped = emerges(home, delta);
            inside = skipped > 1.0;
        }
        if skipped > 1.0 {
            found = found_left(1u);
        } else if skipped > 0.0 && (sees_inside || ray.for_shadow) {
            found = found_hit(0.0, 1u);
            from_inside = true;
        } else if skipped > 0.0 || ray.for_shadow {
            found = search_away_within(home + delta * skipped, delta * (1.0 - skipped));
        } else {
            found = search_within(home, delta);
        }
        result.steps += found.steps;
        let tau = skipped + (1.0 - skipped) * found.tau;
        let t = mix(here.t, there.t, tau);
        if found.status == 2u {
            result.status = 2u;
        }
        if found.status == 0u && t < best.t {
            let point = prism_point(prism, t, mix_points(here, there, tau));
            result.found = true;
            result.inside = from_inside;
            result.status = 0u;
            result.t = t;
            result.face = shell_prism.face;
            result.weights = point.weights;
            return result;
        }
        here = there;
        start = end;
        from_inside = false;
        if here.t >= best.t {
            break;
        }
    }
    return result;
}
