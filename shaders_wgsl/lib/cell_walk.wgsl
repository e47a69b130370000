// Rays that go from cell to cell of a map whose corner heights lie in the buffer `corners`; shared by the searches
// that jump. Needs a bindings/*.wgsl with `corners` and `height_info`.
// Twin of crates/heightfield/src/search/cell_walk.rs.
#import "lib/bilinear.wgsl"
#import "lib/walk_axis.wgsl"

// Farther than this, in cells, 32 bits no longer tell cells apart.
const FARTHEST: f32 = 16777216.0;
// Farther from the surface than this, a start is not on it.
const ON_SURFACE: f32 = 1e-3;
// A light ray that enters a cell this close to its surface still leaves the point it started from: 8 ulps of 1.
const STILL_ON_SURFACE: f32 = 9.5e-7;

// Index of the cell that the ray is in.
fn cell_index(x: WalkAxis, y: WalkAxis) -> u32 {
    return walk_axis_id(y) * (height_info.cells.x + 1u) + walk_axis_id(x);
}

// The four corner heights of a cell.
fn cell_heights(index: u32) -> vec4f {
    let below = index + height_info.cells.x + 1u;
    return vec4f(corners[index], corners[index + 1u], corners[below], corners[below + 1u]);
}

// The ray in its cell at time `t`, at height `z`.
fn ray_in_cell(x: WalkAxis, y: WalkAxis, z: f32, t: f32, direction: vec3f) -> CellRay {
    let local = vec2f(walk_axis_local(x, t), walk_axis_local(y, t));
    return cell_ray(cell_heights(cell_index(x, y)), local, z, t, direction);
}

// The first root within `length` of a ray against the cell it is in, or less than 0. `leaves`: from its surface.
fn root_in_cell(ray: CellRay, length: f32, leaves: bool) -> f32 {
    if leaves {
        return root_from_surface(ray, length);
    }
    return cell_root(ray, length);
}
