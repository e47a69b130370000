//! Branch and bound for neighbouring cells side by side: all lanes walk one stack of nodes.

use heightfield::lanes::Lanes;

use super::super::grid::{Bounds, Grid, Node, Stack, Tile};
use super::cells::{steepest, touches};

/// What a distance may be too long by through rounding, UV units.
const GAP_MARGIN: f32 = 1e-6;
/// Single-precision tests ask for this part of the slope known: what they round away stays below the other part.
const CAUTION: f32 = 1.0 - 3e-7;
/// Most lanes.
const MOST: usize = 16;

/// Cells in a row and what is known of them.
pub(super) struct Packet<'a, L: Lanes> {
    grid: &'a Grid<'a>,
    /// The first cell, as a site of the grid.
    first: [i64; 2],
    /// Middles of the cells across, from the first site; UV units.
    u: L::F,
    /// Half of a cell's extent.
    half: [f32; 2],
    /// Heights `[h00, h10, h01, h11]`.
    heights: [L::F; 4],
    corners: [[f32; MOST]; 4],
    lowest: L::F,
    /// Slopes that nobody needs to know more about.
    enough: [f32; MOST],
    /// The steepest rise known.
    pub slopes: [f32; MOST],
    /// The cell it leads to, as a site; may lie on another period.
    pub partners: [Option<[i32; 2]>; MOST],
}

impl<'a, L: Lanes> Packet<'a, L> {
    /// Cells from site `first` on. `slopes` are what they have to exceed; those that reach `enough` are done with.
    #[inline(always)]
    pub fn new(
        grid: &'a Grid<'a>,
        first: [i64; 2],
        heights: [&[f32]; 4],
        slopes: &[f32],
        enough: &[f32],
    ) -> Self {
        let half = grid.step.map(|step| 0.5 * step);
        let mut u = [0.0; MOST];
        for (k, u) in u.iter_mut().enumerate() {
            *u = k as f32 * grid.step[0] + half[0];
        }
        let heights = heights.map(L::load);
        let [h00, h10, h01, h11] = heights;
        let mut packet = Self {
            grid,
            first,
            u: L::load(&u),
            half,
            heights,
            corners: [[0.0; MOST]; 4],
            lowest: L::min(L::min(h00, h10), L::min(h01, h11)),
            enough: [0.0; MOST],
            slopes: [0.0; MOST],
            partners: [None; MOST],
        };
        packet.slopes[..L::WIDTH].copy_from_slice(&slopes[..L::WIDTH]);
        packet.enough[..L::WIDTH].copy_from_slice(&enough[..L::WIDTH]);
        L::store(h00, &mut packet.corners[0]);
        L::store(h10, &mut packet.corners[1]);
        L::store(h01, &mut packet.corners[2]);
        L::store(h11, &mut packet.corners[3]);
        packet
    }

