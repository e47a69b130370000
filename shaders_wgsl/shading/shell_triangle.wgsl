// Rays against what is flat in a shell: strips along seams and hard edges, and meshes without relief.
#import "lib/prism.wgsl"
#import "shading/shell_ray.wgsl"
#import "shading/shell_sides.wgsl"

struct FlatTriangle {
    places: array<vec3f, 3>,
    weights: array<vec2f, 3>,
}

// strip: number of a triangle of a strip, or PLAIN for that of the mesh.
fn flat_triangle(face: u32, strip: u32) -> FlatTriangle {
    var flat: FlatTriangle;
    if strip == PLAIN {
        flat.weights = array<vec2f, 3>(vec2f(0.0), vec2f(1.0, 0.0), vec2f(0.0, 1.0));
        for (var i = 0u; i < 3u; i++) {
            flat.places[i] = corner_of(face, i).place.xyz;
        }
        return flat;
    }
    for (var i = 0u; i < 3u; i++) {
        let corner = strips[solid.strips + 3u * strip + i];
        flat.places[i] = bitcast<vec3f>(corner.xyz);
        flat.weights[i] = unpack2x16unorm(corner.w);
    }
    return flat;
}

fn across_flat(flat: FlatTriangle) -> vec3f {
    return cross(flat.places[1] - flat.places[0], flat.places[2] - flat.places[0]);
}

// A point of the triangle that a hit is on: places found from far away may be off its plane.
fn on_flat(hit: ShellHit, place: vec3f) -> vec3f {
    let flat = flat_triangle(hit.face, hit.strip);
    let normal = normalize_or(across_flat(flat), vec3f(0.0));
    return place + dot(flat.places[0] - place, normal) * normal;
}

// The hit on a triangle where it is nearer than `best`.
fn through_triangle(ray: ShellRay, prism: ShellPrism, best: ShellHit) -> ShellHit {
    let near_start = ray.starts_here && prism.face == ray.start.face;
    let own = prism.strip == ray.start.strip || (prism.strip != PLAIN && ray.start.strip == ANY_STRIP);
    if near_start && own {
        return best;
    }
    let flat = flat_triangle(prism.face, prism.strip);
    let a = ray.across * (flat.places[0] - ray.origin);
    let b = ray.across * (flat.places[1] - ray.origin);
    let c = ray.across * (flat.places[2] - ray.origin);
    let shares = vec3f(cross_2d(b.xy, c.xy), cross_2d(c.xy, a.xy), cross_2d(a.xy, b.xy));
    let sum = shares.x + shares.y + shares.z;
    // Seen along the ray, its front turns clockwise.
    let from_behind = sum > 0.0;
    // The light sees as much of a strip as the eye would from there. Where sheets run through each other strips fold
    // back over them, and would else keep the light off what the eye sees through them.
    let unlit = prism.strip != PLAIN && !from_behind;
    if sum == 0.0 || select(from_behind && !sees_inside, unlit, ray.for_shadow) {
        return best;
    }
    let w = shares / sum;
    let t = dot(w, vec3f(a.z, b.z, c.z));
    if min(w.x, min(w.y, w.z)) < -PRISM_SLACK || !(t > ray.first && t < best.t) {
        return best;
    }
    // A start nearer to the triangle than rounding is on it: `sum` is the product of `along` and the normal.
    if ray.starts_here && t * abs(sum) <= ray.rounding * length(across_flat(flat)) {
        return best;
    }
    var hit = best;
    hit.found = true;
    hit.inside = from_behind;
    hit.status = 0u;
    hit.t = t;
    hit.face = prism.face;
    hit.strip = prism.strip;
    hit.weights = w.x * flat.weights[0] + w.y * flat.weights[1] + w.z * flat.weights[2];
    return hit;
}
