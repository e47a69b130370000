// Group 3 of programs that trace rays through shells: one mesh in the scene.
#import "lib/draw_info.wgsl"

@group(3) @binding(0) var<storage, read> draw: DrawInfo;

fn draw_info() -> DrawInfo {
    return draw;
}
