// How far a ray has to be followed.

// Stands for "never": beyond any ray parameter, and finite.
const FAR: f32 = 1e30;

// When a ray has no surface ahead of it any more; FAR for one that sinks, for it ends in the surface.
//
// origin: in cells from the first; inverse: 1 / cells for one unit of time, 0 where it does not move; z, dz:
// height and its change; highest: of the map; period: cells; endless: whether the map ends in borders that
// go on for ever instead of coming again.
fn ray_end(
    origin: vec2f, inverse: vec2f, moves: vec2<bool>, z: f32, dz: f32, highest: f32, period: vec2f, endless: bool,
) -> f32 {
    if dz < 0.0 {
        return FAR;
    }
    if z > highest {
        return 0.0;
    }
    if dz > 0.0 {
        return (highest - z) / dz + 1e-6;
    }
    if endless {
        let ways = (select(vec2f(0.0), period, inverse > vec2f(0.0)) - origin) * inverse;
        return min(max(max(ways.x, ways.y), 0.0) * 1.000001 + 1e-6, FAR);
    }
    // Along an axis everything comes again after a period; aslant the ray may cross the whole plane.
    let twice = 2.0 * period * abs(inverse);
    return select(min(twice.x + twice.y, FAR), FAR, all(moves));
}

// The times at which a ray leaves a node or cell, when those at the border of the map go on for ever.
fn past_border(exits: vec2f, id: vec2f, first: vec2f, last: vec2f, ahead: vec2<bool>) -> vec2f {
    return select(exits, vec2f(FAR), id == select(first, last, ahead));
}
