// Group 3, besides bindings/draw, for entries that march: the lowest and the highest surface around each node of a
// quadtree over the map, and how steep it is at most. Host: `crates/render/src/bounds.rs`.

// Heights of all nodes, the lowest in the lower half and the highest in the upper; behind them the steepest rises,
// along u in the lower half and along v in the upper. All are 16-bit fixed point, 65535 being 1.
@group(3) @binding(10) var<storage, read> bounds: array<u32>;
