// A mesh with nothing but its normals: surface/flat, surface/bump_derivative.
#import "entry/stage_plain.wgsl"
#import "shading/mesh.wgsl"

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> Targets {
    return shade_on_mesh(in.position, seen(in, front));
}
