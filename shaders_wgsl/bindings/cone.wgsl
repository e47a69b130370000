// Group 1 of searches that step by cones: corner heights and cone ratios, laid out alike.
#import "lib/height_info.wgsl"

@group(1) @binding(0) var<storage, read> corners: array<f32>;
@group(1) @binding(1) var<storage, read> cones: array<f32>;
@group(1) @binding(2) var<uniform> height_info: HeightInfo;
