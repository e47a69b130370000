// Group 3 of entries that trace rays through the shell around a mesh, besides bindings/triangles: a tree of boxes
// over the prisms that stand on its triangles. Host: `crates/render/src/uniforms.rs`, `crates/render/src/shell/`.

struct ShellNode {
    low: vec3f,            // corners of the box, object space
    first: u32,            // first of two children, or first prism
    high: vec3f,
    count: u32,            // prisms, or INNER_NODE where there are children
}

struct ShellPrism {
    face: u32,             // the triangle it stands on
    low: f32,              // where it begins and ends along the normals, mesh units for unit normals
    high: f32,
    unused: u32,
}

// Not 0: pixels that only lend their neighbours a derivative read zeros, and must not go down for ever.
const INNER_NODE: u32 = 0xffffffffu;

@group(3) @binding(3) var<storage, read> shell_nodes: array<ShellNode>;
@group(3) @binding(4) var<storage, read> shell_prisms: array<ShellPrism>;
