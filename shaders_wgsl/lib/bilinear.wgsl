// A ray against one bilinear cell: one quadratic. Ramsey, Potter and Hansen, Journal of Graphics Tools
// 9(3), 2004. Twin of `first_root` in crates/heightfield/src/search/exact.rs.

// Part of a height, or of a distance along the ray, that rounding may take: one ulp.
const ROUNDING: f32 = 1.2e-7;

// A ray inside one cell: its height above the patch is gap + s * (slope + s * bend).
struct CellRay {
    gap: f32,
    slope: f32,
    bend: f32,
    // How far rounding may be off in gap.
    rounding: f32,
}

// heights: h00, h10, h01, h11 (first digit along x); local: where the ray enters, 0..1; z: its height
// there; t: its parameter there; direction: cells and height for one unit of it.
fn cell_ray(heights: vec4f, local: vec2f, z: f32, t: f32, direction: vec3f) -> CellRay {
    let along = vec2f(heights.y - heights.x, heights.z - heights.x);
    let twist = (heights.w - heights.y) - along.y;
    let rise_x = (along.x + local.y * twist) * direction.x;
    let rise_y = (along.y + local.x * twist) * direction.y;
    let height = heights.x + local.x * (along.x + local.y * twist) + local.y * along.y;
    var ray: CellRay;
    ray.gap = z - height;
    ray.slope = direction.z - rise_x - rise_y;
    ray.bend = -twist * direction.x * direction.y;
    ray.rounding = ROUNDING * (1.0 + t * (abs(rise_x) + abs(rise_y)));
    return ray;
}

// First s in 0..length where the ray is on or below the patch, or -1. A ray that comes closer to the
// patch than rounding can tell touches it.
fn cell_root(ray: CellRay, length: f32) -> f32 {
    let discriminant = ray.slope * ray.slope - 4.0 * ray.bend * ray.gap;
    let root = sqrt(max(discriminant, 0.0));
    let leaving = ray.slope > 0.0;
    let numerator = select(2.0 * ray.gap, ray.slope + root, leaving);
    let denominator = select(root - ray.slope, -2.0 * ray.bend, leaving);
    let s = numerator / select(1.0, denominator, denominator > 0.0);
    let touches = discriminant + 4.0 * ray.bend * ray.rounding >= 0.0 && denominator > 0.0 && s <= length;
    return select(-1.0, s, touches);
}

// First s in 0..length where a ray that starts on the patch meets it again, or goes below it at once; or -1.
fn root_from_surface(ray: CellRay, length: f32) -> f32 {
    if ray.slope < 0.0 || (ray.slope == 0.0 && ray.bend < 0.0) {
        return 0.0;
    }
    if ray.bend < 0.0 && ray.slope <= -ray.bend * length {
        return -ray.slope / ray.bend;
    }
    return -1.0;
}
