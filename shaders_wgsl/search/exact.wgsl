// Exact search: descends a max pyramid only into nodes the ray can hit and solves the bilinear cell in
// closed form. Musgrave 1988; Tevs, Ihrke and Seidel 2008; Ramsey, Potter and Hansen 2004.
//
// Cells and nodes are integers throughout; a ray that enters a cell on or below its surface hits it
// there, which closes the seam that rounding leaves between neighbouring cells.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal.
// Twin of crates/heightfield/src/search/exact.rs.
#import "lib/found.wgsl"
#import "lib/bilinear.wgsl"
#import "lib/grid_axis.wgsl"
#import "bindings/pyramid.wgsl"

const MAX_STEPS: u32 = 16384u;
// Farther from the surface than this, a start is not on it.
const ON_SURFACE: f32 = 1e-3;
// Rounding of a height: 8 ulps of 1.
const ROUNDING: f32 = 9.5e-7;

// The four corner heights of a cell, the first at index `at`.
fn bilinear_cell(at: u32) -> vec4f {
    let below = at + height_info.cells.x + 1u;
    return vec4f(corners[at], corners[at + 1u], corners[below], corners[below + 1u]);
}

fn trace(start: vec3f, delta: vec3f, from_surface: bool) -> Found {
    let periodic = height_info.wrap != 1u;
    let position = start.xy * height_info.size - 0.5 - f32(height_info.first_texel);
    let direction = vec3f(delta.xy * height_info.size, delta.z);
    let dz = direction.z;
    var x = axis_new(position.x, direction.x, height_info.cells.x, periodic);
    var y = axis_new(position.y, direction.y, height_info.cells.y, periodic);
    if dz >= 0.0 && start.z > height_info.highest {
        return found_left(0u);
    }
    let period = 2 * vec2i(height_info.cells);
    let flat_period = dz == 0.0 && periodic && (x.inverse == 0.0 || y.inverse == 0.0);
    let top = height_info.level_count - 1u;
    var level = select(top, 0u, from_surface);
    x.node >>= level;
    y.node >>= level;
    var t = 0.0;
    var z_start = start.z;
    var first = from_surface;
    for (var steps = 1u; steps <= MAX_STEPS; steps++) {
        let nodes = height_info.levels[level];
        let maximum = pyramid[nodes.z + y.node * nodes.x + x.node];
        let exit_x = axis_exit(x, level);
        let exit_y = axis_exit(y, level);
        let exit = min(exit_x, exit_y);
        let lowest = z_start + dz * select(t, exit, dz < 0.0);
        if lowest <= maximum {
            if level > 0u {
                if dz < 0.0 {
                    t = min(max(t, (maximum - z_start) / dz), exit);
                }
                x = axis_descend(x, level, t);
                y = axis_descend(y, level, t);
                level -= 1u;
                continue;
            }
            let cell = bilinear_cell(y.node * (height_info.cells.x + 1u) + x.node);
            let local = vec2f(axis_local(x, t, direction.x), axis_local(y, t, direction.y));
            var gap = z_start + dz * t - bilinear_height(cell, local);
            if first && abs(gap) <= ON_SURFACE {
                z_start -= gap;
                gap = 0.0;
            }
            // A light ray that enters a cell on the surface still leaves the point it started from.
            let on_surface = from_surface && abs(gap) <= ROUNDING;
            let s = bilinear_root(cell, local, gap, direction, exit - t, on_surface);
            if s >= 0.0 {
                return found_hit(t + s, steps);
            }
        }
        first = false;
        t = max(t, exit);
        if t >= FAR || (dz > 0.0 && z_start + dz * t > height_info.highest) {
            return found_left(steps);
        }
        var crossed: bool;
        if exit_x <= exit_y {
            crossed = axis_crosses_parent(x);
            x = axis_advance(x, nodes.x);
        } else {
            crossed = axis_crosses_parent(y);
            y = axis_advance(y, nodes.y);
        }
        if crossed && level < top {
            level += 1u;
            x.node /= 2u;
            y.node /= 2u;
        }
        if flat_period && (abs(x.tile) > period.x || abs(y.tile) > period.y) {
            return found_left(steps);
        }
    }
    return found_unconverged(t, MAX_STEPS);
}

fn search(start: vec3f, delta: vec3f, cos_theta: f32) -> Found {
    return trace(start, delta, false);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32) -> bool {
    return trace(start, delta, true).status == 0u;
}
