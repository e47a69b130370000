// Group 1 of the exact search: the height texture, never filtered, and the skip pyramid over its cells.
// In programs that trace rays through shells `bindings/solid_heights.wgsl` stands in for it.
#import "lib/height_info.wgsl"

@group(1) @binding(0) var height_texture: texture_2d<f32>;
@group(1) @binding(1) var height_sampler: sampler;
@group(1) @binding(2) var<uniform> height_info: HeightInfo;
@group(1) @binding(3) var<storage, read> pyramid: array<f32>;

// Whether the cells at the border go on for ever (clamp) instead of around it (repeat, mirror).
override endless: bool = false;

// Corner heights of the cell whose lower corner is texel `cell`: h00, h10, h01, h11.
fn corners_of(cell: vec2f) -> vec4f {
    return textureGather(0, height_texture, height_sampler, (cell + 1.0) / height_info.size).wzxy;
}

fn maximum_at(index: i32) -> f32 {
    return pyramid[index];
}
