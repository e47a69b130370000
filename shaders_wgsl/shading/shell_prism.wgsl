// Rays through one prism of a shell, along the curve that a straight ray is in texture space. Ogaki, "Nonlinear
// Ray Tracing for Displacement and Shell Mapping", SIGGRAPH Asia 2023.
//
// The curve is followed by chords that stay within SAG of it; each is searched exactly. On flat triangles with
// one normal it is one chord, and nothing is approximated.
#import "bindings/solids.wgsl"
#import "lib/emerge.wgsl"
#import "lib/prism.wgsl"
#import "search/exact.wgsl"
#import "shading/shell_ray.wgsl"
#import "shading/shell_sides.wgsl"

// How far a chord may be from the curve, in texels and in heights.
const SAG: vec2f = vec2f(0.02, 5e-4);
const MAX_CHORDS: f32 = 48.0;
// Light rays meet nothing of the sheet they start on on their first so many cells, unless they are below the surface at the end of them. Creases
// between cells are no part of what the texels stand for, and the shading, whose slopes are smooth, knows none.
const CREASE: f32 = 1.0;
// So deep below the surface, in heights, a ray may come from the next triangle of a sheet without having met it there:
// by as much chords are off. Deeper it is on the other side.
const ROUNDED_BELOW: f32 = 2e-3;
// Cells ahead that tell whether a ray goes down to the surface or comes out of it.
const NEXT: f32 = 0.1;

// Texture space coordinates of a point of a prism.
fn in_texture(point: PrismPoint, uvs: mat3x2f, prism: Prism) -> vec3f {
    let w = vec3f(1.0 - point.weights.x - point.weights.y, point.weights);
    let normal = w.x * prism.n0 + w.y * prism.n1 + w.z * prism.n2;
    return vec3f(uvs * w, height_info.base + point.rise * length(normal) / height_info.scale);
}

// Follows a ray through one prism, nearer than `best`.
fn through_prism(ray: ShellRay, shell_prism: ShellPrism, best: ShellHit) -> ShellHit {
    let a = corner_of(shell_prism.face, 0u);
    let b = corner_of(shell_prism.face, 1u);
    let c = corner_of(shell_prism.face, 2u);
    var prism: Prism;
    prism.p0 = ray.across * (a.place.xyz - ray.origin);
    prism.p1 = ray.across * (b.place.xyz - ray.origin);
    prism.p2 = ray.across * (c.place.xyz - ray.origin);
    prism.n0 = ray.across * a.up.xyz;
    prism.n1 = ray.across * b.up.xyz;
    prism.n2 = ray.across * c.up.xyz;
    var span = prism_span(prism, shell_prism.low, shell_prism.high);
    var result = best;
    // Over the triangle on which it starts a light ray is where its start's numbers say.
    let on_relief = ray.starts_here && ray.start.strip == PRISM;
    let own = on_relief && shell_prism.face == ray.start.face;
    let own_sheet = on_relief && sheet_of(shell_prism.face) == sheet_of(ray.start.face);
    if !(span.leave.t > max(span.enter.t, ray.first)) || span.enter.t >= best.t {
        return result;
    }
    // Not through a border of the sheet, where rays come in from outside above and below the surface.
    var from_next = false;
    if own || span.enter.t < ray.first {
        let share = clamp((ray.first - span.enter.t) / (span.leave.t - span.enter.t), 0.0, 1.0);
        span.enter = prism_point(prism, ray.first, mix_points(span.enter, span.leave, share));
    } else if span.through != CAP {
        from_next = goes_on(shell_prism.face, span.through);
    }
    let uvs = mat3x2f(vec2f(a.place.w, a.up.w), vec2f(b.place.w, b.up.w), vec2f(c.place.w, c.up.w));
    let size = height_info.size;
    var enter = in_texture(span.enter, uvs, prism);
    if own {
        let w = ray.start.weights;
        enter = vec3f(uvs * vec3f(1.0 - w.x - w.y, w), ray.start.height);
    }
    let leave = in_texture(span.leave, uvs, prism);
    // Nearer to the surface than this, in heights, it cannot be told on which side of it the ray comes in.
    let slack = min(2.0 * (ray.rounding + SHELL_ROUNDING * abs(span.enter.t)) / height_info.scale, ON_SURFACE);
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
        let periodic = solid.period > 0.0;
        let tile = floor(start.xy / select(1.0, solid.period, periodic)) * solid.period;
        let home = start - vec3f(tile, 0.0);
        let delta = end - start;
        var found: Found;
        var skipped = 0.0;
        var from_surface = false;
        let length_in_cells = max(length(delta.xy * size), 1e-30);
        // Share of the chord that is still next to the start.
        let done = here.t / max(there.t - here.t, 1e-30);
        let beside = select(0.0, CREASE / length_in_cells - done, own_sheet);
        if chord == 0.0 && beside <= 0.0 {
            let gap = gap_above(home);
            inside = gap < -slack;
            from_surface = abs(gap) <= slack;
            if inside && from_next && !ray.for_shadow && gap >= -ROUNDED_BELOW {
                // One that is coming out was below before.
                let on = min(NEXT / length_in_cells, 1.0);
                inside = gap_above(home + delta * on) > gap;
            }
        }
        if beside > 0.0 {
            skipped = min(beside, 1.0);
            inside = gap_above(home + delta * skipped) <= 0.0;
        } else if inside {
            skipped = emerges(home, delta);
            inside = skipped > 1.0;
        }
        if inside && beside > 0.0 && (beside < 1.0 || delta.z <= 0.0) {
            found = found_hit(0.0, 1u);
        } else if inside || skipped == 1.0 {
            found = found_left(1u);
            skipped = 0.0;
        } else if beside > 0.0 {
            found = search_within(home + delta * skipped, delta * (1.0 - skipped));
        } else if skipped > 0.0 && (sees_inside || ray.for_shadow) {
            found = found_hit(0.0, 1u);
            from_inside = true;
        } else if skipped > 0.0 || from_surface {
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
            result.strip = PRISM;
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
