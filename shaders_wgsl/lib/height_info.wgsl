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
    // Levels of the max pyramid.
    level_count: u32,
    // Cells along x and y; one row and column of corners more.
    cells: vec2u,
    // Texel at the lower side of cell 0: 0, or -1 for clamp.
    first_texel: i32,
    // Highest corner of the map.
    highest: f32,
    // For each level: nodes along x and y, where it starts in the pyramid buffer, unused.
    levels: array<vec4u, 18>,
}
