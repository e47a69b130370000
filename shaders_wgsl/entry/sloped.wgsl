// A mesh whose normal comes from slopes: surface/bump and its kin, surface/normal.
#import "entry/stage_sloped.wgsl"
#import "shading/mesh.wgsl"

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> Targets {
    return shade_on_mesh(in.position, seen(in, front));
}
