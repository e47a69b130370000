// Whether a light stands above the horizon. Twin of crates/heightfield/src/horizon.rs.
// Nelson Max, Horizon Mapping: Shadows for Bump-Mapped Surfaces, The Visual Computer 4(2), 1988.

const FULL_TURN: f32 = 6.28318530718;

// Azimuth of a direction (x right, y up the image) as a share of the full turn, 0..1.
fn horizon_turns(direction: vec2f) -> f32 {
    if direction.x == 0.0 && direction.y == 0.0 {
        return 0.0;
    }
    return fract(atan2(direction.y, direction.x) / FULL_TURN);
}

// The share hidden, 0..1, of a light at an elevation by a horizon, both as sines. softness: the width of
// the light as an angle in radians, 0 for all or nothing.
fn horizon_hides(light_sine: f32, horizon_sine: f32, softness: f32) -> f32 {
    if softness <= 0.0 {
        return select(0.0, 1.0, light_sine < horizon_sine);
    }
    let above = asin(clamp(light_sine, 0.0, 1.0)) - asin(clamp(horizon_sine, 0.0, 1.0));
    return clamp(0.5 - above / softness, 0.0, 1.0);
}
