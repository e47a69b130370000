// Normals of a displaced surface from the slopes of its heights: four formulas, from the plainest to the
// exact one. All: unit, in the space of the frame; `slope`: mesh units of height per tile along u and v.
// Twin: `crates/render/src/surface/formula.rs`, in double precision.
// Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978; Mikkelsen, "Surface Gradient-Based Bump
// Mapping Framework", JCGT 2020.
#import "lib/normalize.wgsl"
#import "lib/surface_frame.wgsl"

// 1, or -1 where the axes turn the other way: v runs down, so dpdu x dpdv points inward unless the chart
// is mirrored.
fn outward(surface: SurfaceFrame) -> f32 {
    return select(-1.0, 1.0, dot(cross(surface.dpdu, surface.dpdv), surface.normal) >= 0.0);
}

// `v` without its part along the normal.
fn in_surface(surface: SurfaceFrame, v: vec3f) -> vec3f {
    return v - surface.normal * dot(surface.normal, v);
}

// As if the axes were orthogonal: off where the mapping is sheared.
fn perturb_orthogonal(surface: SurfaceFrame, slope: vec2f) -> vec3f {
    let along = normalize_or(in_surface(surface, surface.dpdu), vec3f(0.0));
    let down = cross(surface.normal, along) * outward(surface);
    let u = slope.x / max(length(surface.dpdu), 1e-30);
    let v = slope.y / max(length(surface.dpdv), 1e-30);
    return normalize_or(surface.normal - u * along - v * down, surface.normal);
}

// Axes at any angle and of any length. Level heights keep the smooth normal. Drops the term h dN/du.
fn perturb_general(surface: SurfaceFrame, slope: vec2f) -> vec3f {
    let volume = dot(cross(surface.dpdu, surface.dpdv), surface.normal);
    let bent = volume * surface.normal
        + slope.x * cross(surface.normal, surface.dpdv)
        + slope.y * cross(surface.dpdu, surface.normal);
    return normalize_or(bent * outward(surface), surface.normal);
}

// As Blinn has it: the normal to be bent is that of the axes, which on interpolated frames is not quite
// the smooth one.
fn perturb_blinn(surface: SurfaceFrame, slope: vec2f) -> vec3f {
    let bent = cross(surface.dpdu, surface.dpdv)
        + slope.x * cross(surface.normal, surface.dpdv)
        + slope.y * cross(surface.dpdu, surface.normal);
    return normalize_or(bent * outward(surface), surface.normal);
}

// The displaced surface's own: with the term that Blinn drops. `rise`: mesh units from the mesh surface to
// the displaced one; `dndu`, `dndv`: derivatives of the unit normal, per tile.
fn perturb_exact(surface: SurfaceFrame, dndu: vec3f, dndv: vec3f, slope: vec2f, rise: f32) -> vec3f {
    let along_u = in_surface(surface, surface.dpdu + rise * dndu) + slope.x * surface.normal;
    let along_v = in_surface(surface, surface.dpdv + rise * dndv) + slope.y * surface.normal;
    return normalize_or(cross(along_u, along_v) * outward(surface), surface.normal);
}

// Unit normal from a tangent-space normal, glTF convention: `tangent.w` times normal x tangent points
// up the image, along green.
fn perturb_by_map(normal: vec3f, tangent: vec4f, normal_ts: vec3f) -> vec3f {
    let bitangent = tangent.w * cross(normal, tangent.xyz);
    return normalize_or(
        normal_ts.x * tangent.xyz + normal_ts.y * bitangent + normal_ts.z * normal, normal);
}
