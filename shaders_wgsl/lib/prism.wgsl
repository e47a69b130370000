// A ray through the prism over a triangle: all points P(b) + rise N(b), with positions and normals interpolated
// over the triangle and rises between a floor and a lid. Sides are ruled surfaces, shared with the neighbours.
//
// Seen along the ray, its corners are points of a plane that move linearly with the rise, and the ray is the
// origin of that plane. It crosses the side over an edge where the cross product of the edge's two points
// vanishes: a quadratic in the rise, the same for both triangles of the edge. Smits, Shirley and Stark,
// "Direct Ray Tracing of Displacement Mapped Triangles", EGWR 2000; Ogaki, "Nonlinear Ray Tracing for
// Displacement and Shell Mapping", SIGGRAPH Asia 2023.

// Share of an edge by which rounding may put a crossing beyond its end.
const PRISM_SLACK: f32 = 1e-5;

// Lids and floors, where edges are numbered.
const CAP: u32 = 3u;

// x, y: across the ray; z: along it, from its origin.
struct Prism {
    p0: vec3f,
    p1: vec3f,
    p2: vec3f,
    n0: vec3f,
    n1: vec3f,
    n2: vec3f,
}

struct PrismPoint {
    weights: vec2f,        // of the second and third corner
    rise: f32,             // along the interpolated normal
    t: f32,                // along the ray
}

struct PrismSpan {
    enter: PrismPoint,
    leave: PrismPoint,
    through: u32,          // where it enters: number of an edge, or CAP
}

fn cross_2d(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// through: the edge or cap crossed.
fn widened(span: PrismSpan, point: PrismPoint, through: u32) -> PrismSpan {
    var wider = span;
    if point.t < span.enter.t {
        wider.enter = point;
        wider.through = through;
    }
    if point.t > span.leave.t {
        wider.leave = point;
    }
    return wider;
}

// The crossing with the lid or the floor.
fn cross_cap(prism: Prism, rise: f32, span: PrismSpan) -> PrismSpan {
    let q0 = prism.p0 + rise * prism.n0;
    let q1 = prism.p1 + rise * prism.n1;
    let q2 = prism.p2 + rise * prism.n2;
    let b = vec3f(cross_2d(q1.xy, q2.xy), cross_2d(q2.xy, q0.xy), cross_2d(q0.xy, q1.xy));
    let sum = b.x + b.y + b.z;
    if sum == 0.0 {
        return span;
    }
    let w = b / sum;
    if min(w.x, min(w.y, w.z)) < -PRISM_SLACK {
        return span;
    }
    return widened(span, PrismPoint(w.yz, rise, dot(w, vec3f(q0.z, q1.z, q2.z))), CAP);
}

// The crossing with the side over the edge from `a` to `b` at one rise. at_a, at_b: weights of its ends.
fn cross_side_at(
    a: vec3f, b: vec3f, na: vec3f, nb: vec3f, at_a: vec2f, at_b: vec2f, rise: f32, low: f32, high: f32,
    edge_number: u32, span: PrismSpan,
) -> PrismSpan {
    let qa = a + rise * na;
    let edge = b + rise * nb - qa;
    let square = dot(edge.xy, edge.xy);
    let share = -dot(qa.xy, edge.xy) / select(1.0, square, square > 0.0);
    let inside = rise >= low && rise <= high && share >= -PRISM_SLACK && share <= 1.0 + PRISM_SLACK;
    if !inside || square == 0.0 {
        return span;
    }
    return widened(span, PrismPoint(mix(at_a, at_b, share), rise, qa.z + share * edge.z), edge_number);
}

fn cross_side(
    a: vec3f, b: vec3f, na: vec3f, nb: vec3f, at_a: vec2f, at_b: vec2f, low: f32, high: f32,
    edge_number: u32, span: PrismSpan,
) -> PrismSpan {
    let constant = cross_2d(a.xy, b.xy);
    let slope = cross_2d(a.xy, nb.xy) + cross_2d(na.xy, b.xy);
    let bend = cross_2d(na.xy, nb.xy);
    let discriminant = slope * slope - 4.0 * bend * constant;
    if discriminant < 0.0 {
        return span;
    }
    let q = -0.5 * (slope + select(-1.0, 1.0, slope >= 0.0) * sqrt(discriminant));
    var wider = span;
    if q != 0.0 {
        wider = cross_side_at(a, b, na, nb, at_a, at_b, constant / q, low, high, edge_number, wider);
    }
    if bend != 0.0 {
        wider = cross_side_at(a, b, na, nb, at_a, at_b, q / bend, low, high, edge_number, wider);
    }
    return wider;
}

// From the first to the last point of the ray's line in the prism; enter.t > leave.t where it misses.
fn prism_span(prism: Prism, low: f32, high: f32) -> PrismSpan {
    var span: PrismSpan;
    span.enter.t = 1e30;
    span.leave.t = -1e30;
    span = cross_cap(prism, low, span);
    span = cross_cap(prism, high, span);
    let zero = vec2f(0.0, 0.0);
    let one = vec2f(1.0, 0.0);
    let two = vec2f(0.0, 1.0);
    span = cross_side(prism.p0, prism.p1, prism.n0, prism.n1, zero, one, low, high, 0u, span);
    span = cross_side(prism.p1, prism.p2, prism.n1, prism.n2, one, two, low, high, 1u, span);
    return cross_side(prism.p2, prism.p0, prism.n2, prism.n0, two, zero, low, high, 2u, span);
}
