// Rays through one prism of a shell, along the curve that a straight ray is in texture space. Ogaki, "Nonlinear
// Ray Tracing for Displacement and Shell Mapping", SIGGRAPH Asia 2023.
//
// The curve is followed by chords that stay within SAG of it; each is searched exactly. On flat triangles with
// one normal it is one chord, and nothing is approximated.
#import "lib/emerge.wgsl"
#import "search/exact.wgsl"
#import "shading/shell_prism.wgsl"
#import "shading/shell_sides.wgsl"

// How far a chord may be from the curve, in texels and in heights.
const SAG: vec2f = vec2f(0.02, 5e-4);
const MAX_CHORDS: f32 = 48.0;
// Light rays meet nothing of the sheet they start on on their first so many cells, unless they are below the surface at
// the end of them. Creases between cells are no part of what the texels stand for, and the shading, whose slopes are
// smooth, knows none.
const CREASE: f32 = 1.0;
// So deep below the surface, in heights, a ray may come from the next triangle of a sheet without having met it there:
// by as much chords are off. Deeper it is on the other side.
const ROUNDED_BELOW: f32 = 2e-3;
// Cells ahead that tell whether a ray goes down to the surface or comes out of it.
const NEXT: f32 = 0.1;

// Follows a ray through the prism it crosses, nearer than `best`. There is one search, whatever its ray begins as: lanes
// in lock step pay for each that the program holds.
fn search_prism(ray: ShellRay, crossing: Crossing, best: ShellHit) -> ShellHit {
    let prism = crossing.prism;
    let uvs = crossing.uvs;
    var span = crossing.span;
    var result = best;
    if crossing.own || span.enter.t < ray.first {
        let share = clamp((ray.first - span.enter.t) / (span.leave.t - span.enter.t), 0.0, 1.0);
        span.enter = prism_point(prism, ray.first, mix_points(span.enter, span.leave, share));
    }
    let size = height_info.size;
    var enter = in_texture(span.enter, uvs, prism);
    if crossing.own {
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
        let length_in_cells = max(length(delta.xy * size), 1e-30);
        // Share of the chord that is still next to the start.
        let done = here.t / max(there.t - here.t, 1e-30);
        let beside = select(0.0, min(CREASE / length_in_cells - done, 1.0), crossing.own_sheet);
        var skipped = max(beside, 0.0);
        var leaves = false;
        if chord == 0.0 || skipped > 0.0 {
            let gap = gap_above(home + delta * skipped);
            if skipped > 0.0 {
                inside = gap <= 0.0;
            } else {
                inside = gap < -slack;
                leaves = abs(gap) <= slack;
                if inside && crossing.from_next && !ray.for_shadow && gap >= -ROUNDED_BELOW {
                    // One that is coming out was below before.
                    inside = gap_above(home + delta * min(NEXT / length_in_cells, 1.0)) > gap;
                }
            }
        }
        var searches = true;
        var meets = false;
        var from_inside = false;
        if skipped > 0.0 {
            searches = skipped < 1.0 && !inside;
            meets = inside && (skipped < 1.0 || delta.z <= 0.0);
        } else if inside {
            skipped = emerges(home, delta);
            inside = skipped > 1.0;
            from_inside = !inside && (sees_inside || ray.for_shadow);
            meets = from_inside;
            searches = !inside && !meets && skipped < 1.0;
            leaves = searches;
        }
        var tau = skipped;
        if searches {
            let found = search_within(home + delta * skipped, delta * (1.0 - skipped), leaves);
            result.steps += found.steps;
            tau = skipped + (1.0 - skipped) * found.tau;
            meets = found.status == 0u;
            if found.status == 2u {
                result.status = 2u;
            }
        }
        let t = mix(here.t, there.t, tau);
        if meets && t < best.t {
            let point = prism_point(prism, t, mix_points(here, there, tau));
            result.found = true;
            result.inside = from_inside;
            result.status = 0u;
            result.t = t;
            result.face = crossing.face;
            result.strip = PRISM;
            result.weights = point.weights;
            return result;
        }
        here = there;
        start = end;
        if here.t >= best.t {
            break;
        }
    }
    return result;
}
