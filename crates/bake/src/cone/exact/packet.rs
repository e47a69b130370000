//! Branch and bound for neighbouring apexes side by side: all lanes walk one stack of nodes.

use heightfield::lanes::Lanes;

use super::super::grid::{Bounds, Grid, Node, Stack, Tile};
use super::pairs::{to_cell, to_edge};

/// What a distance may be too long by through rounding, UV units.
const GAP_MARGIN: f32 = 1e-6;
/// Single-precision tests ask for this much more than the slope known. They round by less than 5.5e-7 themselves, so what
/// they leave out is less than 8e-7 steeper. Asked for less, they would let all of a plane through, where everything ties.
const WORTHWHILE: f32 = 1.0 + 2.0 * f32::EPSILON;
/// Where the gradients of a tile differ by no more than this part of them, they are worth a test of their own.
const EVEN: f32 = 0.25;
/// Most lanes.
const MOST: usize = 16;

/// What rises start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum From {
    /// Texel centres; they rise to any point of the surface.
    Points,
    /// Texel centres; they rise to texel centres. Sites of the grid are those.
    Texels,
    /// Edges to the next texel along an axis; they rise to texel centres.
    Edges(usize),
}

/// Apexes in a row and what is known of them.
pub(super) struct Packet<'a, L: Lanes> {
    grid: &'a Grid<'a>,
    from: From,
    /// The first apex, as a site of the grid.
    first: [i64; 2],
    /// Numbers of the apexes.
    number: L::F,
    /// Middles of the apexes, from the first site, UV units.
    u: L::F,
    v: f32,
    /// Half of each apex' extent.
    half: [f32; 2],
    /// Heights at both ends; the same for points.
    heights: [L::F; 2],
    ends: [[f32; MOST]; 2],
    /// Only what lies within this distance, squared, can be steeper.
    reach: L::F,
    /// The steepest rise known.
    pub slopes: [f32; MOST],
    /// The cell it leads to, as a site; may lie on another period.
    pub partners: [[i32; 2]; MOST],
}

/// No partner.
pub(super) const NOBODY: [i32; 2] = [i32::MAX; 2];

impl<'a, L: Lanes> Packet<'a, L> {
    /// Apexes from site `first` on. `heights` are those of their ends, `slopes` what they have to exceed, and
    /// `reach` the squared distance within which they can.
    #[inline(always)]
    pub fn new(
        grid: &'a Grid<'a>,
        from: From,
        first: [i64; 2],
        heights: [&[f32]; 2],
        slopes: &[f32],
        reach: L::F,
    ) -> Self {
        let mut half = [0.0; 2];
        if let From::Edges(axis) = from {
            half[axis] = 0.5 * grid.step[axis];
        }
        let mut u = [0.0; MOST];
        let mut number = [0.0; MOST];
        for (k, (u, number)) in u.iter_mut().zip(&mut number).enumerate() {
            *number = k as f32;
            *u = k as f32 * grid.step[0] + half[0];
        }
        let heights = heights.map(L::load);
        let mut packet = Self {
            grid,
            from,
            first,
            number: L::load(&number),
            u: L::load(&u),
            v: half[1],
            half,
            heights,
            ends: [[0.0; MOST]; 2],
            reach,
            slopes: [f32::INFINITY; MOST],
            partners: [NOBODY; MOST],
        };
        packet.slopes[..L::WIDTH].copy_from_slice(&slopes[..L::WIDTH]);
        for (ends, heights) in packet.ends.iter_mut().zip(heights) {
            L::store(heights, ends);
        }
        packet
    }

