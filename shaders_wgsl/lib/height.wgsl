// The one place where a search reads a height: bilinear, level 0, wrapped.
// Twin of `HeightField::sample` in crates/heightfield/src/field.rs.
#import "bindings/heights.wgsl"

fn wrap_index(i: i32, n: i32, wrap: u32) -> i32 {
    if wrap == 1u {
        return clamp(i, 0, n - 1);
    }
    if wrap == 2u {
        let m = i - i32(floor(f32(i) / f32(2 * n))) * 2 * n;
        return clamp(select(2 * n - 1 - m, m, m < n), 0, n - 1);
    }
    return clamp(i - i32(floor(f32(i) / f32(n))) * n, 0, n - 1);
}

fn texel_height(texel: vec2i) -> f32 {
    let size = vec2i(height_info.size);
    let x = wrap_index(texel.x, size.x, height_info.wrap);
    let y = wrap_index(texel.y, size.y, height_info.wrap);
    return textureLoad(height_texture, vec2i(x, y), 0).r;
}

fn height_bilinear(uv: vec2f) -> f32 {
    let p = uv * height_info.size - 0.5;
    let cell = floor(p);
    let f = p - cell;
    let i = vec2i(cell);
    let top = mix(texel_height(i), texel_height(i + vec2i(1, 0)), f.x);
    let bottom = mix(texel_height(i + vec2i(0, 1)), texel_height(i + vec2i(1, 1)), f.x);
    return mix(top, bottom, f.y);
}

// Height in 0..1 at texture coordinates `uv`.
fn height_at(uv: vec2f) -> f32 {
    if manual_bilinear {
        return height_bilinear(uv);
    }
    return textureSampleLevel(height_texture, height_sampler, uv, 0.0).r;
}
