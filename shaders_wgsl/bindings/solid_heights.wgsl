// The heights of the solid that functions are about: in place of bindings/pyramid.wgsl in programs that trace rays
// through shells, where each solid of the scene has its own.
#import "bindings/solids.wgsl"

var<private> height_info: HeightInfo;
var<private> endless: bool;

// From here on functions are about this solid.
fn enter_solid(at: u32) {
    solid = solids[at];
    height_info = solid.heights;
    endless = solid.endless == 1u;
}

fn corners_of(cell: vec2f) -> vec4f {
    let count = vec2f(height_info.cells);
    let id = cell - f32(height_info.first_texel);
    var turned = id - floor(id / count) * count;
    // Divisions may be off by the last bit.
    turned = select(turned, turned - count, turned >= count);
    turned = select(turned, turned + count, turned < vec2f(0.0));
    let held = vec2u(select(turned, clamp(id, vec2f(0.0), count - 1.0), endless));
    let stride = height_info.cells.x + 1u;
    let at = solid.corners + held.y * stride + held.x;
    return vec4f(
        solid_heights[at], solid_heights[at + 1u], solid_heights[at + stride], solid_heights[at + stride + 1u]);
}

fn maximum_at(index: i32) -> f32 {
    return solid_heights[solid.pyramid + u32(index)];
}
