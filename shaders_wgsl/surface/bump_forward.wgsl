// bump_forward: as bump, from forward differences: three reads instead of four.
// Source: the two-texture embossing of fixed-function hardware; Blinn, SIGGRAPH 1978, for the formula.
#import "lib/perturb.wgsl"
#import "lib/read_slope.wgsl"

fn shading_normal(point: SurfacePoint) -> vec3f {
    return perturb_general(point.surface, forward_slope(point));
}
