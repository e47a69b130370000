//! How steeply the surface can rise from a cell to itself and to the eight around it.
//!
//! Inside one cell the surface along a line is a parabola, so its mean slope between two points is the
//! slope in the middle of them: the gradient there bounds it. A line from cell A that ends in a neighbour
//! rises no more steeply on the whole than on its steepest part, and the part inside a neighbour starts
//! on the side it shares with the line's last cell: the middle of that part lies in the near half of the
//! neighbour, and it leads away from that side.

use super::grid::Grid;

/// Partial derivatives along the four sides of a cell, per UV unit: `dh/du` above and below, `dh/dv`
/// left and right.
struct Sides {
    u: [f32; 2],
    v: [f32; 2],
}

impl Sides {
    fn new([h00, h10, h01, h11]: [f32; 4], [du, dv]: [f32; 2]) -> Self {
        Self { u: [(h10 - h00) / du, (h11 - h01) / du], v: [(h01 - h00) / dv, (h11 - h10) / dv] }
    }
}

/// The greatest slope that leads in direction `sign`, not below 0.
fn onward(slopes: [f32; 2], sign: i64) -> f32 {
    if sign > 0 { slopes[0].max(slopes[1]).max(0.0) } else { (-slopes[0].min(slopes[1])).max(0.0) }
}

/// The greatest slope either way in the half of a cell that is entered first.
fn near_half(slopes: [f32; 2], sign: i64) -> f32 {
    let nearest = if sign > 0 { slopes[0] } else { slopes[1] };
    nearest.abs().max((0.5 * (slopes[0] + slopes[1])).abs())
}

/// An upper bound for pairs of points with the lower one in a cell and the other there or next to it, at
/// which the surface falls outwards: a slope that turns negative along the way has changed by more than its
/// mean.
pub(super) fn near_falling(grid: &Grid<'_>, site: [i64; 2]) -> f32 {
    let mut square = 0.0_f32;
    let mut range = [[f32::INFINITY, f32::NEG_INFINITY]; 2];
    for y in -1..=1_i64 {
        for x in -1..=1_i64 {
            let Sides { u, v } = Sides::new(grid.heights(grid.wrap([site[0] + x, site[1] + y])), grid.step);
            for (range, slopes) in range.iter_mut().zip([u, v]) {
                range[0] = range[0].min(slopes[0].min(slopes[1]));
                range[1] = range[1].max(slopes[0].max(slopes[1]));
            }
            let along_u = match (x, y) {
                (0, 0) => u[0].abs().max(u[1].abs()),
                (0, _) => near_half(u, y),
                _ => onward(u, x),
            };
            let along_v = match (x, y) {
                (0, 0) => v[0].abs().max(v[1].abs()),
                (_, 0) => near_half(v, x),
                _ => onward(v, y),
            };
            square = square.max(along_u * along_u + along_v * along_v);
        }
    }
    let any = square.sqrt();
    let turn = (range[0][1] - range[0][0]).hypot(range[1][1] - range[1][0]);
    any.min(turn)
}
