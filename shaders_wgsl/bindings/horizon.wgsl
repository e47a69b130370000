// Group 2, for shading/shadow_horizon: sines of the horizon's elevation, one layer an azimuth. Host:
// `crates/render/src/uniforms.rs`.

struct HorizonInfo {
    tile_size: vec2f,      // mesh units of one tile, as the map was baked
    softness: f32,         // width of lights, radians
    azimuths: u32,
}

@group(2) @binding(7) var horizon_texture: texture_2d_array<f32>;
@group(2) @binding(8) var horizon_sampler: sampler;
@group(2) @binding(9) var<uniform> horizon_info: HorizonInfo;
