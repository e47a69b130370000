// Group 2, for surface/dot3: the unit vector towards each texel of a cube, 8 bits a component.

@group(2) @binding(5) var normalization_cube: texture_cube<f32>;
@group(2) @binding(6) var normalization_sampler: sampler;
