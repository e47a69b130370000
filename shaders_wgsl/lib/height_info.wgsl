// Layout of a height field as the shaders see it. Twin of `HeightInfo` in crates/render.

struct HeightInfo {
    // Texels along u and v.
    size: vec2f,
    // The height that lies on the mesh surface, 0..1.
    base: f32,
    // Mesh units between height 0 and height 1.
    scale: f32,
    // Mesh units covered by one tile along u and v.
    tile_size: vec2f,
    // 0 repeat, 1 clamp, 2 mirror.
    wrap: u32,
    // Finest depth of the skip pyramid.
    deepest: u32,
    // Cells along x and y of one period.
    cells: vec2u,
    // Depths at which the skip pyramid is still one node wide along x and y.
    lags: vec2u,
    // Texel at the lower side of cell 0: 0, or -1 for clamp.
    first_texel: i32,
    // Highest corner of the map.
    highest: f32,
    // A depth of n nodes starts at offset_bits & (n - 1) in the skip pyramid.
    offset_bits: u32,
    // Finest depth of the quadtree of bounds.
    bounds_depth: u32,
}
