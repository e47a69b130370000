//! Slopes of the heights next to a point, in mesh units a tile along u and v. Twin of
//! `shaders_wgsl/lib/read_slope.wgsl`. `reach`: how far to look, in uv, at least a texel.

use glam::{DVec2, Vec2};
use heightfield::HeightField;

/// Half the difference between the two sides: second order in the reach.
pub fn central_slope(field: &HeightField, uv: Vec2, reach: Vec2) -> DVec2 {
    let rise = Vec2::new(
        field.sample(uv.x + reach.x, uv.y) - field.sample(uv.x - reach.x, uv.y),
        field.sample(uv.x, uv.y + reach.y) - field.sample(uv.x, uv.y - reach.y),
    );
    (field.extent().scale * rise / (2.0 * reach)).as_dvec2()
}

/// The difference to the next point along each axis: first order.
pub fn forward_slope(field: &HeightField, uv: Vec2, reach: Vec2) -> DVec2 {
    let here = field.sample(uv.x, uv.y);
    let rise =
        Vec2::new(field.sample(uv.x + reach.x, uv.y) - here, field.sample(uv.x, uv.y + reach.y) - here);
    (field.extent().scale * rise / reach).as_dvec2()
}
