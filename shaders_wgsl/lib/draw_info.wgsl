// One mesh in the scene. Object space here has its origin at the middle of the mesh, so that far-off coordinates lose no
// digits. Host: `crates/render/src/uniforms.rs`.

struct DrawInfo {
    relative_from_object: mat4x4f,   // to camera-relative world space
    object_from_relative: mat4x4f,   // its inverse; transposed, it takes normals to world space
    eye: vec4f,                      // camera, object space; w is 1
    low: vec4f,                      // corners of the box around what shows of it, object space; w unused
    high: vec4f,
    light_place: vec4f,              // the first light, as in bindings/frame.wgsl: read from here it costs less
    light_color: vec4f,
    most_heights: vec3f,             // times the way from the eye: heights that a hit may be off
    most_texels: f32,                // texels that it may be off in place of that
    span: vec2f,                     // the lowest and the highest point of the map
    own: vec2u,                      // its number among the instances that cast shadows, and of its solid
}
