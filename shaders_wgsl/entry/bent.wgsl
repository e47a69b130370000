// A mesh whose normal comes from slopes and its bend: surface/bump_exact.
#import "entry/stage_bent.wgsl"
#import "shading/mesh.wgsl"

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> Targets {
    return shade_on_mesh(in.position, seen(in, front));
}
