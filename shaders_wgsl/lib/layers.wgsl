// Walking a segment in equal layers; shared by every search that starts with linear steps.
// Twin of crates/heightfield/src/search/layers.rs.
#import "lib/found.wgsl"
#import "lib/height.wgsl"

// The two samples between which the segment first goes below the surface.
struct Bracket {
    found: bool,
    above: f32,
    below: f32,
    // Ray height minus surface height at the two: positive, and not positive.
    gap_above: f32,
    gap_below: f32,
    steps: u32,
}

// Ray height minus surface height at `tau`.
fn gap_at(start: vec3f, delta: vec3f, tau: f32) -> f32 {
    let p = start + delta * tau;
    return p.z - height_at(p.xy);
}

// Samples the end of each of `layers` equal layers until one lies on or below the surface. The start
// is not sampled: on the lid nothing is above it. The floor counts as below whatever the rounding.
// clear: up to here the segment is known to lie above the surface; the layers that end before are taken as read.
fn first_below(start: vec3f, delta: vec3f, layers: i32, clear: f32) -> Bracket {
    let first = clamp(i32(clear * f32(layers)), 1, layers);
    var above = f32(first - 1) / f32(layers);
    var gap_above = 0.0;
    for (var i = first; i <= layers; i++) {
        let tau = f32(i) / f32(layers);
        let gap = gap_at(start, delta, tau);
        if gap <= 0.0 || (i == layers && delta.z < 0.0) {
            if i == first {
                gap_above = max(gap_at(start, delta, above), 0.0);
            }
            return Bracket(true, above, tau, gap_above, min(gap, 0.0), u32(i - first + 1));
        }
        above = tau;
        gap_above = gap;
    }
    return Bracket(false, above, 1.0, gap_above, gap_above, u32(layers - first + 1));
}

// How far a start below the surface is lifted to lie on it: searches return hits up to a layer too deep, or what
// rounding takes, and from there a surface would shadow itself.
fn lift_from(start: vec3f) -> vec3f {
    return vec3f(0.0, 0.0, max(height_at(start.xy) - start.z, 0.0));
}

// Whether any sample of a segment that leaves the surface lies strictly below it. until: from here on nothing is as high
// as the segment.
fn any_below(start: vec3f, delta: vec3f, layers: i32, until: f32) -> bool {
    let lift = lift_from(start);
    let last = min(i32(ceil(until * f32(layers))), layers);
    for (var i = 1; i <= last; i++) {
        if gap_at(start + lift, delta - lift, f32(i) / f32(layers)) < 0.0 {
            return true;
        }
    }
    return false;
}

// Where the chord between the two samples of a bracket reaches zero.
fn secant(above: f32, below: f32, gap_above: f32, gap_below: f32) -> f32 {
    let drop = gap_above - gap_below;
    if drop > 0.0 {
        return above + (below - above) * (gap_above / drop);
    }
    return below;
}

// Layers for a view at `cos_theta`: `most` at grazing angles, `least` head-on, changing linearly.
fn linear_layers(least: i32, most: i32, cos_theta: f32) -> i32 {
    let count = f32(most) + (f32(least) - f32(most)) * clamp(cos_theta, 0.0, 1.0);
    return i32(max(ceil(count), 1.0));
}

// The same, changing by equal factors.
fn exponential_layers(least: i32, most: i32, cos_theta: f32) -> i32 {
    let count = f32(most) * pow(f32(least) / f32(most), clamp(cos_theta, 0.0, 1.0));
    return i32(max(ceil(count), 1.0));
}
