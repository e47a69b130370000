// Rays through shells, and what they meet.
#import "bindings/solids.wgsl"
#import "lib/normalize.wgsl"

// Starts on any of the strips along the edges of its triangle.
const ANY_STRIP: u32 = 0xfffffffdu;
// Share of coordinates that rounding may take on the way through a shell: some ulps.
const SHELL_ROUNDING: f32 = 5e-7;

// Where on a solid a light ray starts: known by numbers, so that it cannot meet its own start.
struct ShellStart {
    face: u32,
    strip: u32,            // PRISM: on the relief over the triangle; PLAIN; ANY_STRIP; or a strip's triangle
    weights: vec2f,        // of the triangle's second and third corner
    height: f32,
}

struct ShellHit {
    found: bool,
    inside: bool,          // whether the surface was met from inside
    status: u32,           // 0 hit, 1 left, 2 unconverged
    steps: u32,
    t: f32,
    face: u32,
    strip: u32,            // PRISM, PLAIN, or a strip's triangle
    weights: vec2f,        // of the second and third corner
}

struct ShellRay {
    origin: vec3f,         // object space
    along: vec3f,          // unit
    across: mat3x3f,       // to the ray's own axes: the third runs along it
    first: f32,            // where it begins
    for_shadow: bool,      // anything hit will do
    starts_here: bool,     // on this solid, at `start`
    start: ShellStart,
    rounding: f32,         // how far places may be off, mesh units
}

fn shell_ray(origin: vec3f, direction: vec3f, first: f32) -> ShellRay {
    let z = normalize_or(direction, vec3f(0.0, 0.0, 1.0));
    let other = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(z.x) > 0.7);
    let x = normalize_or(cross(other, z), vec3f(1.0, 0.0, 0.0));
    var ray: ShellRay;
    ray.origin = origin;
    ray.along = z;
    ray.across = transpose(mat3x3f(x, cross(z, x), z));
    ray.first = first;
    let far = max(max(abs(origin.x), abs(origin.y)), abs(origin.z));
    ray.rounding = SHELL_ROUNDING * max(far, solid.radius);
    return ray;
}
