//! The fine walk: from cell to cell near the surface, and the closed-form root in `f64`.

use super::block::{Block, DROP, FINE_DROP, LEVEL, Results};
use super::grid::{BIG, Grid};
use crate::HeightField;
use crate::lanes::Lanes;
use crate::margin::SLACK;

/// Most cells a ray is walked through before it goes back to coarse steps.
const CELLS: usize = 4;

/// Level at which rays go on that went through their cells.
const AGAIN: f32 = 1.0;

/// Two sides of a cell are crossed at the same time when they are this close, in cells: the walk is
/// good to a tenth of it.
const TIE: f32 = 2e-6;

/// How far into the next cell a ray is put that had no hit in one, in cells, so that it is there.
const NUDGE: f32 = 1e-9;

/// Walks every ray of the block through its next cells. Rays that meet the surface leave the block,
/// their drop goes to `results`. So do rays that pass a corner too closely for `f32`, as NaN.
#[inline(always)]
pub fn walk<L: Lanes>(block: &mut Block, field: &HeightField, results: &mut Results) {
    let [nx, ny] = field.cells();
    let gx = Grid::<L>::new(nx, field.is_periodic());
    let gy = Grid::<L>::new(ny, field.is_periodic());
    let pyramid = field.pyramid();
    let again = L::splat(AGAIN.min(field.margins().narrowest().top() as f32));
    let len = block.queue.len;
    block.queue.len = 0;
    for at in (0..len).step_by(L::WIDTH) {
        let active = L::first(len - at);
        let rays = Rays::<L>::load(block, at);
        let walk = rays.cells(active, pyramid.maxima(), pyramid.highest(), &gx, &gy, nx);
        let steps = L::load_int(&block.queue.steps[at..]) + walk.steps;
        L::store_int(steps, &mut block.queue.steps[at..]);
        let near = active & !walk.clear & !walk.doubtful;
        let mut advance = L::widen(walk.exit);
        let mut found = L::first(0);
        if L::any(near) {
            let (root, drop, end) = rays.root(&walk, field.corners(), f64::from(pyramid.highest()), nx);
            found = near & root;
            advance = L::select_wide(near, end, advance);
            let mut drops = [0.0; 16];
            let mut counts = [0; 16];
            L::store_wide(drop, &mut drops);
            L::store_int(steps, &mut counts);
            let mut lanes = L::bits(found);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize & 15;
                let ray = block.ray[at + lane] as usize;
                results.drop[ray] = drops[lane];
                results.steps[ray] = counts[lane];
                lanes &= lanes - 1;
            }
        }
        let keep = active & !found & !walk.doubtful;
        if L::any(keep) {
            let drop = rays.drop + advance;
            // Rounded down, so that the coarse walk does not pass what the fine one has not seen.
            let rounded = L::narrow(drop * L::splat_wide(1.0 - f64::from(f32::EPSILON)));
            L::store(rounded, &mut block.queue.single[DROP][at..]);
            L::store(again, &mut block.queue.single[LEVEL][at..]);
            L::store_wide(drop, &mut block.double[FINE_DROP][at..]);
            block.keep::<L>(at, keep);
        }
    }
}

/// A vector of rays near the surface. Positions count from the side of the cell they are in, so they
/// keep their precision however far the rays have come.
struct Rays<L: Lanes> {
    drop: L::D,
    /// Position in the first cell, and that cell.
    local: [L::D; 2],
    cell: [L::F; 2],
    direction: [L::D; 2],
    inverse: [L::F; 2],
}

/// Where a walk through cells ended.
struct Walk<L: Lanes> {
    /// Rays that are above all cells they went through.
    clear: L::M,
    /// Rays that pass a corner too closely to say which cells they visit.
    doubtful: L::M,
    /// The last cell, counted from the first, and its number among all corners.
    cell: [L::F; 2],
    corner: L::I,
    /// Drop from the start of the walk to where the last cell is left.
    exit: L::F,
    steps: L::I,
}

