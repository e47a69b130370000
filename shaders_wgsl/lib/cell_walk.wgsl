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

// At most 2. Mesa 22.3 compiles anew for each picture what branches on uniforms only; see shading/branches.wgsl.
fn cell_wrap() -> u32 {
    return min(height_info.wrap, arrayLength(&corners));
}

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

// Height in 0..1 at texture coordinates `uv`, bilinear.
fn height_at(uv: vec2f) -> f32 {
    let place = uv * height_info.size - 0.5 - f32(height_info.first_texel);
    let periodic = cell_wrap() != 1u;
    let x = walk_axis_new(place.x, 0.0, height_info.cells.x, periodic);
    let y = walk_axis_new(place.y, 0.0, height_info.cells.y, periodic);
    let heights = cell_heights(cell_index(x, y));
    // Beyond a clamped map the border cells go on level.
    let local = vec2f(walk_axis_local(x, 0.0), walk_axis_local(y, 0.0));
    return mix(mix(heights.x, heights.y, local.x), mix(heights.z, heights.w, local.x), local.y);
}
