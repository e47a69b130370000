// Group 1 of the search through a distance map: corner heights, and least distances to the surface, one for
// each texel's footprint and slice of the height. A buffer and not a texture: each point has one voxel, nothing is
// filtered. Host: `crates/render/src/uniforms.rs`.
#import "lib/height_info.wgsl"

struct DistanceInfo {
    metric: vec3f,         // length of one unit of u, v and height, mesh units
    unit: f32,             // what code 1 stands for, mesh units
    size: vec3u,           // voxels along u, v and the height
    pad_0: u32,
}

struct Distances {
    info: DistanceInfo,
    codes: array<u32>,     // 16 bits each, two a word, the lower half first
}

@group(1) @binding(0) var<storage, read> corners: array<f32>;
@group(1) @binding(1) var<storage, read> distances: Distances;
@group(1) @binding(2) var<uniform> height_info: HeightInfo;
