// Group 2, for surface/normal: slopes of the heights with mipmaps, dh/du and dh/dv per tile.

@group(2) @binding(3) var slope_texture: texture_2d<f32>;
@group(2) @binding(4) var slope_sampler: sampler;