    /// Tries the cell at `site` and those beside it for one lane.
    pub fn seed(&mut self, lane: usize, site: [i32; 2]) {
        for [x, y] in [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]] {
            let site = [i64::from(site[0] + x), i64::from(site[1] + y)];
            let heights = self.grid.heights(self.grid.wrap(site));
            self.improve(lane, site, heights);
        }
    }

    /// Looks at the whole surface.
    #[inline(always)]
    pub fn search(&mut self, stack: &mut Stack) {
        let grid = self.grid;
        stack.clear();
        grid.roots(stack);
        let mut slope = self.asked();
        while let Some((level, node, origin)) = stack.pop() {
            let Node { tile, first, last } = grid.node(level, node);
            let place = |site: [i64; 2]| [site[0] + origin[0], site[1] + origin[1]];
            let bounds = Bounds::new(grid, tile, place(first), place(last), self.first);
            if !L::any(self.may_rise_to(&bounds, tile, slope)) {
                continue;
            }
            if level > 0 {
                grid.children(level, node, origin, stack);
            } else if self.cells(first, last, origin, slope) {
                slope = self.asked();
            }
        }
    }

    /// The slopes that tests ask for, infinite for cells that are done with.
    #[inline(always)]
    fn asked(&self) -> L::F {
        let slopes = L::load(&self.slopes);
        let done = L::le(L::load(&self.enough), slopes);
        L::select(done, L::splat(f32::INFINITY), slopes * L::splat(CAUTION))
    }

    /// Lanes for which the node may hold a point to which the surface rises with more than `slope`, and falls there:
    /// its gradients, the highest point with the distance, and the plane over it do not rule that out.
    ///
    /// For any vector `p` not longer than `slope`, `slope |y - x| >= p . (y - x)`. Here it leads from middle to
    /// middle, and all is multiplied by that length.
    #[inline(always)]
    fn may_rise_to(&self, node: &Bounds, tile: &Tile, slope: L::F) -> L::M {
        let zero = L::splat(0.0);
        let vx = L::splat(node.centre[0]) - self.u;
        let vy = node.centre[1] - self.half[1];
        let wide = [node.half[0] + self.half[0], node.half[1] + self.half[1]];
        let gap_x = L::max(L::abs(vx) - L::splat(wide[0] + GAP_MARGIN), zero);
        let gap_y = (vy.abs() - (wide[1] + GAP_MARGIN)).max(0.0);
        let gap = gap_x * gap_x + L::splat(gap_y * gap_y);
        let rise = L::splat(node.max) - self.lowest;
        let near = L::lt(zero, rise)
            & L::le(slope * slope * gap, rise * rise)
            & self.may_fall(tile.gradient, [vx, L::splat(vy)], wide);
        if !L::any(near) {
            return near;
        }
        let vy = L::splat(vy);
        let square = vx * vx + vy * vy;
        let length = L::sqrt(square);
        let tilt_x = L::abs(L::splat(node.slope[0]) * length - slope * vx) * L::splat(node.half[0]);
        let tilt_y = L::abs(L::splat(node.slope[1]) * length - slope * vy) * L::splat(node.half[1]);
        let above = L::splat(node.level) * length + tilt_x + tilt_y - slope * square;
        near & L::le(self.below(length, slope, vx, vy), above)
    }

    /// The least of `h - p . x` over the corners of each cell, `p` as in [`Self::may_rise_to`], from its middle.
    #[inline(always)]
    fn below(&self, length: L::F, slope: L::F, vx: L::F, vy: L::F) -> L::F {
        let along = slope * vx * L::splat(self.half[0]);
        let across = slope * vy * L::splat(self.half[1]);
        let (sum, difference) = (along + across, along - across);
        let [h00, h10, h01, h11] = self.heights;
        let upper = L::min(h00 * length + sum, h10 * length - difference);
        let lower = L::min(h01 * length + difference, h11 * length - sum);
        L::min(upper, lower)
    }

    /// Whether a gradient between these may lead down along ways between `middle - wide` and `middle + wide`.
    #[inline(always)]
    fn may_fall(&self, gradient: [[f32; 2]; 2], middle: [L::F; 2], wide: [f32; 2]) -> L::M {
        let least = least_product::<L>([gradient[0][0], gradient[1][0]], middle[0], wide[0])
            + least_product::<L>([gradient[0][1], gradient[1][1]], middle[1], wide[1]);
        L::lt(least, L::splat(0.0))
    }

    /// Tries the cells of a tile; tells whether one was steeper. As [`Self::may_rise_to`], the maximum of a
    /// bilinear function being at a corner.
    #[inline(always)]
    fn cells(&mut self, first: [i64; 2], last: [i64; 2], origin: [i64; 2], mut slope: L::F) -> bool {
        let [du, dv] = self.grid.step;
        // Half of each cell.
        let half = [0.5 * du, 0.5 * dv];
        let wide = [half[0] + self.half[0], half[1] + self.half[1]];
        let mut any = false;
        for j in first[1]..=last[1] {
            let vy = L::splat((j + origin[1] - self.first[1]) as f32 * dv + half[1] - self.half[1]);
            for i in first[0]..=last[0] {
                let heights = self.grid.heights([i as usize, j as usize]);
                let vx = L::splat((i + origin[0] - self.first[0]) as f32 * du + half[0]) - self.u;
                let falls = self.may_fall(gradients(heights, self.grid.step), [vx, vy], wide);
                if !L::any(falls) {
                    continue;
                }
                let square = vx * vx + vy * vy;
                let length = L::sqrt(square);
                let along = slope * vx * L::splat(half[0]);
                let across = slope * vy * L::splat(half[1]);
                let (sum, difference) = (along + across, along - across);
                let [h00, h10, h01, h11] = heights.map(|height| L::splat(height) * length);
                let upper = L::max(h00 + sum, h10 - difference);
                let lower = L::max(h01 + difference, h11 - sum);
                let above = L::max(upper, lower) - slope * square;
                let mut lanes = L::bits(falls & L::le(self.below(length, slope, vx, vy), above));
                let site = [i + origin[0], j + origin[1]];
                let mut found = false;
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    found |= self.improve(lane, site, heights);
                }
                if found {
                    any = true;
                    slope = self.asked();
                }
            }
        }
        any
    }

    fn offset(&self, lane: usize, site: [i64; 2]) -> [i64; 2] {
        [site[0] - self.first[0] - lane as i64, site[1] - self.first[1]]
    }

    /// Tries one cell for one lane; tells whether it was steeper.
    fn improve(&mut self, lane: usize, site: [i64; 2], heights: [f32; 4]) -> bool {
        let offset = self.offset(lane, site);
        if touches(offset) || self.slopes[lane] >= self.enough[lane] {
            return false;
        }
        let own = self.corners.each_ref().map(|corner| corner[lane]);
        let known = f64::from(self.slopes[lane]);
        let found = steepest(self.grid, own, offset, heights, known);
        if found > known {
            let rounded = found as f32;
            self.slopes[lane] = if f64::from(rounded) < found { rounded.next_up() } else { rounded };
            self.partners[lane] = Some(site.map(|at| at as i32));
        }
        found > known
    }
}

/// The least product of a number between two and one at most `wide` away from `middle`.
#[inline(always)]
fn least_product<L: Lanes>(between: [f32; 2], middle: L::F, wide: f32) -> L::F {
    let (from, to) = (middle - L::splat(wide), middle + L::splat(wide));
    let [a, b] = [L::splat(between[0]), L::splat(between[1])];
    L::min(L::min(a * from, a * to), L::min(b * from, b * to))
}

/// The least and greatest derivatives of a cell along both axes.
#[inline(always)]
fn gradients([h00, h10, h01, h11]: [f32; 4], [du, dv]: [f32; 2]) -> [[f32; 2]; 2] {
    let (u, v) = ([(h10 - h00) / du, (h11 - h01) / du], [(h01 - h00) / dv, (h11 - h10) / dv]);
    [[u[0].min(u[1]), v[0].min(v[1])], [u[0].max(u[1]), v[0].max(v[1])]]
}
