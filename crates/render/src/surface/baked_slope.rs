//! Slopes baked at the texels, in mesh units a tile along u and v. Twin of
//! `shaders_wgsl/lib/baked_slope.wgsl`, without mipmaps.

use glam::{DVec2, Vec2};
use heightfield::HeightField;

/// The slope at `uv`, from `slopes` as `bake::slopes` gives them.
pub fn baked_slope(field: &HeightField, slopes: &[[f32; 2]], uv: Vec2) -> DVec2 {
    let (width, height) = (field.width(), field.height());
    let place = uv * Vec2::new(width as f32, height as f32) - 0.5;
    let cell = place.floor();
    let within = place - cell;
    let texel = |i: i64, j: i64| {
        let (x, y) = (cell.x as i64 + i, cell.y as i64 + j);
        let (column, row) = (field.wrap().index(x, width), field.wrap().index(y, height));
        let factor = Vec2::new(factor(field, x, width), factor(field, y, height));
        Vec2::from(slopes[row * width + column]) * factor
    };
    let top = texel(0, 0).lerp(texel(1, 0), within.x);
    let bottom = texel(0, 1).lerp(texel(1, 1), within.x);
    (field.extent().scale * top.lerp(bottom, within.y)).as_dvec2()
}

/// What becomes of a slope at texel `i` of `n`: turned around in mirrored tiles, none beyond a clamped edge.
fn factor(field: &HeightField, i: i64, n: usize) -> f32 {
    let n = n as i64;
    match field.wrap() {
        heightfield::Wrap::Repeat => 1.0,
        heightfield::Wrap::Clamp => f32::from(u8::from((0..n).contains(&i))),
        heightfield::Wrap::Mirror => {
            if i.div_euclid(n) % 2 == 0 {
                1.0
            } else {
                -1.0
            }
        }
    }
}