impl<L: Lanes> Rays<L> {
    #[inline(always)]
    fn load(block: &Block, at: usize) -> Self {
        let coarse = L::widen(L::load(&block.queue.single[DROP][at..]));
        let drop = L::max_wide(L::load_wide(&block.double[FINE_DROP][at..]), coarse);
        let direction = [L::load_wide(&block.double[2][at..]), L::load_wide(&block.double[3][at..])];
        let x = L::load_wide(&block.double[0][at..]) + drop * direction[0];
        let y = L::load_wide(&block.double[1][at..]) + drop * direction[1];
        let (cell_x, cell_y) = (L::floor_wide(x), L::floor_wide(y));
        Self {
            drop,
            local: [x - cell_x, y - cell_y],
            cell: [L::narrow(cell_x), L::narrow(cell_y)],
            direction,
            inverse: [L::load(&block.queue.single[4][at..]), L::load(&block.queue.single[5][at..])],
        }
    }

    /// Walks until a cell whose highest corner the ray does not stay above.
    #[inline(always)]
    fn cells(
        &self,
        active: L::M,
        maxima: &[f32],
        highest: f32,
        gx: &Grid<L>,
        gy: &Grid<L>,
        nx: usize,
    ) -> Walk<L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let below_one = L::splat(1.0 - f32::EPSILON / 2.0);
        let (up_x, up_y) = (L::lt(zero, self.inverse[0]), L::lt(zero, self.inverse[1]));
        // The side ahead, and the next cell.
        let (ahead_x, ahead_y) = (L::select(up_x, one, zero), L::select(up_y, one, zero));
        let (step_x, step_y) = (ahead_x + ahead_x - one, ahead_y + ahead_y - one);
        let side_x = ahead_x - L::min(L::narrow(self.local[0]), below_one);
        let side_y = ahead_y - L::min(L::narrow(self.local[1]), below_one);
        let least = L::min(L::abs(self.inverse[0]), L::abs(self.inverse[1]));
        let tie = L::splat(TIE) * least;
        // How far a ray at the start of the walk is above the lowest point, less the rounding of it all.
        let room = L::splat(highest) - (L::narrow(self.drop) + L::splat(SLACK));
        let mut x = gx.number(self.cell[0]);
        let mut y = gy.number(self.cell[1]);
        let stride = L::splat_int(nx as i32);
        let mut walk = Walk {
            clear: active,
            doubtful: L::first(0),
            cell: [zero; 2],
            corner: L::splat_int(0),
            exit: zero,
            steps: L::splat_int(0),
        };
        let mut cell = [zero; 2];
        for _ in 0..CELLS {
            let number = x + y * stride;
            // SAFETY: the number of a cell.
            let maximum = unsafe { L::gather(maxima, number, walk.clear) };
            let to_x = (cell[0] + side_x) * self.inverse[0];
            let to_y = (cell[1] + side_y) * self.inverse[1];
            // No ray is longer than from the lid to the floor.
            let exit = L::min(L::max(L::min(to_x, to_y), walk.exit), L::splat(2.0));
            walk.steps = L::select_int(walk.clear, walk.steps + L::splat_int(1), walk.steps);
            walk.doubtful = walk.doubtful | (walk.clear & L::lt(L::abs(to_x - to_y), tie));
            walk.exit = L::select(walk.clear, exit, walk.exit);
            walk.cell[0] = L::select(walk.clear, cell[0], walk.cell[0]);
            walk.cell[1] = L::select(walk.clear, cell[1], walk.cell[1]);
            // A row of corners is longer by one than a row of cells.
            walk.corner = L::select_int(walk.clear, number + y, walk.corner);
            walk.clear = walk.clear & L::lt(maximum, room - exit);
            if !L::any(walk.clear) {
                break;
            }
            // Rays that have stopped go on as well, so that the next cell does not wait for the table.
            let by_x = L::le(to_x, to_y);
            cell[0] = L::select(by_x, cell[0] + step_x, cell[0]);
            cell[1] = L::select(by_x, cell[1], cell[1] + step_y);
            x = L::select_int(by_x, gx.next(self.cell[0] + cell[0], x, up_x), x);
            y = L::select_int(by_x, y, gy.next(self.cell[1] + cell[1], y, up_y));
        }
        walk
    }

    /// The first point in the last cell of a walk where the ray is on or below the surface.
    ///
    /// Returns whether there is one, its drop, and how far from the start of the walk was looked.
    /// Along a line the bilinear patch is a quadratic: Ramsey, Potter and Hansen 2004.
    #[inline(always)]
    fn root(&self, walk: &Walk<L>, corners: &[f32], highest: f64, nx: usize) -> (L::M, L::D, L::D) {
        let zero = L::splat_wide(0.0);
        let [dx, dy] = self.direction;
        let (cell_x, cell_y) = (L::widen(walk.cell[0]), L::widen(walk.cell[1]));
        let (entry_x, exit_x) = crossing::<L>(cell_x - self.local[0], dx, self.inverse[0]);
        let (entry_y, exit_y) = crossing::<L>(cell_y - self.local[1], dy, self.inverse[1]);
        let from = L::max_wide(L::max_wide(entry_x, entry_y), zero);
        // No ray is longer than from the lid to the floor.
        let exit = L::min_wide(L::min_wide(exit_x, exit_y), L::splat_wide(2.0));
        let length = exit - from;
        let least = L::min(L::abs(self.inverse[0]), L::abs(self.inverse[1]));
        let end = L::max_wide(exit, from) + L::widen(L::min(L::splat(NUDGE) * least, L::splat(1.0)));
        let x = self.local[0] + from * dx - cell_x;
        let y = self.local[1] + from * dy - cell_y;
        // SAFETY: the four corners of a cell.
        let (upper, lower) = unsafe {
            let below = walk.corner + L::splat_int(nx as i32 + 1);
            (L::gather_pairs(corners, walk.corner), L::gather_pairs(corners, below))
        };
        let h00 = L::widen(upper.0);
        let h10 = L::widen(upper.1);
        let along_x = h10 - h00;
        let along_y = L::widen(lower.0) - h00;
        let twist = (L::widen(lower.1) - h10) - along_y;
        let height = h00 + x * along_x + y * (along_y + x * twist);
        let start = self.drop + from;
        let gap = (L::splat_wide(highest) - start) - height;
        let slope = L::splat_wide(-1.0) - (along_x + y * twist) * dx - (along_y + x * twist) * dy;
        let bend = zero - twist * dx * dy;
        let discriminant = slope * slope - L::splat_wide(4.0) * bend * gap;
        let square_root = L::sqrt_wide(L::max_wide(discriminant, zero));
        let falling = L::lt_wide(slope, zero);
        let twice = L::select_wide(falling, square_root - slope, zero - (slope + square_root));
        let q = L::splat_wide(0.5) * twice;
        // With q > 0 the roots gap / q and q / bend are ordered; else only q / bend can be positive.
        let ordered = L::lt_wide(zero, q);
        let root = L::select_wide(ordered, gap, q) / L::select_wide(ordered, q, bend);
        let real = L::le_wide(zero, discriminant)
            & (ordered | (L::lt_wide(bend, zero) & L::lt_wide(q, zero)))
            & L::le_wide(root, length);
        let inside = L::le_wide(gap, zero);
        (inside | real, start + L::select_wide(inside, zero, root), end)
    }
}

/// When a ray crosses the sides of a cell along one axis, given the distance to the lower one.
#[inline(always)]
fn crossing<L: Lanes>(lower: L::D, direction: L::D, inverse: L::F) -> (L::D, L::D) {
    let (zero, one) = (L::splat_wide(0.0), L::splat_wide(1.0));
    // One step of Newton's method doubles the digits of the inverse.
    let rough = L::widen(inverse);
    let better = rough * (L::splat_wide(2.0) - direction * rough);
    let moving = L::lt(L::abs(inverse), L::splat(BIG));
    let inverse = L::select_wide(moving, better, rough);
    let (to_lower, to_upper) = (lower * inverse, (lower + one) * inverse);
    let up = L::lt_wide(zero, inverse);
    (L::select_wide(up, to_lower, to_upper), L::select_wide(up, to_upper, to_lower))
}
