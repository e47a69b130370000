// Stepping by cones; shared by every search that reads a cone map. lib/cone_by_cell.wgsl or
// lib/cone_by_corner.wgsl looks the ratio of a point up.
//
// Where the cone does not take the ray out of its cell, the cell is solved in closed form and the ray goes
// on at its wall: every step gains a cell at least. In a relaxed cone the ray may go below the surface,
// once: a jump that ends there is halved, and what is left of it followed cell by cell.
// Twin of crates/heightfield/src/search/cone_walk.rs.
#import "lib/found.wgsl"
#import "lib/cell_walk.wgsl"
#import "bindings/cone.wgsl"

// With `relaxed` the buffer holds the relaxed cones behind the empty ones. stretch: what of the segment can meet the
// surface.
fn walk(
    start: vec3f, delta: vec3f, from_surface: bool, most_steps: i32, relaxed: bool, halvings: i32, stretch: vec2f,
) -> Found {
    let periodic = cell_wrap() != 1u;
    let direction = vec3f(delta.xy * height_info.size, delta.z);
    let dz = direction.z;
    if !(max(abs(direction.x), abs(direction.y)) < FARTHEST) {
        return found_unconverged(0.0, 0u);
    }
    let position = start.xy * height_info.size - 0.5 - f32(height_info.first_texel);
    var x = walk_axis_new(position.x, direction.x, height_info.cells.x, periodic);
    var y = walk_axis_new(position.y, direction.y, height_info.cells.y, periodic);
    let lateral = length(delta.xy);
    let pierces = relaxed && dz <= 0.0;
    let layer = select(0u, (height_info.cells.x + 1u) * (height_info.cells.y + 1u), pierces);
    var z_start = start.z;
    var t = stretch.x;
    if t > 0.0 {
        let at_start = vec2i(walk_axis_place(x, t), walk_axis_place(y, t));
        x.cell = at_start.x;
        y.cell = at_start.y;
    }
    // Up to here the ray is followed cell by cell.
    var closed_until = 0.0;
    for (var i = 1; i <= most_steps; i++) {
        let steps = u32(i);
        let ray = ray_in_cell(x, y, z_start + dz * t, t, direction);
        var gap = ray.gap;
        if from_surface && i == 1 && abs(gap) <= ON_SURFACE {
            z_start -= gap;
            gap = 0.0;
        }
        let on_surface = from_surface && abs(gap) <= STILL_ON_SURFACE;
        if gap <= 0.0 && !on_surface {
            return found_hit(t, steps);
        }
        let exit_x = walk_axis_exit(x);
        let exit_y = walk_axis_exit(y);
        let exit = min(exit_x, exit_y);
        var jump = t;
        if gap > 0.0 && t >= closed_until {
            let local = vec2f(walk_axis_local(x, t), walk_axis_local(y, t));
            let c = cone_ratio(layer + cell_index(x, y), local);
            let closing = lateral - c * dz;
            if closing > 0.0 {
                jump = min(t + c * gap / closing, NEVER);
            } else if c > 0.0 {
                jump = NEVER;
            }
        }
        if jump >= NEVER {
            return found_left(steps);
        }
        if jump > exit {
            var next_x = x;
            var next_y = y;
            next_x.cell = walk_axis_place(x, jump);
            next_y.cell = walk_axis_place(y, jump);
            if pierces && ray_in_cell(next_x, next_y, z_start + dz * jump, jump, direction).gap <= 0.0 {
                closed_until = jump;
                for (var k = 0; k < halvings; k++) {
                    let middle = 0.5 * (t + closed_until);
                    next_x.cell = walk_axis_place(x, middle);
                    next_y.cell = walk_axis_place(y, middle);
                    if next_x.cell == x.cell && next_y.cell == y.cell {
                        break;
                    }
                    if ray_in_cell(next_x, next_y, z_start + dz * middle, middle, direction).gap <= 0.0 {
                        closed_until = middle;
                    } else {
                        t = middle;
                        x.cell = next_x.cell;
                        y.cell = next_y.cell;
                    }
                }
            } else {
                t = jump;
                x.cell = next_x.cell;
                y.cell = next_y.cell;
            }
        } else {
            let s = root_in_cell(ray, exit - t, on_surface);
            if s >= 0.0 {
                return found_hit(t + s, steps);
            }
            t = max(t, exit);
            if exit_x <= exit_y {
                x.cell = walk_axis_next(x);
            } else {
                y.cell = walk_axis_next(y);
            }
        }
        // A falling ray meets the floor; the others end with their segment.
        if t >= NEVER || (dz >= 0.0 && t > stretch.y) {
            return found_left(steps);
        }
    }
    return found_unconverged(min(t, 1.0), u32(most_steps));
}
