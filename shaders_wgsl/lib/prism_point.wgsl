// Points of a ray in a prism, found by Newton's method. See `lib/prism.wgsl`.
#import "lib/prism.wgsl"

// Weights by which a point of a prism may be outside, and share of the triangle by which it may be off the ray: far more
// than rounding, on slivers too.
const OUTSIDE: f32 = 0.5;
const OFF: f32 = 0.1;
// Share of the way to the point that is rounded.
const ROUNDED: f32 = 1e-5;

// How the place of a point changes with its weights and its rise: a row for each axis.
fn prism_slopes(prism: Prism, point: PrismPoint) -> mat3x3f {
    let m1 = prism.n1 - prism.n0;
    let m2 = prism.n2 - prism.n0;
    return transpose(mat3x3f(
        prism.p1 - prism.p0 + point.rise * m1,
        prism.p2 - prism.p0 + point.rise * m2,
        prism.n0 + point.weights.x * m1 + point.weights.y * m2,
    ));
}

// A point of a prism, relative to the ray's origin.
fn prism_place(prism: Prism, point: PrismPoint) -> vec3f {
    let w = vec3f(1.0 - point.weights.x - point.weights.y, point.weights);
    return w.x * (prism.p0 + point.rise * prism.n0) + w.y * (prism.p1 + point.rise * prism.n1)
        + w.z * (prism.p2 + point.rise * prism.n2);
}

// The point of the prism on the ray, by Newton's method from a guess: at `t`; or, unless `across` is zero, where the step from
// the guess is perpendicular to it, in weights and rise. So the ray can be followed around a fold of the prism, where it
// goes on in weights and rise but turns back in t.
fn prism_point(prism: Prism, t: f32, guess: PrismPoint, across: vec3f) -> PrismPoint {
    var found = guess;
    let by_t = all(across == vec3f(0.0));
    for (var i = 0u; i < 3u; i++) {
        let slopes = prism_slopes(prism, found);
        var off = prism_place(prism, found) - vec3f(0.0, 0.0, t);
        let moved = vec3f(found.weights - guess.weights, found.rise - guess.rise);
        let last = select(across, slopes[2], by_t);
        off.z = select(dot(across, moved), off.z, by_t);
        let ahead = cross(slopes[0], slopes[1]);
        let volume = dot(ahead, last);
        if !(abs(volume) > 1e-30) {
            break;
        }
        let step = (off.x * cross(slopes[1], last) + off.y * cross(last, slopes[0]) + off.z * ahead) / volume;
        found.weights -= step.xy;
        found.rise -= step.z;
    }
    found.t = select(prism_place(prism, found).z, t, by_t);
    return found;
}

// The least of the three weights of a point: negative beside the triangle.
fn least_weight(point: PrismPoint) -> f32 {
    return min(1.0 - point.weights.x - point.weights.y, min(point.weights.x, point.weights.y));
}

// Whether a point found so is over the triangle of the prism, and on the ray. Between the places where a ray goes in and
// out of a prism that is folded over itself it may be outside, and the method may end anywhere.
fn is_of_prism(prism: Prism, point: PrismPoint) -> bool {
    let size = length(prism.p1 - prism.p0) + length(prism.p2 - prism.p0);
    let near = length(prism_place(prism, point) - vec3f(0.0, 0.0, point.t)) <= OFF * size + ROUNDED * abs(point.t);
    return near && least_weight(point) >= -OUTSIDE;
}

fn mix_points(a: PrismPoint, b: PrismPoint, share: f32) -> PrismPoint {
    return PrismPoint(mix(a.weights, b.weights, share), mix(a.rise, b.rise, share), mix(a.t, b.t, share));
}
