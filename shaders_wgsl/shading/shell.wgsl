// Rays through the shell of a mesh: down a tree of boxes to the prisms over its triangles. Thonat, Beaune, Sun,
// Carr and Boubekeur, "Tessellation-Free Displacement Mapping for Ray Tracing", SIGGRAPH Asia 2021.
#import "shading/shell_chords.wgsl"
#import "shading/shell_ray.wgsl"
#import "shading/shell_triangle.wgsl"

// Boxes put off at a time; the host keeps the trees lower than that.
const STACK: u32 = 48u;

// Where a ray enters a box, or 1e30.
fn enters_box(origin: vec3f, inverse: vec3f, node: ShellNode, first: f32, last: f32) -> f32 {
    let a = (node.low - origin) * inverse;
    let b = (node.high - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(max(near.x, near.y), max(near.z, first));
    let leave = min(min(far.x, far.y), min(far.z, last));
    return select(1e30, enter, enter <= leave * 1.000001);
}

fn inverse_of(direction: vec3f) -> vec3f {
    return 1.0 / select(direction, vec3f(1e-20), abs(direction) < vec3f(1e-20));
}

// The first hit on the solid nearer than `last`; for shadows any hit.
//
// Rays first go on to the next leaf, then to the next prism that they go through, and only then into it: lanes in lock step
// pay for all that is in a loop as often as any of them is. Aila and Laine, "Understanding the Efficiency of Ray Traversal
// on GPUs", HPG 2009.
fn trace_solid(ray: ShellRay, last: f32) -> ShellHit {
    var best: ShellHit;
    best.status = 1u;
    best.t = last;
    let inverse = inverse_of(ray.along);
    var stack: array<vec2u, STACK>;
    var height = 0u;
    var at = solid.nodes;
    var entered = enters_box(ray.origin, inverse, shell_nodes[at], ray.first, best.t);
    var goes_on = true;
    // What is left of a leaf.
    var item = 0u;
    var end = 0u;
    loop {
        var crossing: Crossing;
        loop {
            while goes_on && item == end {
                let first = shell_nodes[at].first;
                let count = shell_nodes[at].count;
                var goes_down = false;
                if entered < best.t {
                    best.steps += 1u;
                    if count == INNER_NODE {
                        let child = solid.nodes + first;
                        let left = enters_box(ray.origin, inverse, shell_nodes[child], ray.first, best.t);
                        let right = enters_box(ray.origin, inverse, shell_nodes[child + 1u], ray.first, best.t);
                        let left_first = left <= right;
                        let later = max(left, right);
                        if later < best.t && height < STACK {
                            stack[height] = vec2u(select(child, child + 1u, left_first), bitcast<u32>(later));
                            height += 1u;
                        }
                        at = select(child + 1u, child, left_first);
                        entered = min(left, right);
                        goes_down = entered < best.t;
                    } else {
                        item = solid.prisms + first;
                        end = item + count;
                    }
                }
                if !goes_down {
                    goes_on = height > 0u;
                    height -= select(0u, 1u, goes_on);
                    at = select(at, stack[height].x, goes_on);
                    entered = select(entered, bitcast<f32>(stack[height].y), goes_on);
                }
            }
            if item == end {
                break;
            }
            let prism = shell_prisms[item];
            item += 1u;
            if prism.strip == PRISM {
                crossing = cross_prism(ray, prism, best.t);
            } else {
                best = through_triangle(ray, prism, best);
            }
            if crossing.crosses || (ray.for_shadow && best.found) {
                break;
            }
        }
        if crossing.crosses {
            best = search_prism(ray, crossing, best);
        }
        if !crossing.crosses || (ray.for_shadow && best.found) {
            break;
        }
    }
    return best;
}
