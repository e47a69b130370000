// Group 1 of techniques that read heights through a sampler.
#import "lib/height_info.wgsl"

@group(1) @binding(0) var height_texture: texture_2d<f32>;
@group(1) @binding(1) var height_sampler: sampler;
@group(1) @binding(2) var<uniform> height_info: HeightInfo;

// Set where the device cannot filter 32-bit float textures.
override manual_bilinear: bool = false;
