// What becomes of slopes beyond the border of their map.

const WRAP_REPEAT: u32 = 0u;
const WRAP_CLAMP: u32 = 1u;
const WRAP_MIRROR: u32 = 2u;

// The factor of dh/du (x) and dh/dv (y) at `uv`. Mirrored tiles turn slopes around, passing through 0
// at the seam; clamped heights stay level outside, reaching 0 half a texel beyond the border.
// `size`: texels of the map.
fn slope_factor(uv: vec2f, size: vec2f, wrap: u32) -> vec2f {
    if wrap == WRAP_CLAMP {
        return clamp(uv * size + 0.5, vec2f(0.0), vec2f(1.0))
            * clamp((1.0 - uv) * size + 0.5, vec2f(0.0), vec2f(1.0));
    }
    if wrap == WRAP_MIRROR {
        let tile = floor(uv);
        let within = uv - tile;
        let sign = 1.0 - 2.0 * (tile - 2.0 * floor(tile / 2.0));
        return sign * min(2.0 * min(within, 1.0 - within) * size, vec2f(1.0));
    }
    return vec2f(1.0);
}
