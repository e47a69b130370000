//! How steeply the surface can rise from a cell to itself and to the eight around it.
//!
//! Inside one cell the surface along a line is a parabola, so its mean slope between two points is the
//! slope in the middle of them: the gradient there bounds it. A line from cell A that ends in a neighbour
//! rises no more steeply on the whole than on its steepest part, and the part inside a neighbour starts
//! on the side it shares with the line's last cell: the middle of that part lies in the near half of the
//! neighbour, and it leads away from that side.

use super::super::grid::Grid;

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

/// The steepest that ways in one quadrant can rise with slopes up to `most` along both axes, outwards, when they
/// end in a cell with slopes from `least` on where they fall.
///
/// Of the directions in which the cell may fall, the one closest to `most` counts.
fn ends_falling([u, v]: [f32; 2], least: [f32; 2]) -> f32 {
    let (rise_u, rise_v) = (u.max(0.0), v.max(0.0));
    if rise_u * least[0] + rise_v * least[1] < 0.0 {
        return (rise_u * rise_u + rise_v * rise_v).sqrt();
    }
    // Square to the gradient of the cell.
    let level = match least {
        [a, b] if a < 0.0 => [b, -a],
        [a, b] if b < 0.0 => [-b, a],
        _ => return 0.0,
    };
    let length = (level[0] * level[0] + level[1] * level[1]).sqrt();
    if length > 0.0 { (level[0].max(0.0) * u + level[1].max(0.0) * v).max(0.0) / length } else { 0.0 }
}

/// An upper bound for pairs of points with the lower one in a cell and the other there or next to it, at
/// which the surface falls outwards.
pub(super) fn near_falling(grid: &Grid<'_>, site: [i64; 2]) -> f32 {
    let mut square = 0.0_f32;
    let mut cells = [([0; 2], [[0.0_f32; 2]; 2]); 9];
    for (at, cell) in cells.iter_mut().enumerate() {
        let [x, y] = [at as i64 % 3 - 1, at as i64 / 3 - 1];
        let Sides { u, v } = Sides::new(grid.heights(grid.wrap([site[0] + x, site[1] + y])), grid.step);
        let ends = [u, v].map(|slopes| [slopes[0].min(slopes[1]), slopes[0].max(slopes[1])]);
        *cell = ([x, y], ends);
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
    let mut falling = 0.0_f32;
    for quadrant in [[1, 1], [-1, 1], [1, -1], [-1, -1]] {
        // Outwards, least and greatest.
        let outward = |axis: usize, [least, most]: [f32; 2]| {
            if quadrant[axis] > 0 { [least, most] } else { [-most, -least] }
        };
        for (place, ends) in cells {
            if place[0] * quadrant[0] >= 0 && place[1] * quadrant[1] >= 0 {
                // A straight way there leads through no cells but these.
                let passed = cells
                    .iter()
                    .filter(|(at, _)| (0..2).all(|axis| at[axis] == 0 || at[axis] == place[axis]));
                let mut most = [f32::NEG_INFINITY; 2];
                for (_, ends) in passed {
                    for (axis, most) in most.iter_mut().enumerate() {
                        *most = most.max(outward(axis, ends[axis])[1]);
                    }
                }
                let least = [outward(0, ends[0])[0], outward(1, ends[1])[0]];
                falling = falling.max(ends_falling(most, least));
            }
        }
    }
    square.sqrt().min(falling)
}
