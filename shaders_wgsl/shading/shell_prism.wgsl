// Rays into the prisms of a shell.
#import "bindings/solids.wgsl"
#import "lib/prism_point.wgsl"
#import "shading/shell_ray.wgsl"

// The part of a ray in one prism, if there is any.
struct Crossing {
    crosses: bool,
    face: u32,
    prism: Prism,
    span: PrismSpan,
    uvs: mat3x2f,
    from_next: bool,       // whether the ray comes in through an edge beyond which its sheet goes on
    own: bool,             // whether it starts here
    own_sheet: bool,       // or on this sheet
}

// Texture space coordinates of a point of a prism.
fn in_texture(point: PrismPoint, uvs: mat3x2f, prism: Prism) -> vec3f {
    let w = vec3f(1.0 - point.weights.x - point.weights.y, point.weights);
    let normal = w.x * prism.n0 + w.y * prism.n1 + w.z * prism.n2;
    return vec3f(uvs * w, height_info.base + point.rise * length(normal) / height_info.scale);
}

// How much room the prism takes around a point, for steps in weights and rise; negative where it is turned inside out.
fn prism_volume(prism: Prism, point: PrismPoint) -> f32 {
    return determinant(prism_slopes(prism, point));
}

// Where a ray goes through a prism before `last`.
fn cross_prism(ray: ShellRay, shell_prism: ShellPrism, last: f32) -> Crossing {
    let a = corner_of(shell_prism.face, 0u);
    let b = corner_of(shell_prism.face, 1u);
    let c = corner_of(shell_prism.face, 2u);
    var crossing: Crossing;
    crossing.face = shell_prism.face;
    crossing.prism.p0 = ray.across * (a.place.xyz - ray.origin);
    crossing.prism.p1 = ray.across * (b.place.xyz - ray.origin);
    crossing.prism.p2 = ray.across * (c.place.xyz - ray.origin);
    crossing.prism.n0 = ray.across * a.up.xyz;
    crossing.prism.n1 = ray.across * b.up.xyz;
    crossing.prism.n2 = ray.across * c.up.xyz;
    crossing.uvs = mat3x2f(vec2f(a.place.w, a.up.w), vec2f(b.place.w, b.up.w), vec2f(c.place.w, c.up.w));
    crossing.span = prism_span(crossing.prism, shell_prism.low, shell_prism.high);
    let span = crossing.span;
    crossing.crosses = span.leave.t > max(span.enter.t, ray.first) && span.enter.t < last;
    // Over the triangle on which it starts a light ray is where its start's numbers say.
    let on_relief = ray.starts_here && ray.start.strip == PRISM;
    crossing.own = on_relief && shell_prism.face == ray.start.face;
    crossing.own_sheet = on_relief && sheet_of(shell_prism.face) == sheet_of(ray.start.face);
    // Not through a border of the sheet, where rays come in from outside above and below the surface.
    let begins = crossing.own || span.enter.t < ray.first;
    crossing.from_next = !begins && span.through != CAP && goes_on(shell_prism.face, span.through);
    return crossing;
}
