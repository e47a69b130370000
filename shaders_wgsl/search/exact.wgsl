// Exact search: skips empty space with the maxima of ever larger blocks of cells and solves the bilinear
// cell in closed form. Musgrave 1988; Tevs, Ihrke and Seidel 2008; Ramsey, Potter and Hansen 2004.
//
// The maxima hold half a cell around their nodes too (crates/heightfield/src/skip_pyramid.rs), so nodes
// come from rounded positions and each step ends an eighth of a cell beyond its node. Cells are walked by
// id; a ray that enters one on or below its surface hits it there, which closes the seam that rounding
// leaves between neighbours. There are no branches: lanes in lock step would all pay for each.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Gives the answers of crates/heightfield/src/search/exact.rs.
#import "lib/found.wgsl"
#import "lib/bilinear.wgsl"
#import "lib/ray_end.wgsl"
#import "lib/surface_height.wgsl"
#import "bindings/pyramid.wgsl"

// Mesa's software device ends all loops of a program after 65535 rounds, whatever state they are in.
const MAX_STEPS: u32 = 16384u;
// Where most searches from the lid begin: 16 nodes across the longer side.
const FIRST_DEPTH: i32 = 4;
// Cells that a step goes beyond its node.
const BEYOND: f32 = 0.125;
// Farther from the surface than this, a start is not on it.
const ON_SURFACE: f32 = 1e-3;
// Adding 1.5 * 2^23 leaves a whole number below 2^22 in the low bits.
const TO_BITS: f32 = 12582912.0;

// The highest point of the surface around a node, of 2^bits along x and y. raw: its ids in the low bits.
fn maximum_of(raw: vec2i, bits: vec2i, offset_bits: i32) -> f32 {
    let last = (vec2i(1) << vec2u(bits)) - 1;
    let id = raw & last;
    let offset = offset_bits & ((1 << u32(bits.x + bits.y)) - 1);
    return maximum_at(offset + (id.y << u32(bits.x)) + id.x);
}