    /// Tries the cell at `site` and those beside it for one lane.
    #[inline(always)]
    pub fn seed(&mut self, lane: usize, site: [i32; 2]) {
        for [x, y] in [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]] {
            let site = [i64::from(site[0] + x), i64::from(site[1] + y)];
            let heights = self.grid.heights(self.grid.wrap(site));
            if self.from == From::Texels {
                self.improve_centre(lane, site, heights[0]);
            } else {
                self.improve(lane, site, heights);
            }
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
            let may_rise = self.may_rise_to(&bounds, slope);
            if !L::any(may_rise)
                || !L::any(may_rise & self.may_rise_along(tile, [first, last], origin, slope))
            {
                continue;
            }
            if level > 0 {
                grid.children(level, node, origin, stack);
                continue;
            }
            let found = match self.from {
                From::Points => self.cells(first, last, origin, slope),
                From::Texels => self.centres(first, last, origin, slope),
                From::Edges(axis) => self.texels(axis, [first, last], origin, slope, tile),
            };
            if found {
                slope = self.asked();
            }
        }
    }

    /// The slopes that tests ask for.
    #[inline(always)]
    fn asked(&self) -> L::F {
        L::load(&self.slopes) * L::splat(WORTHWHILE)
    }

    /// Lanes for which the node may hold a point to which the surface rises with more than `slope`: neither the
    /// highest point and the distance nor the plane over it rule that out.
    ///
    /// For any vector `p` not longer than `slope`, `slope |y - x| >= p . (y - x)`. Here it leads from middle to
    /// middle, and all is multiplied by that length.
    #[inline(always)]
    fn may_rise_to(&self, node: &Bounds, slope: L::F) -> L::M {
        let zero = L::splat(0.0);
        let vx = L::splat(node.centre[0]) - self.u;
        let vy = node.centre[1] - self.v;
        let gap_x = L::max(L::abs(vx) - L::splat(node.half[0] + self.half[0] + GAP_MARGIN), zero);
        let gap_y = (vy.abs() - (node.half[1] + self.half[1] + GAP_MARGIN)).max(0.0);
        let gap = gap_x * gap_x + L::splat(gap_y * gap_y);
        let rise = L::splat(node.max) - L::min(self.heights[0], self.heights[1]);
        let near = L::lt(zero, rise) & L::le(slope * slope * gap, rise * rise) & L::le(gap, self.reach);
        if !L::any(near) {
            return near;
        }
        let vy = L::splat(vy);
        let square = vx * vx + vy * vy;
        let length = L::sqrt(square);
        let tilt_x = L::abs(L::splat(node.slope[0]) * length - slope * vx) * L::splat(node.half[0]);
        let tilt_y = L::abs(L::splat(node.slope[1]) * length - slope * vy) * L::splat(node.half[1]);
        let along = slope * (vx * L::splat(self.half[0]) + vy * L::splat(self.half[1]));
        let level = L::splat(node.level);
        let from_a = (level - self.heights[0]) * length - along;
        let from_b = (level - self.heights[1]) * length + along;
        near & L::le(slope * square, L::max(from_a, from_b) + tilt_x + tilt_y)
    }

    /// Lanes for which a node may hold a point to which the surface rises with more than `slope`, by its gradients.
    ///
    /// As [`Self::may_rise_to`] with `p` along the mean gradient: from the node's first corner on, `h - p . y` grows by no
    /// more than the greatest gradients allow. On a plane that leaves nothing, wherever the node lies.
    #[inline(always)]
    fn may_rise_along(
        &self,
        tile: &Tile,
        [first, last]: [[i64; 2]; 2],
        origin: [i64; 2],
        slope: L::F,
    ) -> L::M {
        let steep = (tile.slope[0] * tile.slope[0] + tile.slope[1] * tile.slope[1]).sqrt();
        let [least, most] = tile.gradient;
        let range = (most[0] - least[0]).max(most[1] - least[1]);
        // Points that are compared one by one have no surface between them.
        if self.grid.extent == 0.0 || steep <= 0.0 || range > EVEN * steep {
            return L::first(L::WIDTH);
        }
        let (step, zero) = (self.grid.step, L::splat(0.0));
        let p = tile.slope.map(|component| L::splat(component / steep) * slope);
        let size = |axis: usize| (last[axis] - first[axis] + 1) as f32 * step[axis];
        let spread = L::max(L::splat(most[0]) - p[0], zero) * L::splat(size(0))
            + L::max(L::splat(most[1]) - p[1], zero) * L::splat(size(1));
        // Whole numbers are exact, so close corners are seen as sharply as far ones.
        let corner = [0, 1].map(|axis| (first[axis] + origin[axis] - self.first[axis]) as f32);
        let run = p[0] * ((L::splat(corner[0]) - self.number) * L::splat(step[0]))
            + p[1] * L::splat(corner[1] * step[1]);
        let height = L::splat(self.grid.heights([first[0] as usize, first[1] as usize])[0]);
        let begin = L::lt(run, (height - self.heights[0]) + spread);
        match self.from {
            From::Edges(axis) => {
                let run = run - p[axis] * L::splat(step[axis]);
                begin | L::lt(run, (height - self.heights[1]) + spread)
            }
            From::Points | From::Texels => begin,
        }
    }

    /// Tries the cells of a tile; tells whether one was steeper. As [`Self::may_rise_to`], the maximum of a
    /// bilinear function being at a corner.
    #[inline(always)]
    fn cells(&mut self, first: [i64; 2], last: [i64; 2], origin: [i64; 2], mut slope: L::F) -> bool {
        let [du, dv] = self.grid.step;
        let (half_u, half_v) = (L::splat(0.5 * du), 0.5 * dv);
        let mut any = false;
        let low = self.heights[0];
        for j in first[1]..=last[1] {
            let vy = (j + origin[1] - self.first[1]) as f32 * dv + half_v;
            let across = slope * L::splat(vy * half_v);
            let square_y = L::splat(vy * vy);
            for i in first[0]..=last[0] {
                let heights = self.grid.heights([i as usize, j as usize]);
                let vx = L::splat((i + origin[0] - self.first[0]) as f32 * du + 0.5 * du) - self.u;
                let square = vx * vx + square_y;
                let length = L::sqrt(square);
                let along = slope * vx * half_u;
                let [h00, h10, h01, h11] = heights.map(|height| (L::splat(height) - low) * length);
                let (sum, difference) = (along + across, along - across);
                let upper = L::max(h00 + sum, h10 - difference);
                let lower = L::max(h01 + difference, h11 - sum);
                let lanes = L::le(slope * square, L::max(upper, lower));
                if !L::any(lanes) {
                    continue;
                }
                let site = [i + origin[0], j + origin[1]];
                let mut lanes = L::bits(lanes);
                let mut found = false;
                while lanes != 0 {
                    found |= self.improve(lanes.trailing_zeros() as usize, site, heights);
                    lanes &= lanes - 1;
                }
                if found {
                    any = true;
                    slope = self.asked();
                }
            }
        }
        any
    }

    /// Tries one cell for one lane; tells whether it was steeper.
    fn improve(&mut self, lane: usize, site: [i64; 2], heights: [f32; 4]) -> bool {
        let step = self.grid.step.map(f64::from);
        let low = f64::from(self.ends[0][lane]);
        let place = [(site[0] - self.first[0] - lane as i64) as f64, (site[1] - self.first[1]) as f64];
        let known = f64::from(self.slopes[lane]);
        let rises = heights.map(|height| f64::from(height) - low);
        let found = to_cell(rises, [place[0] * step[0], place[1] * step[1]], step, known);
        self.keep(lane, site, found, known)
    }

    #[inline(always)]
    fn keep(&mut self, lane: usize, site: [i64; 2], found: f64, known: f64) -> bool {
        if found > known {
            let rounded = found as f32;
            self.slopes[lane] = if f64::from(rounded) < found { rounded.next_up() } else { rounded };
            self.partners[lane] = site.map(|at| at as i32);
        }
        found > known
    }

    /// Tries the texels of a tile; tells whether one was steeper.
    #[inline(always)]
    fn centres(&mut self, first: [i64; 2], last: [i64; 2], origin: [i64; 2], mut slope: L::F) -> bool {
        let [du, dv] = self.grid.step;
        let zero = L::splat(0.0);
        let mut any = false;
        for j in first[1]..=last[1] {
            let vy = (j + origin[1] - self.first[1]) as f32 * dv;
            for i in first[0]..=last[0] {
                let height = self.grid.heights([i as usize, j as usize])[0];
                let rise = L::splat(height) - self.heights[0];
                let vx = L::splat((i + origin[0] - self.first[0]) as f32 * du) - self.u;
                let square = vx * vx + L::splat(vy * vy);
                let mut lanes = L::bits(L::lt(zero, rise) & L::le(slope * slope * square, rise * rise));
                let site = [i + origin[0], j + origin[1]];
                let mut found = false;
                while lanes != 0 {
                    found |= self.improve_centre(lanes.trailing_zeros() as usize, site, height);
                    lanes &= lanes - 1;
                }
                if found {
                    any = true;
                    slope = self.asked();
                }
            }
        }
        any
    }

    /// Tries one texel for one lane; tells whether it was steeper.
    fn improve_centre(&mut self, lane: usize, site: [i64; 2], height: f32) -> bool {
        let step = self.grid.step.map(f64::from);
        let u = (site[0] - self.first[0] - lane as i64) as f64 * step[0];
        let v = (site[1] - self.first[1]) as f64 * step[1];
        let known = f64::from(self.slopes[lane]);
        let (rise, distance) = (f64::from(height) - f64::from(self.ends[0][lane]), u.hypot(v));
        let found = if rise > 0.0 && distance > 0.0 { rise / distance } else { 0.0 };
        self.keep(lane, site, found, known)
    }

    /// Tries the texels of a tile as what edges along `axis` rise to; tells whether one was steeper.
    #[inline(always)]
    fn texels(
        &mut self,
        axis: usize,
        [first, last]: [[i64; 2]; 2],
        origin: [i64; 2],
        mut slope: L::F,
        tile: &Tile,
    ) -> bool {
        let step = self.grid.step;
        let zero = L::splat(0.0);
        let low = L::min(self.heights[0], self.heights[1]);
        if !L::any(L::lt(low, L::splat(tile.max))) {
            return false;
        }
        let length = L::splat(step[axis]);
        let tilt = (self.heights[1] - self.heights[0]) / length;
        let mut any = false;
        // The apexes' first ends.
        let u = self.u - L::splat(self.half[0]);
        for j in first[1]..=last[1] {
            let vy = L::splat((j + origin[1] - self.first[1]) as f32 * step[1]);
            for i in first[0]..=last[0] {
                let height = self.grid.heights([i as usize, j as usize])[0];
                let vx = L::splat((i + origin[0] - self.first[0]) as f32 * step[0]) - u;
                let (along, apart) = if axis == 0 { (vx, vy) } else { (vy, vx) };
                let rise = L::splat(height) - self.heights[0];
                let square = apart * apart;
                // As `pairs::to_edge`: the rise over the foot of the texel, and where it is steepest.
                let foot = rise - tilt * along;
                let steeper = L::le((slope * slope - tilt * tilt) * square, foot * foot);
                let at = zero - tilt * square + along * foot;
                let inside = L::le(zero, at) & L::le(at, length * foot);
                let mut lanes = L::bits(L::lt(zero, foot) & steeper & inside);
                if lanes == 0 {
                    continue;
                }
                let site = [i + origin[0], j + origin[1]];
                while lanes != 0 {
                    any |= self.improve_edge(axis, lanes.trailing_zeros() as usize, site, height);
                    lanes &= lanes - 1;
                }
                slope = self.asked();
            }
        }
        any
    }

    /// Tries one texel for one edge; tells whether it was steeper.
    fn improve_edge(&mut self, axis: usize, lane: usize, site: [i64; 2], height: f32) -> bool {
        let step = self.grid.step.map(f64::from);
        let rises = [0, 1].map(|end: usize| f64::from(height) - f64::from(self.ends[end][lane]));
        let place = [
            (site[0] - self.first[0] - lane as i64) as f64 * step[0],
            (site[1] - self.first[1]) as f64 * step[1],
        ];
        let known = f64::from(self.slopes[lane]);
        let apart = place[1 - axis];
        let found = if apart == 0.0 { known } else { to_edge(rises, -place[axis], step[axis], apart, known) };
        self.keep(lane, site, found, known)
    }
}
