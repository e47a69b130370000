// A ray against one bilinear cell. Twin of `first_root` in crates/heightfield/src/search/exact.rs.

// Height of the patch at `local`, 0..1 along x and y. heights: h00, h10, h01, h11 (first digit along x).
fn bilinear_height(heights: vec4f, local: vec2f) -> f32 {
    let along = vec2f(heights.y - heights.x, heights.z - heights.x);
    let twist = (heights.w - heights.y) - (heights.z - heights.x);
    return heights.x + local.x * along.x + local.y * (along.y + local.x * twist);
}

// First `s` in 0..length where the ray is on or below the patch, or -1.
//
// local: where the ray enters; gap: its height above the patch there; direction: cells and height for
// one unit of s. With on_surface the start is itself a root and only the other one counts.
fn bilinear_root(heights: vec4f, local: vec2f, gap: f32, direction: vec3f, length: f32, on_surface: bool) -> f32 {
    let along = vec2f(heights.y - heights.x, heights.z - heights.x);
    let twist = (heights.w - heights.y) - (heights.z - heights.x);
    let slope = direction.z - (along.x + local.y * twist) * direction.x - (along.y + local.x * twist) * direction.y;
    let bend = -twist * direction.x * direction.y;
    if on_surface {
        if slope < 0.0 || (slope == 0.0 && bend < 0.0) {
            return 0.0;
        }
        if bend < 0.0 && slope <= -bend * length {
            return -slope / bend;
        }
        return -1.0;
    }
    if gap <= 0.0 {
        return 0.0;
    }
    var root = -1.0;
    if bend == 0.0 {
        if slope < 0.0 {
            root = -gap / slope;
        }
    } else {
        let discriminant = slope * slope - 4.0 * bend * gap;
        if discriminant >= 0.0 {
            let square_root = sqrt(discriminant);
            let q = 0.5 * select(square_root - slope, -(slope + square_root), slope >= 0.0);
            if q > 0.0 {
                root = gap / q;
            } else if q < 0.0 && bend < 0.0 {
                root = q / bend;
            }
        }
    }
    return select(-1.0, root, root <= length);
}