// bounded: whether the segment ends at its end; otherwise it goes on to the surface below. stretch: what of the
// segment can meet the surface.
fn trace(start: vec3f, delta: vec3f, from_surface: bool, bounded: bool, stretch: vec2f) -> Found {
    let period = vec2f(height_info.cells);
    let place = start.xy * height_info.size - 0.5;
    let first_cell = floor(place);
    let local_start = place - first_cell;
    let origin = place - f32(height_info.first_texel);
    // The cells at the borders, as ids from the first of this ray.
    let first = f32(height_info.first_texel) - first_cell;
    let last = first + period - 1.0;
    let direction = delta.xy * height_info.size;
    let moves = abs(direction) > vec2f(1e-20);
    let inverse = select(vec2f(0.0), 1.0 / select(vec2f(1.0), direction, moves), moves);
    let still = select(vec2f(FAR), vec2f(0.0), moves);
    let ahead = direction > vec2f(0.0);
    let side = select(vec2f(0.0), vec2f(1.0), ahead);
    let toward = 2.0 * side - 1.0;
    // The same in shares of the period, for the nodes.
    let share = origin / period;
    let share_step = direction / period;
    let share_time = inverse * period;
    let node_time = (toward * BEYOND - origin) * inverse + still;

    let dz = select(0.0, delta.z, abs(delta.z) > 1e-30);
    let sinks = dz < 0.0;
    // When the ray comes down to height 0 from height 1; 0 when it does not come down.
    let fall = select(0.0, 1.0 / select(-1.0, dz, sinks), sinks);
    var z_start = start.z;
    var end = ray_end(origin, inverse, moves, z_start, dz, height_info.highest, period, endless);
    let deepest = i32(height_info.deepest);
    let lags = vec2i(height_info.lags);
    let offset_bits = i32(height_info.offset_bits);
    var depth = min(deepest, FIRST_DEPTH);
    if from_surface {
        let gap = cell_ray(corners_of(first_cell), local_start, z_start, 0.0, vec3f(direction, dz)).gap;
        z_start -= select(0.0, gap, abs(gap) <= ON_SURFACE);
        depth = deepest;
    }
    if from_surface || bounded {
        end = min(end, stretch.y);
    }
    if bounded || stretch.x > 0.0 {
        // Nodes about as wide as the segment is long.
        let cells = max(abs(direction.x), abs(direction.y)) * select(stretch.y - stretch.x, 1.0, bounded);
        depth = clamp(deepest - i32(log2(max(cells, 1.0))), depth, deepest);
    }
    // Nodes are left out only when the ray clears them by more than rounding.
    let z_skip = z_start - ROUNDING;
    var t = max(stretch.x, (height_info.highest - z_skip) * fall);
    var hit = false;
    var steps = 0u;
    loop {
        // Down and along the nodes until one of the finest may hold a hit.
        var exit = 0.0;
        var cleared = true;
        loop {
            let bits = max(depth - lags, vec2i(0));
            let nodes = bitcast<vec2f>((127 + bits) << vec2u(23u));
            let size = bitcast<vec2f>((127 - bits) << vec2u(23u));
            var node = floor((share + share_step * t) * nodes);
            if endless {
                node = clamp(node, vec2f(0.0), nodes - 1.0);
            }
            var exits = (node + side) * (size * share_time) + node_time;
            if endless {
                exits = past_border(exits, node, vec2f(0.0), nodes - 1.0, ahead);
            }
            let id = bitcast<vec2i>(node + TO_BITS);
            let along_x = exits.x < exits.y;
            exit = select(exits.y, exits.x, along_x);
            let maximum = maximum_of(id, bits, offset_bits);
            cleared = z_skip + dz * select(t, exit, sinks) > maximum;
            // Ascend only across a border of the parent.
            let last_child = ((id & vec2i(1)) != vec2i(0)) == ahead;
            let ascends = select(last_child.y, last_child.x, along_x) && depth > 0;
            let at_cell = !cleared && depth == deepest;
            let sunk = (maximum - z_skip) * fall;
            t = select(select(t, sunk, sunk > t), exit, cleared);
            depth += select(select(1, 0, at_cell), select(0, -1, ascends), cleared);
            steps++;
            if at_cell || t >= end || steps >= MAX_STEPS {
                break;
            }
        }
        // Along the cells to the far side of that node.
        var cell = floor(local_start + direction * t);
        if endless {
            cell = clamp(cell, first, last);
        }
        loop {
            var exits = (cell + side - local_start) * inverse + still;
            if endless {
                exits = past_border(exits, cell, first, last, ahead);
            }
            let along_x = exits.x < exits.y;
            let cell_exit = select(exits.y, exits.x, along_x);
            let local = clamp(local_start - cell + direction * t, vec2f(0.0), vec2f(1.0));
            var ray = cell_ray(corners_of(first_cell + cell), local, z_start + dz * t, t, vec3f(direction, dz));
            // A light ray that enters a cell on the surface still leaves the point it started from.
            let inside = ray.gap <= select(ray.rounding, -ray.rounding, from_surface);
            ray.gap = max(ray.gap, 0.0);
            let s = select(cell_root(ray, cell_exit - t), 0.0, inside);
            hit = !cleared && s >= 0.0;
            t = select(select(t, cell_exit, cell_exit > t && !cleared), t + s, hit);
            cell += select(vec2f(0.0, toward.y), vec2f(toward.x, 0.0), along_x);
            steps++;
            if hit || cleared || cell_exit >= exit || steps >= MAX_STEPS {
                break;
            }
        }
        if hit || t >= end || steps >= MAX_STEPS {
            break;
        }
    }
    // What lies beyond the light throws no shadow.
    if hit && (t <= end || !(from_surface || bounded)) {
        return found_hit(t, steps);
    }
    if steps >= MAX_STEPS {
        return found_unconverged(t, steps);
    }
    return found_left(steps);
}

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    return trace(start, delta, false, false, stretch);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    return trace(start, delta, true, false, stretch).status == 0u;
}

fn height_at(uv: vec2f) -> f32 {
    return surface_height(uv);
}

// As search, for a segment that may begin and end anywhere. leaves: whether it begins on the surface and leaves it.
fn search_within(start: vec3f, delta: vec3f, leaves: bool) -> Found {
    return trace(start, delta, leaves, true, WHOLE_STRETCH);
}

// How far outside of the heights that it met a hit may lie: on the surface, or it is none.
fn slack(cos_theta: f32) -> f32 {
    return 0.0;
}
