// Group 2, for surface/tangent and surface/dot3: a tangent-space normal map, each component n * 0.5 + 0.5.

@group(2) @binding(3) var normal_texture: texture_2d<f32>;
@group(2) @binding(4) var normal_sampler: sampler;
