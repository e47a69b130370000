// The frame of a textured surface: how a direction in mesh units looks in texture space.
// Twin: `crates/render/src/surface/frame.rs`. Source: techniques.md's classic parametrisation,
// Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.

struct SurfaceFrame {
    dpdu: vec3f,    // dP/du, mesh units per tile, not normalised
    dpdv: vec3f,    // dP/dv, mesh units per tile, not normalised; v runs down the image
    normal: vec3f,  // unit, object space
}

// `v` as `a * dpdu + b * dpdv + c * normal`. A true inverse, not three dot products: the axes
// need be neither orthogonal nor of equal length. Where the texture mapping is degenerate the
// lateral coordinates are 0.
fn frame_coordinates(surface: SurfaceFrame, v: vec3f) -> vec3f {
    let across_u = cross(surface.dpdv, surface.normal);
    let across_v = cross(surface.normal, surface.dpdu);
    let across_n = cross(surface.dpdu, surface.dpdv);
    let volume = dot(surface.dpdu, across_u);
    let largest = length(surface.dpdu) * length(surface.dpdv);
    if !(abs(volume) > 1e-6 * largest) || !(abs(volume) > 1e-30) {
        return vec3f(0.0, 0.0, dot(surface.normal, v));
    }
    return vec3f(dot(v, across_u), dot(v, across_v), dot(v, across_n)) / volume;
}
