// Group 3: one mesh in the scene. In programs that trace rays through shells `bindings/draw_among_solids.wgsl` stands in
// for it.
#import "bindings/frame.wgsl"
#import "lib/draw_info.wgsl"

@group(3) @binding(0) var<uniform> draws: array<DrawInfo, 1>;

fn draw_info() -> DrawInfo {
    return draws[nought()];
}
