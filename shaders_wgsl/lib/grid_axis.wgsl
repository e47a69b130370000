// One axis of a walk over a grid of nodes: which node the ray is in, and where its sides are.
// Positions are relative to the lower side of the start cell, so distances keep their precision.
// Twin of `Axis` in crates/heightfield/src/search/exact.rs.

// Stands for "never": beyond any ray parameter, and finite.
const FAR: f32 = 1e30;

struct GridAxis {
    // Position at t = 0.
    start: f32,
    // 1 / direction; 0 when the ray does not move along this axis.
    inverse: f32,
    // Node id at the current level.
    node: u32,
    // Cell id 0 of the current tile, relative to the start cell.
    tile: i32,
    // Cells in a tile.
    cells: u32,
    periodic: bool,
}

fn axis_new(position: f32, direction: f32, cells: u32, periodic: bool) -> GridAxis {
    let n = f32(cells);
    let whole = floor(position);
    let cell = clamp(select(whole, whole - floor(whole / n) * n, periodic), 0.0, n - 1.0);
    var axis: GridAxis;
    axis.start = position - select(cell, whole, periodic);
    axis.inverse = 0.0;
    if abs(direction) > 1e-25 {
        axis.inverse = 1.0 / direction;
    }
    axis.node = u32(cell);
    axis.tile = -i32(cell);
    axis.cells = cells;
    axis.periodic = periodic;
    return axis;
}

// When the ray reaches a plane between cells. Grows with the distance of the plane.
fn axis_time_of(axis: GridAxis, plane: i32) -> f32 {
    return (f32(plane) - axis.start) * axis.inverse;
}

// When the ray leaves the node.
fn axis_exit(axis: GridAxis, level: u32) -> f32 {
    if axis.inverse == 0.0 {
        return FAR;
    }
    if axis.inverse > 0.0 {
        let upper = min((axis.node + 1u) << level, axis.cells);
        if !axis.periodic && upper == axis.cells {
            return FAR;
        }
        return min(axis_time_of(axis, i32(upper) + axis.tile), FAR);
    }
    let lower = axis.node << level;
    if !axis.periodic && lower == 0u {
        return FAR;
    }
    return min(axis_time_of(axis, i32(lower) + axis.tile), FAR);
}

// Whether the next step leaves the parent node.
fn axis_crosses_parent(axis: GridAxis) -> bool {
    return (axis.node & 1u) == select(0u, 1u, axis.inverse > 0.0);
}

// The next node along the ray, of `nodes` at this level.
fn axis_advance(axis: GridAxis, nodes: u32) -> GridAxis {
    var next = axis;
    if axis.inverse > 0.0 {
        next.node += 1u;
        if next.node == nodes {
            next.node = 0u;
            next.tile += i32(axis.cells);
        }
    } else {
        if axis.node == 0u {
            next.node = nodes;
            next.tile -= i32(axis.cells);
        }
        next.node -= 1u;
    }
    return next;
}

// The child that the ray is in at time `t`.
fn axis_descend(axis: GridAxis, level: u32, t: f32) -> GridAxis {
    var child = axis;
    child.node = 2u * axis.node;
    let middle = (child.node + 1u) << (level - 1u);
    if middle >= axis.cells {
        return child;
    }
    let plane = i32(middle) + axis.tile;
    var in_upper: bool;
    if axis.inverse > 0.0 {
        in_upper = t >= axis_time_of(axis, plane);
    } else if axis.inverse < 0.0 {
        in_upper = t < axis_time_of(axis, plane);
    } else {
        in_upper = axis.start >= f32(plane);
    }
    child.node += select(0u, 1u, in_upper);
    return child;
}

// Position inside cell `node` (level 0) at time `t`, 0..1.
fn axis_local(axis: GridAxis, t: f32, direction: f32) -> f32 {
    return clamp(axis.start - f32(i32(axis.node) + axis.tile) + t * direction, 0.0, 1.0);
}
