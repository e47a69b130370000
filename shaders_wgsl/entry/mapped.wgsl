// A mesh with a tangent-space normal map of its own: surface/tangent.
#import "entry/stage_mapped.wgsl"
#import "shading/mesh.wgsl"

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> Targets {
    return shade_on_mesh(in.position, seen(in, front));
}
