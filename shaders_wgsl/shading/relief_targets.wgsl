// What a fragment writes whose depth is not that of the geometry drawn.
#import "bindings/frame.wgsl"
#import "lib/targets.wgsl"

struct ReliefTargets {
    @location(0) color: vec4f,
    @location(1) trace: u32,
    @location(2) place: vec4f,
    @location(3) position: vec4f,
    @location(4) normal: vec4f,
    @location(5) ray_start: vec4f,
    @location(6) ray_delta: vec4f,
    @builtin(frag_depth) depth: f32,
}

// For the depth buffer, from the distance along the view axis. Reversed: 1 at the near plane, 0 at infinity, the
// same relative precision everywhere.
fn target_depth(depth: f32) -> f32 {
    return clamp(frame.forward.w / max(depth, frame.forward.w), 0.0, 1.0);
}

fn without_depth(out: ReliefTargets) -> Targets {
    return Targets(out.color, out.trace, out.place, out.position, out.normal, out.ray_start, out.ray_delta);
}
