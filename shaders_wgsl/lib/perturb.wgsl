// Normals of a displaced surface from the slopes of its heights.
// Twin: `crates/render/src/surface/`. Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.
#import "lib/normalize.wgsl"
#import "lib/surface_frame.wgsl"

// Unit normal, in the space of the frame. `slope`: mesh units of height per tile along u and v.
// Holds for axes that are neither orthogonal nor of equal length; drops the term h dN/du, as Blinn does.
fn perturb_by_slope(surface: SurfaceFrame, slope: vec2f) -> vec3f {
    let plain = cross(surface.dpdu, surface.dpdv);
    let bent = plain
        + slope.x * cross(surface.normal, surface.dpdv)
        + slope.y * cross(surface.dpdu, surface.normal);
    // v runs down, so dpdu x dpdv points inward unless the chart is mirrored.
    let outward = select(-1.0, 1.0, dot(plain, surface.normal) >= 0.0);
    return normalize_or(bent * outward, surface.normal);
}

// Unit normal from a tangent-space normal, glTF convention: `tangent.w` times normal x tangent points
// up the image, along green.
fn perturb_by_map(normal: vec3f, tangent: vec4f, normal_ts: vec3f) -> vec3f {
    let bitangent = tangent.w * cross(normal, tangent.xyz);
    return normalize_or(
        normal_ts.x * tangent.xyz + normal_ts.y * bitangent + normal_ts.z * normal, normal);
}
