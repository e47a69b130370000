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
// Chords, and parts of them between places where a ray meets the surface from behind.
const MAX_PARTS: u32 = 80u;
// Light rays meet nothing of the sheet they start on on their first so many cells, unless they are below the surface at
// the end of them. Creases between cells are no part of what the texels stand for, and the shading, whose slopes are
// smooth, knows none.
const CREASE: f32 = 1.0;
// So deep below the surface, in heights, a ray may come from the next triangle of a sheet without having met it there:
// by as much chords are off. Deeper it is on the other side.
const ROUNDED_BELOW: f32 = 2e-3;
// Heights above the highest and below the lowest that a hit may be: far more than chords are off.
const BEYOND_RELIEF: f32 = 0.1;
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
        span.enter = prism_point(prism, ray.first, mix_points(span.enter, span.leave, share), vec3f(0.0));
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
    // Where normals meet before the relief ends the shell is folded: there the front of the surface looks down. A ray that comes
    // in on one side of a fold and leaves on the other turns back at it, unless it was out of the prism in between.
    let between = mix_points(span.enter, span.leave, 0.5);
    var halfway = prism_point(prism, between.t, between, vec3f(0.0));
    var across = vec3f(0.0);
    var turns_back = false;
    var turned = false;
    if (prism_volume(prism, span.enter) < 0.0) != (prism_volume(prism, span.leave) < 0.0) {
        let way = vec3f(span.leave.weights - span.enter.weights, span.leave.rise - span.enter.rise);
        let along = way / vec3f(1.0, 1.0, height_info.scale * height_info.scale);
        let around = prism_point(prism, between.t, between, along);
        turns_back = is_of_prism(prism, around) && least_weight(around) >= 0.0;
        if turns_back {
            across = along;
            halfway = around;
            // Turning back in t and turning inside out, the front stays the front.
            let slopes = prism_slopes(prism, around);
            turned = dot(cross(slopes[0], slopes[1]), across) < 0.0;
        }
    }
    let off = in_texture(halfway, uvs, prism) - 0.5 * (enter + leave);
    let sag = max(length(off.xy * size) / SAG.x, abs(off.z) / SAG.y);
    let chords = clamp(ceil(sqrt(min(sag, 1e6))), 1.0, MAX_CHORDS);

    var here = span.enter;
    var start = enter;
    var there = here;
    var end = start;
    var inside = false;
    var leaves = false;
    var chord = 0.0;
    var goes_on_to_next = true;
    for (var part = 0u; part < MAX_PARTS; part++) {
        if goes_on_to_next {
            there = span.leave;
            end = leave;
            chord += 1.0;
            if chord < chords {
                let share = chord / chords;
                let guess = mix_points(span.enter, span.leave, share);
                there = prism_point(prism, mix(span.enter.t, span.leave.t, share), guess, across);
                end = in_texture(there, uvs, prism);
            }
        }
        // No branch on what is the same for the whole draw: Mesa 22.3 takes such branches out of loops, and fails.
        let periodic = solid.period > 0.0;
        let tile = floor(start.xy / select(1.0, solid.period, periodic)) * solid.period;
        let home = start - vec3f(tile, 0.0);
        let delta = end - start;
        let length_in_cells = max(length(delta.xy * size), 1e-30);
        // Share of the chord that is still next to the start.
        let done = here.t / max(there.t - here.t, 1e-30);
        let skipped = max(select(0.0, min(CREASE / length_in_cells - done, 1.0), crossing.own_sheet), 0.0);
        if part == 0u || skipped > 0.0 {
            let gap = gap_above(home + delta * skipped);
            inside = gap <= select(-slack, 0.0, skipped > 0.0);
            leaves = skipped == 0.0 && abs(gap) <= slack;
            if inside && crossing.from_next && !ray.for_shadow && gap >= -ROUNDED_BELOW {
                // One that is coming out was below before.
                inside = gap_above(home + delta * min(NEXT / length_in_cells, 1.0)) > gap;
            }
        }
        // Where the surface is crossed.
        var tau = 2.0;
        if skipped > 0.0 && inside {
            tau = select(2.0, skipped, skipped < 1.0 || delta.z <= 0.0);
        } else if inside {
            tau = emerges(home, delta);
        } else if skipped < 1.0 {
            let found = search_within(home + delta * skipped, delta * (1.0 - skipped), leaves);
            result.steps += found.steps;
            if found.status == 0u {
                tau = skipped + (1.0 - skipped) * found.tau;
            } else if found.status == 2u {
                result.status = 2u;
            }
        }
        leaves = false;
        goes_on_to_next = tau > 1.0;
        if goes_on_to_next {
            here = there;
            start = end;
        } else {
            here = prism_point(prism, mix(here.t, there.t, tau), mix_points(here, there, tau), across);
            start = mix(start, end, tau);
        }
        if (here.t >= best.t && !turns_back) || (goes_on_to_next && chord >= chords) {
            break;
        }
        if !goes_on_to_next {
            let from_behind = inside != select(prism_volume(prism, here) < 0.0, turned, turns_back);
            let ahead = !turns_back || (here.t < result.t && here.t > ray.first);
            let met = ahead && (!from_behind || sees_inside || ray.for_shadow);
            // Where normals nearly vanish chords are not near the curve: no relief is so high or so low.
            let level = in_texture(here, uvs, prism).z;
            let of_relief = abs(level - 0.5) <= 0.5 + BEYOND_RELIEF + slack;
            if met && of_relief && is_of_prism(prism, here) {
                result.found = true;
                result.inside = from_behind;
                result.status = 0u;
                result.t = here.t;
                result.face = crossing.face;
                result.strip = PRISM;
                result.weights = here.weights;
                // Farther around a fold there may be something nearer.
                if !turns_back {
                    break;
                }
            }
            inside = !inside;
            leaves = !inside;
        }
    }
    return result;
}
