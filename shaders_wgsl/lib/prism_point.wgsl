// Points of a ray in a prism, found by Newton's method. See `lib/prism.wgsl`.
#import "lib/prism.wgsl"

// Weights by which a point of a prism may be outside, and share of the triangle by which it may be off the ray: far more
// than rounding, on slivers too.
const OUTSIDE: f32 = 0.5;
const OFF: f32 = 0.1;
// Share of the way to the point that is rounded.
const ROUNDED: f32 = 1e-5;

// The point of the prism at `t` of the ray, by Newton's method from a guess.
fn prism_point(prism: Prism, t: f32, guess: PrismPoint) -> PrismPoint {
    var found = guess;
    let e1 = prism.p1 - prism.p0;
    let e2 = prism.p2 - prism.p0;
    let m1 = prism.n1 - prism.n0;
    let m2 = prism.n2 - prism.n0;
    for (var i = 0u; i < 3u; i++) {
        let normal = prism.n0 + found.weights.x * m1 + found.weights.y * m2;
        let off = prism.p0 + found.weights.x * e1 + found.weights.y * e2 + found.rise * normal - vec3f(0.0, 0.0, t);
        let along_1 = e1 + found.rise * m1;
        let along_2 = e2 + found.rise * m2;
        let across = cross(along_1, along_2);
        let volume = dot(across, normal);
        if !(abs(volume) > 1e-30) {
            break;
        }
        let step = vec3f(dot(off, cross(along_2, normal)), dot(off, cross(normal, along_1)), dot(off, across)) / volume;
        found.weights -= step.xy;
        found.rise -= step.z;
    }
    found.t = t;
    return found;
}

// Whether a point found so is over the triangle of the prism, and on the ray. Between the places where a ray goes in and
// out of a prism that is folded over itself it may be outside, and the method may end anywhere.
fn is_of_prism(prism: Prism, point: PrismPoint) -> bool {
    let w = vec3f(1.0 - point.weights.x - point.weights.y, point.weights);
    let at = w.x * (prism.p0 + point.rise * prism.n0) + w.y * (prism.p1 + point.rise * prism.n1)
        + w.z * (prism.p2 + point.rise * prism.n2);
    let size = length(prism.p1 - prism.p0) + length(prism.p2 - prism.p0);
    let near = length(at - vec3f(0.0, 0.0, point.t)) <= OFF * size + ROUNDED * abs(point.t);
    return near && min(w.x, min(w.y, w.z)) >= -OUTSIDE;
}

fn mix_points(a: PrismPoint, b: PrismPoint, share: f32) -> PrismPoint {
    return PrismPoint(mix(a.weights, b.weights, share), mix(a.rise, b.rise, share), mix(a.t, b.t, share));
}
