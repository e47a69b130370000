// Sphere tracing through a distance map: each step goes as far as the ball around the ray is empty, or to the
// cell's wall after the bilinear cell was solved in closed form. Donnelly 2005 (GPU Gems 2, chapter 8).
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/distance.rs.
#import "lib/found.wgsl"
#import "lib/cell_walk.wgsl"
#import "bindings/distance.wgsl"

override steps: i32 = 16384;

// What rounding of the position costs a step, as a share of the way that the ray came, and of the step.
const DRIFT: f32 = 9.5e-7;

// The texel of `n` whose footprint holds a point of a cell.
fn footprint(cell: u32, local: f32, n: i32) -> i32 {
    let nearest = i32(cell) + height_info.first_texel + select(0, 1, local >= 0.5);
    let wrap = cell_wrap();
    if wrap == 1u {
        return clamp(nearest, 0, n - 1);
    }
    if wrap == 0u {
        return nearest % n;
    }
    let place = nearest % (2 * n);
    return select(2 * n - 1 - place, place, place < n);
}

// The least distance to the surface, mesh units, from a point of a cell at height z.
fn least_distance(cell: vec2u, local: vec2f, z: f32) -> f32 {
    let size = vec3i(distances.info.size);
    let slice = clamp(i32(z * f32(size.z)), 0, size.z - 1);
    let row = slice * size.y + footprint(cell.y, local.y, size.y);
    let at = u32(row * size.x + footprint(cell.x, local.x, size.x));
    let code = (distances.codes[at / 2u] >> (16u * (at % 2u))) & 0xffffu;
    return f32(code) * distances.info.unit;
}

// stretch: what of the segment can meet the surface.
fn trace(start: vec3f, delta: vec3f, from_surface: bool, stretch: vec2f) -> Found {
    let periodic = cell_wrap() != 1u;
    let direction = vec3f(delta.xy * height_info.size, delta.z);
    let dz = direction.z;
    if !(max(abs(direction.x), abs(direction.y)) < FARTHEST) {
        return found_unconverged(0.0, 0u);
    }
    let position = start.xy * height_info.size - 0.5 - f32(height_info.first_texel);
    var x = walk_axis_new(position.x, direction.x, height_info.cells.x, periodic);
    var y = walk_axis_new(position.y, direction.y, height_info.cells.y, periodic);
    let inverse_speed = 1.0 / max(length(delta * distances.info.metric), 1e-30);
    var z_start = start.z;
    var t = stretch.x;
    if t > 0.0 {
        let at_start = vec2i(walk_axis_place(x, t), walk_axis_place(y, t));
        x.cell = at_start.x;
        y.cell = at_start.y;
    }
    for (var i = 1; i <= steps; i++) {
        let ray = ray_in_cell(x, y, z_start + dz * t, t, direction);
        var gap = ray.gap;
        if from_surface && i == 1 && abs(gap) <= ON_SURFACE {
            z_start -= gap;
            gap = 0.0;
        }
        let on_surface = from_surface && abs(gap) <= STILL_ON_SURFACE;
        if gap <= 0.0 && !on_surface {
            return found_hit(t, u32(i));
        }
        let exit_x = walk_axis_exit(x);
        let exit_y = walk_axis_exit(y);
        let exit = min(exit_x, exit_y);
        let cell = vec2u(walk_axis_id(x), walk_axis_id(y));
        let local = vec2f(walk_axis_local(x, t), walk_axis_local(y, t));
        let free = least_distance(cell, local, z_start + dz * t) * inverse_speed;
        let jump = t + (free * (1.0 - DRIFT) - t * DRIFT);
        if jump > exit {
            t = min(jump, NEVER);
            x.cell = walk_axis_place(x, t);
            y.cell = walk_axis_place(y, t);
        } else {
            let s = root_in_cell(ray, exit - t, on_surface);
            if s >= 0.0 {
                return found_hit(t + s, u32(i));
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
            return found_left(u32(i));
        }
    }
    return found_unconverged(min(t, 1.0), u32(steps));
}

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    return trace(start, delta, false, stretch);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    let found = trace(start, delta, true, stretch);
    // What lies beyond the light throws no shadow.
    return found.status == 0u && found.tau <= 1.0;
}

// How far outside of the heights that it met a hit may lie: on the surface, or it is none.
fn slack(cos_theta: f32) -> f32 {
    return 0.0;
}
