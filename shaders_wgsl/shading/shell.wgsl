// Rays through the shell of a mesh: down a tree of boxes to the prisms over its triangles. Thonat, Beaune, Sun,
// Carr and Boubekeur, "Tessellation-Free Displacement Mapping for Ray Tracing", SIGGRAPH Asia 2021.
#import "bindings/shell.wgsl"
#import "shading/shell_prism.wgsl"

// Boxes put off at a time; the host keeps the tree lower than that.
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

// The first hit nearer than `last`; for shadows any hit.
fn trace_shell(ray: ShellRay, direction: vec3f, last: f32) -> ShellHit {
    var best: ShellHit;
    best.status = 1u;
    best.t = last;
    let unit = normalize_or(direction, vec3f(0.0, 0.0, 1.0));
    let inverse = 1.0 / select(unit, vec3f(1e-20), abs(unit) < vec3f(1e-20));
    var stack: array<u32, STACK>;
    var height = 0u;
    var at = 0u;
    var entered = enters_box(ray.origin, inverse, shell_nodes[0], ray.first, best.t);
    loop {
        var goes_down = false;
        if entered < best.t {
            let node = shell_nodes[at];
            best.steps += 1u;
            if node.count == INNER_NODE {
                let left = enters_box(ray.origin, inverse, shell_nodes[node.first], ray.first, best.t);
                let right = enters_box(ray.origin, inverse, shell_nodes[node.first + 1u], ray.first, best.t);
                let left_first = left <= right;
                if max(left, right) < best.t && height < STACK {
                    stack[height] = select(node.first, node.first + 1u, left_first);
                    height += 1u;
                }
                at = select(node.first + 1u, node.first, left_first);
                entered = min(left, right);
                goes_down = true;
            } else {
                for (var i = 0u; i < node.count; i++) {
                    best = through_prism(ray, shell_prisms[node.first + i], best);
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
