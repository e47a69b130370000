// Parallax mapping: one height read where the ray meets the mesh surface, then the ray is moved to
// that height. Kaneko et al. 2001.
//
// start, delta: texture-space segment (u, v, z); cos_theta: cosine between ray and normal; stretch: the part of the
// segment that can meet the surface.
// Twin of crates/heightfield/src/search/parallax.rs.
#import "lib/found.wgsl"
#import "lib/height.wgsl"

fn search(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> Found {
    if delta.z >= 0.0 {
        return found_left(0u);
    }
    let surface = start + delta * ((height_info.base - start.z) / delta.z);
    let height = height_at(surface.xy);
    return found_hit(max((height - start.z) / delta.z, 0.0), 1u);
}

fn occluded(start: vec3f, delta: vec3f, cos_theta: f32, stretch: vec2f) -> bool {
    return false;
}

// One read is no march, and nothing to spare.
fn slack(cos_theta: f32) -> f32 {
    return NO_MARCH;
}
