// Group 1 of the exact search: corner heights and the max pyramid over the cells.
#import "lib/height_info.wgsl"

@group(1) @binding(0) var<storage, read> corners: array<f32>;
@group(1) @binding(1) var<storage, read> pyramid: array<f32>;
@group(1) @binding(2) var<uniform> height_info: HeightInfo;
