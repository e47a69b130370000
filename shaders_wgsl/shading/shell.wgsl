// Rays through the shell of a mesh: down a tree of boxes to the prisms over its triangles. Thonat, Beaune, Sun,
// Carr and Boubekeur, "Tessellation-Free Displacement Mapping for Ray Tracing", SIGGRAPH Asia 2021.
#import "shading/shell_prism.wgsl"
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
fn trace_solid(ray: ShellRay, last: f32) -> ShellHit {
    var best: ShellHit;
    best.status = 1u;
    best.t = last;
    let inverse = inverse_of(ray.along);
    var stack: array<u32, STACK>;
    var height = 0u;
    var at = solid.nodes;
    var entered = enters_box(ray.origin, inverse, shell_nodes[at], ray.first, best.t);
    loop {
        var goes_down = false;
        if entered < best.t {
            let node = shell_nodes[at];
            best.steps += 1u;
            if node.count == INNER_NODE {
                let child = solid.nodes + node.first;
                let left = enters_box(ray.origin, inverse, shell_nodes[child], ray.first, best.t);
                let right = enters_box(ray.origin, inverse, shell_nodes[child + 1u], ray.first, best.t);
                let left_first = left <= right;
                if max(left, right) < best.t && height < STACK {
                    stack[height] = select(child, child + 1u, left_first);
                    height += 1u;
                }
                at = select(child + 1u, child, left_first);
                entered = min(left, right);
                goes_down = true;
            } else {
                for (var i = 0u; i < node.count; i++) {
                    let prism = shell_prisms[solid.prisms + node.first + i];
                    if prism.strip == PRISM {
                        best = through_prism(ray, prism, best);
                    } else {
                        best = through_triangle(ray, prism, best);
                    }
                }
            }
        }
        if !goes_down {
            if height == 0u || (ray.for_shadow && best.found) {
                break;
            }
            height -= 1u;
            at = stack[height];
            entered = enters_box(ray.origin, inverse, shell_nodes[at], ray.first, best.t);
        }
    }
    return best;
}
