// Group 3, besides bindings/draw: the mesh itself, for entries that find out which of its triangles they see.
// Host: `crates/render/src/uniforms.rs`.

struct MeshVertex {
    place: vec4f,          // position, object space; u
    up: vec4f,             // unit normal; v
    dpdu: vec4f,           // dP/du; x of the tangent
    dpdv: vec4f,           // dP/dv; y of the tangent
    dndu: vec4f,           // dN/du; z of the tangent
    dndv: vec4f,           // dN/dv; w of the tangent
}

@group(3) @binding(1) var<storage, read> vertices: array<MeshVertex>;
@group(3) @binding(2) var<storage, read> triangles: array<u32>;
