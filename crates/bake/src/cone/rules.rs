//! Which rises count, for each kind of cone.

use heightfield::HeightField;

use super::grid::{Grid, Tile};
use super::near::near_falling;
use super::pair::{Patch, depth_of, steepest};
use super::search::{Apex, Rule};

/// Every rise between texel centres (Dummer 2006).
pub(super) struct EmptyTexel;

/// Rises to where the surface falls outwards: rays pierce cones once.
pub(super) struct Falling;

/// Rises to where sampled rays come out behind another texel (Policarpo and Oliveira 2007).
pub(super) struct FallingTexel<'a> {
    pub field: &'a HeightField,
}

/// Samples of a ray between the texel it goes in at and the floor, as in the published program.
const RAY_SAMPLES: u32 = 128;

/// The bound for neighbouring cells is raised by this, so that on smooth ground, where all cells on the way up
/// are about as steep, they need not be told apart.
const EASE: f32 = 1.0 + 1.0 / 256.0;

/// The bound for two cells.
fn between(grid: &Grid<'_>, apex: &Apex, offset: [i64; 2], heights: [f32; 4], best: f64) -> f64 {
    let [du, dv] = grid.step.map(f64::from);
    let patch = |[i, j]: [i64; 2], heights: [f32; 4]| Patch {
        low: [i as f64 * du, j as f64 * dv],
        high: [(i + 1) as f64 * du, (j + 1) as f64 * dv],
        heights: heights.map(f64::from),
    };
    let (a, b) = (patch([0, 0], apex.heights), patch(offset, heights));
    steepest(&a, &b, depth_of(offset[0].abs().max(offset[1].abs())), best)
}

fn touches(offset: [i64; 2]) -> bool {
    offset[0].abs() <= 1 && offset[1].abs() <= 1
}

impl Rule for EmptyTexel {
    const FIRST: i64 = 1;

    fn floor(&self, _grid: &Grid<'_>, _apex: &Apex) -> f32 {
        1.0
    }

    fn is_near(&self, offset: [i64; 2]) -> bool {
        offset == [0, 0]
    }

    fn admits(&self, _tile: &Tile, _low: [f32; 2], _high: [f32; 2]) -> bool {
        true
    }

    fn slope(&self, grid: &Grid<'_>, apex: &Apex, offset: [i64; 2], heights: [f32; 4], _best: f64) -> f64 {
        let [du, dv] = grid.step.map(f64::from);
        let distance = (offset[0] as f64 * du).hypot(offset[1] as f64 * dv);
        (f64::from(heights[0]) - f64::from(apex.heights[0])) / distance
    }
}

/// The least value of `dh/du * x + dh/dv * y` within bounds of all four.
fn least_outward_slope(gradient: [[f32; 2]; 2], low: [f32; 2], high: [f32; 2]) -> f32 {
    let least = |axis: usize| {
        let (g0, g1) = (gradient[0][axis], gradient[1][axis]);
        (g0 * low[axis]).min(g0 * high[axis]).min((g1 * low[axis]).min(g1 * high[axis]))
    };
    least(0) + least(1)
}

impl Rule for Falling {
    const FIRST: i64 = 0;

    fn floor(&self, grid: &Grid<'_>, apex: &Apex) -> f32 {
        (near_falling(grid, apex.site) * EASE).max(1.0)
    }

    fn is_near(&self, offset: [i64; 2]) -> bool {
        touches(offset)
    }

    fn admits(&self, tile: &Tile, low: [f32; 2], high: [f32; 2]) -> bool {
        least_outward_slope(tile.gradient, low, high) < 0.0
    }

    fn slope(&self, grid: &Grid<'_>, apex: &Apex, offset: [i64; 2], heights: [f32; 4], best: f64) -> f64 {
        let [h00, h10, h01, h11] = heights;
        let [du, dv] = grid.step;
        let (u, v) = ([(h10 - h00) / du, (h11 - h01) / du], [(h01 - h00) / dv, (h11 - h10) / dv]);
        let gradient = [[u[0].min(u[1]), v[0].min(v[1])], [u[0].max(u[1]), v[0].max(v[1])]];
        let way = |sign: i64| [0, 1].map(|axis| (offset[axis] + sign) as f32 * grid.step[axis]);
        if least_outward_slope(gradient, way(-1), way(1)) < 0.0 {
            between(grid, apex, offset, heights, best)
        } else {
            0.0
        }
    }
}

impl Rule for FallingTexel<'_> {
    const FIRST: i64 = 1;

    fn floor(&self, _grid: &Grid<'_>, _apex: &Apex) -> f32 {
        1.0
    }

    fn is_near(&self, offset: [i64; 2]) -> bool {
        offset == [0, 0]
    }

    fn admits(&self, _tile: &Tile, _low: [f32; 2], _high: [f32; 2]) -> bool {
        true
    }

    /// The ray comes from the lid over the apex, goes in at the other texel and is followed to the first
    /// sample above the surface. That lies farther out and lower than the texel: the slope is at most
    /// that to the texel itself, and falls from sample to sample.
    fn slope(&self, grid: &Grid<'_>, apex: &Apex, offset: [i64; 2], heights: [f32; 4], best: f64) -> f64 {
        let low = f64::from(apex.heights[0]);
        let inwards = f64::from(heights[0]);
        let first_texel = self.field.first_texel();
        let step = grid.step.map(f64::from);
        let way = [0, 1].map(|axis| offset[axis] as f64 * step[axis]);
        let start = [0, 1].map(|axis| ((apex.site[axis] + first_texel) as f64 + 0.5) * step[axis]);
        let distance = way[0].hypot(way[1]);
        let slope_at = |out: f64, z: f64| (z - low) / (out * distance);
        if slope_at(1.0, inwards) <= best || inwards >= 1.0 {
            return slope_at(1.0, inwards);
        }
        for sample in 1..=RAY_SAMPLES {
            let z = inwards * (1.0 - f64::from(sample) / f64::from(RAY_SAMPLES));
            let out = (1.0 - z) / (1.0 - inwards);
            let slope = slope_at(out, z);
            if slope <= best || self.field.height_at(start[0] + out * way[0], start[1] + out * way[1]) < z {
                return slope;
            }
        }
        0.0
    }
}
