// Group 3, besides bindings/draw, of entries that find out for themselves what they see and what light meets: all
// meshes of the scene with the shells around them, one after the other in common buffers, and where they stand.
// Host: `crates/render/src/uniforms.rs`, `crates/render/src/shell/`.
#import "lib/height_info.wgsl"

struct MeshVertex {
    place: vec4f,          // position, object space; u
    up: vec4f,             // unit normal; v
    dpdu: vec4f,           // dP/du; x of the tangent
    dpdv: vec4f,           // dP/dv; y of the tangent
    dndu: vec4f,           // dN/du; z of the tangent
    dndv: vec4f,           // dN/dv; w of the tangent
}

struct ShellNode {
    low: vec3f,            // corners of the box, object space; of the topmost tree: relative to the camera
    first: u32,            // first of two children, or first of what it holds
    high: vec3f,
    count: u32,            // prisms or instances, or INNER_NODE where there are children
}

struct ShellPrism {
    face: u32,             // the triangle it stands on
    low: f32,              // where it begins and ends along the normals, mesh units for unit normals
    high: f32,
    strip: u32,            // number of a triangle of a strip, or PRISM, or PLAIN
}

// A mesh in its relief; numbers of the first of its parts in the common buffers.
struct Solid {
    heights: HeightInfo,
    nodes: u32,
    prisms: u32,
    strips: u32,
    vertices: u32,
    triangles: u32,
    corners: u32,
    pyramid: u32,
    endless: u32,          // 1 where the cells at the border go on for ever
    period: f32,           // tiles after which the map repeats, 0 for never
    radius: f32,           // of everything around the middle, mesh units
    pad_0: u32,
    pad_1: u32,
}

struct Instance {
    relative_from_object: mat4x4f,
    object_from_relative: mat4x4f,
    eye: vec4f,            // camera, object space
    solid: u32,
    pad_0: u32,
    pad_1: u32,
    pad_2: u32,
}

// Not 0: pixels that only lend their neighbours a derivative read zeros, and must not go down for ever.
const INNER_NODE: u32 = 0xffffffffu;
// What stands on a triangle is no strip but a prism full of heights, or the bare triangle.
const PRISM: u32 = 0xffffffffu;
const PLAIN: u32 = 0xfffffffeu;
// Where the bits of the edges begin.
const GOES_ON: u32 = 29u;

@group(3) @binding(1) var<storage, read> vertices: array<MeshVertex>;
// Three vertices; the sheet of surface that the triangle is part of, and a bit for each edge beyond which it goes on.
@group(3) @binding(2) var<storage, read> triangles: array<vec4u>;
@group(3) @binding(3) var<storage, read> shell_nodes: array<ShellNode>;
@group(3) @binding(4) var<storage, read> shell_prisms: array<ShellPrism>;
// Three corners a triangle: the bits of its place, and the weights of the mesh triangle's second and third corner in
// 16 bits each.
@group(3) @binding(5) var<storage, read> strips: array<vec4u>;
@group(3) @binding(6) var<storage, read> solid_heights: array<f32>;
@group(3) @binding(7) var<storage, read> solids: array<Solid>;
@group(3) @binding(8) var<storage, read> instances: array<Instance>;
@group(3) @binding(9) var<storage, read> top_nodes: array<ShellNode>;

// The solid that functions are about.
var<private> solid: Solid;

// A corner of a triangle of the solid.
fn corner_of(face: u32, corner: u32) -> MeshVertex {
    return vertices[solid.vertices + triangles[solid.triangles + face][corner]];
}

// The sheet that a triangle of the solid is part of: torn only along its borders.
fn sheet_of(face: u32) -> u32 {
    return triangles[solid.triangles + face].w & ((1u << GOES_ON) - 1u);
}

// Whether the sheet goes on beyond an edge of the triangle: 0 for that between its first two corners.
fn goes_on(face: u32, edge: u32) -> bool {
    return (triangles[solid.triangles + face].w >> (GOES_ON + edge) & 1u) == 1u;
}
