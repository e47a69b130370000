// A searched relief with a tangent-space normal map of its own: search/*, surface/tangent.
#import "entry/stage_framed.wgsl"
#import "shading/relief.wgsl"

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) -> ReliefTargets {
    return shade_relief(in.position, seen(in, front));
}

// Of draws that are sorted by their meshes: what is hidden is thrown away before any of this.
@fragment
fn fragment_apart(in: Varyings, @builtin(front_facing) front: bool) -> Targets {
    return without_depth(shade_relief(in.position, seen(in, front)));
}
