// One axis of a walk from cell to cell that may jump. Positions are relative to the start cell.
// Twin of `Axis` in crates/heightfield/src/search/cone_walk.rs.

// Stands for "never": beyond any ray parameter, and finite.
const NEVER: f32 = 1e30;

struct WalkAxis {
    // Position at t = 0.
    start: f32,
    direction: f32,
    // 1 / direction; 0 when the ray does not move along this axis.
    inverse: f32,
    // The cell the ray is in, relative to the start cell.
    cell: i32,
    // Id of the start cell.
    first: i32,
    cells: i32,
    periodic: bool,
}

fn walk_axis_new(position: f32, direction: f32, cells: u32, periodic: bool) -> WalkAxis {
    let whole = floor(position);
    var axis: WalkAxis;
    axis.start = position - whole;
    axis.direction = direction;
    if abs(direction) > 1e-25 {
        axis.inverse = 1.0 / direction;
    }
    axis.first = i32(whole);
    axis.cells = i32(cells);
    axis.periodic = periodic;
    return axis;
}

// The id of the cell on the map. Beyond a clamped map the border cells go on.
fn walk_axis_id(axis: WalkAxis) -> u32 {
    let id = axis.first + axis.cell;
    if axis.periodic {
        let rest = id % axis.cells;
        return u32(select(rest, rest + axis.cells, rest < 0));
    }
    return u32(clamp(id, 0, axis.cells - 1));
}

// When the ray reaches the wall before it.
fn walk_axis_exit(axis: WalkAxis) -> f32 {
    if axis.inverse == 0.0 {
        return NEVER;
    }
    let wall = axis.cell + select(0, 1, axis.inverse > 0.0);
    return min((f32(wall) - axis.start) * axis.inverse, NEVER);
}

// The cell behind that wall.
fn walk_axis_next(axis: WalkAxis) -> i32 {
    return axis.cell + select(-1, 1, axis.inverse > 0.0);
}

// The cell that the ray is in at time `t`, never back and past every wall whose time has come.
fn walk_axis_place(axis: WalkAxis, t: f32) -> i32 {
    var placed = axis;
    let cell = i32(floor(axis.start + t * axis.direction));
    if axis.inverse > 0.0 {
        placed.cell = max(axis.cell, cell);
    } else if axis.inverse < 0.0 {
        placed.cell = min(axis.cell, cell);
    }
    if walk_axis_exit(placed) <= t {
        return walk_axis_next(placed);
    }
    return placed.cell;
}

// Position inside the cell at time `t`, 0..1.
fn walk_axis_local(axis: WalkAxis, t: f32) -> f32 {
    return clamp(axis.start - f32(axis.cell) + t * axis.direction, 0.0, 1.0);
}
