// Rays on the inner side of the surface: how deep, and where they come out.
#import "lib/surface_height.wgsl"
#import "search/exact.wgsl"

// Cells that a ray is followed below the surface.
const MAX_CELLS_BELOW: u32 = 8192u;

// Height of a point above the surface.
fn gap_above(place: vec3f) -> f32 {
    return place.z - surface_height(place.xy);
}

// Where along a segment that starts below the surface it comes out, 0..1, or 2. Cells are walked one by one.
fn emerges(start: vec3f, delta: vec3f) -> f32 {
    let place = start.xy * height_info.size - 0.5;
    let first_cell = floor(place);
    let local_start = place - first_cell;
    let direction = delta.xy * height_info.size;
    let moves = abs(direction) > vec2f(1e-20);
    let inverse = select(vec2f(0.0), 1.0 / select(vec2f(1.0), direction, moves), moves);
    let still = select(vec2f(FAR), vec2f(0.0), moves);
    let side = select(vec2f(0.0), vec2f(1.0), direction > vec2f(0.0));
    var cell = vec2f(0.0);
    var t = 0.0;
    for (var i = 0u; i < MAX_CELLS_BELOW; i++) {
        let exits = (cell + side - local_start) * inverse + still;
        let along_x = exits.x < exits.y;
        let exit = min(exits.x, exits.y);
        let local = clamp(local_start - cell + direction * t, vec2f(0.0), vec2f(1.0));
        let ray = cell_ray(
            corners_of(first_cell + cell), local, start.z + delta.z * t, t, vec3f(direction, delta.z));
        // Seen from below, the surface is the ray's height turned over.
        let below = CellRay(max(-ray.gap, 0.0), -ray.slope, -ray.bend, ray.rounding);
        let s = select(cell_root(below, min(exit, 1.0) - t), 0.0, ray.gap > ray.rounding);
        if s >= 0.0 {
            return min(t + s, 1.0);
        }
        t = max(t, exit);
        if t >= 1.0 {
            break;
        }
        cell += select(vec2f(0.0, 2.0 * side.y - 1.0), vec2f(2.0 * side.x - 1.0, 0.0), along_x);
    }
    return 2.0;
}
