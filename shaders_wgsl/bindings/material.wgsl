// Group 2: the material. Host: `crates/render/src/uniforms.rs`.

struct MaterialInfo {
    albedo_factor: vec4f,  // linear rgba
    map_width: f32,        // texels of the height map
    map_height: f32,
    scale: f32,            // height range, mesh units
    base: f32,             // height that lies on the mesh
    specular: f32,
    shininess: f32,
    period: f32,           // tiles after which the map repeats, 0 for never
    wrap: u32,             // WRAP_* of lib/slope_wrap.wgsl
}

@group(2) @binding(0) var<uniform> material: MaterialInfo;
@group(2) @binding(1) var albedo_texture: texture_2d<f32>;
@group(2) @binding(2) var albedo_sampler: sampler;
