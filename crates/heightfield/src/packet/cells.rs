//! The walk of single rays: coarse steps down to the surface, then from cell to cell, and the closed-form
//! root.
//!
//! `f32` says which cells a ray is surely above from side to side; the first one of which it cannot say so
//! is solved in `f64`, and only there rays meet the surface.

use std::ops::Range;

use super::block::{Block, DROP, FINE_DROP, LEVEL, Results};
use super::grid::{Axis, Coarse, Grid};
use crate::HeightField;
use crate::lanes::Lanes;

/// Packets in flight: while one waits for memory the other computes.
const STREAMS: usize = 2;

/// Most coarse steps in a row.
const STEPS: usize = 32;

/// Rays of all packets in flight that may still step when all go on from cell to cell.
const IDLE: u32 = 8;

/// Most cells a ray is walked through in a row.
const CELLS: usize = 8;

/// Level at which rays go on that went through their cells.
const AGAIN: f32 = 1.0;

/// Bound on the error of the height of a ray above the surface where it passes from cell to cell.
///
/// Positions there are good to 2.2e-6 cells along each axis: 2^-24 for the position in the first cell, 2^-21
/// each for the distance to the side and for the way to it, which are at most [`CELLS`] cells, and their
/// sums. The surface rises by at most 1 a cell along each axis, which gives 4.4e-6, and as much again where
/// a ray passes a corner so closely that it is led around it on the wrong side. The rest is for the rounding
/// of heights.
const BAND: f32 = 1.6e-5;

/// How far into the next cell a ray is put that had no hit in one, in cells, so that it is there.
const NUDGE: f32 = 1e-9;

/// The numbers of lanes.
const LANES: [i32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Takes the rays at some slots on to the surface. The others stay in the block, from slot `len` on.
#[inline(always)]
pub fn walk<L: Lanes>(
    block: &mut Block,
    slots: Range<usize>,
    field: &HeightField,
    gx: &Grid<L>,
    gy: &Grid<L>,
    results: &mut Results,
) {
    let bound = field.margins().narrowest();
    let end = slots.end;
    for at in slots.step_by(STREAMS * L::WIDTH) {
        let second = (at + L::WIDTH).min(end);
        let mut packets = [load(block, at, end), load(block, second, end)];
        for _ in 0..STEPS {
            let mut running = 0;
            for packet in &mut packets {
                packet.step(bound, gx, gy);
                running += L::bits(packet.running).count_ones();
            }
            if running <= IDLE {
                break;
            }
        }
        look::<L>(block, at, end, &packets[0], field, gx, gy, results);
        if second < end {
            look::<L>(block, second, end, &packets[1], field, gx, gy, results);
        }
    }
}

#[inline(always)]
fn load<L: Lanes>(block: &Block, at: usize, end: usize) -> Coarse<L> {
    let [start_x, start_y, direction_x, direction_y, inverse_x, inverse_y, drop, level] = &block.single;
    let axis = |start: &[f32], direction: &[f32], inverse: &[f32]| Axis {
        start: L::load(&start[at..]),
        direction: L::load(&direction[at..]),
        inverse: L::load(&inverse[at..]),
    };
    Coarse::<L>::new(
        axis(start_x, direction_x, inverse_x),
        axis(start_y, direction_y, inverse_y),
        L::load(&drop[at..]),
        L::to_int(L::load(&level[at..])),
        L::first(end - at),
    )
}

/// Where a walk through cells begins.
struct Start<L: Lanes> {
    /// Position in the first cell.
    local: [L::F; 2],
    /// That cell, on any tile, and its number.
    cell: [L::F; 2],
    number: [L::I; 2],
    /// Cells for one unit of drop, and the inverse.
    direction: [L::F; 2],
    inverse: [L::F; 2],
    /// 1 along an axis on which rays go up, 0 elsewhere.
    ahead: [L::F; 2],
    /// How far the rays are below the highest point, and above the lowest.
    room: L::F,
    going: L::M,
}

/// Where a walk through cells ended.
struct End<L: Lanes> {
    /// The corners of the cell.
    square: [L::F; 4],
    /// How far below the start the cell begins.
    from: L::F,
    /// Position of the start from the first of them.
    offset: [L::F; 2],
    /// Rays that are above all cells they went through; the others stopped at one.
    going: L::M,
}

impl<L: Lanes> Start<L> {
    /// Walks until the first cell that the ray is not surely above.
    ///
    /// Rays whose neighbourhood has a side of the map in it (`EDGE`) must be told where to go on.
    #[inline(always)]
    fn walk<const EDGE: bool>(&self, corners: &[f32], stride: usize, gx: &Grid<L>, gy: &Grid<L>) -> End<L> {
        let (zero, one, band) = (L::splat(0.0), L::splat(1.0), L::splat(BAND));
        let [dx, dy] = self.direction;
        let (step_x, step_y) = (self.ahead[0] + self.ahead[0] - one, self.ahead[1] + self.ahead[1] - one);
        let row = L::splat_int(stride as i32);
        let (next_x, next_y) = (L::to_int(step_x), L::to_int(step_y) * row);
        let (up_x, up_y) = (L::lt(zero, step_x), L::lt(zero, step_y));
        let [mut i, mut j] = self.number;
        let mut cell = self.cell;
        let mut corner = i + j * row;
        let mut offset = self.local;
        let mut from = zero;
        // SAFETY: a corner of a cell of the field, and the cell's three others.
        let mut square = unsafe { L::gather_squares(corners, corner, stride) };
        let mut end = End { square, from, offset, going: self.going };
        let mut before = self.room - height::<L>(&square, offset).0;
        for _ in 0..CELLS {
            let to_x = (self.ahead[0] - offset[0]) * self.inverse[0];
            let to_y = (self.ahead[1] - offset[1]) * self.inverse[1];
            let by_x = L::le(to_x, to_y);
            let exit = L::min(to_x, to_y);
            let place = [L::mul_add(exit, dx, offset[0]), L::mul_add(exit, dy, offset[1])];
            let (surface, twist) = height::<L>(&square, place);
            let gap = (self.room - exit) - surface;
            // Between two points of a cell the surface is at most a quarter of the twist above their chord.
            let least = L::mul_add(L::splat(0.25), L::abs(twist), band);
            let clear = L::lt(least, L::min(before, gap));
            for (old, new) in end.square.iter_mut().zip(square) {
                *old = L::select(end.going, new, *old);
            }
            end.from = L::select(end.going, from, end.from);
            end.offset[0] = L::select(end.going, offset[0], end.offset[0]);
            end.offset[1] = L::select(end.going, offset[1], end.offset[1]);
            end.going = end.going & clear;
            // Rays that have stopped go on as well, so that the next cell does not wait for this one.
            (before, from) = (gap, exit);
            offset[0] = offset[0] - L::select(by_x, step_x, zero);
            offset[1] = offset[1] - L::select(by_x, zero, step_y);
            if EDGE {
                cell[0] = cell[0] + L::select(by_x, step_x, zero);
                cell[1] = cell[1] + L::select(by_x, zero, step_y);
                i = L::select_int(by_x, gx.next(cell[0], i, up_x), i);
                j = L::select_int(by_x, j, gy.next(cell[1], j, up_y));
                corner = i + j * row;
            } else {
                corner = corner + L::select_int(by_x, next_x, next_y);
            }
            if !L::any(end.going) {
                break;
            }
            // SAFETY: a corner of a cell of the field, and the cell's three others: away from the edge, rays
            // do not come as far as that in so many steps.
            square = unsafe { L::gather_squares(corners, corner, stride) };
        }
        end.from = L::select(end.going, from, end.from);
        end.offset[0] = L::select(end.going, offset[0], end.offset[0]);
        end.offset[1] = L::select(end.going, offset[1], end.offset[1]);
        end
    }
}

/// The bilinear surface at a place in a cell, and its twist.
#[inline(always)]
fn height<L: Lanes>([h00, h10, h01, h11]: &[L::F; 4], [x, y]: [L::F; 2]) -> (L::F, L::F) {
    let (along_x, along_y) = (*h10 - *h00, *h01 - *h00);
    let twist = (*h11 - *h10) - along_y;
    let slant = L::mul_add(x, twist, along_y);
    (L::mul_add(y, slant, L::mul_add(x, along_x, *h00)), twist)
}

/// Walks the rays of a packet through their cells.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn look<L: Lanes>(
    block: &mut Block,
    at: usize,
    end: usize,
    packet: &Coarse<L>,
    field: &HeightField,
    gx: &Grid<L>,
    gy: &Grid<L>,
    results: &mut Results,
) {
    let [nx, _] = field.cells();
    let stride = nx + 1;
    let corners = field.corners();
    let active = L::first(end - at);
    let highest = L::splat_wide(f64::from(field.pyramid().highest()));
    let drop = L::max_wide(L::load_wide(&block.double[FINE_DROP][at..]), L::widen(packet.drop));
    let direction = [L::load_wide(&block.double[2][at..]), L::load_wide(&block.double[3][at..])];
    let x = L::load_wide(&block.double[0][at..]) + drop * direction[0];
    let y = L::load_wide(&block.double[1][at..]) + drop * direction[1];
    let (cell_x, cell_y) = (L::floor_wide(x), L::floor_wide(y));
    let local = [x - cell_x, y - cell_y];
    let inverse = [L::load(&block.single[4][at..]), L::load(&block.single[5][at..])];
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let above = highest - drop;
    let cell = [L::narrow(cell_x), L::narrow(cell_y)];
    let number = [gx.number(cell[0]), gy.number(cell[1])];
    let start = Start::<L> {
        local: [L::narrow(local[0]), L::narrow(local[1])],
        cell,
        number,
        direction: [
            L::load(&block.single[2][at..]) * gx.cells(),
            L::load(&block.single[3][at..]) * gy.cells(),
        ],
        inverse,
        ahead: [L::select(L::lt(zero, inverse[0]), one, zero), L::select(L::lt(zero, inverse[1]), one, zero)],
        room: L::narrow(above),
        going: active,
    };
    let inner = gx.inner(number[0], CELLS) & gy.inner(number[1], CELLS);
    let walk = if L::any(!inner) {
        start.walk::<true>(corners, stride, gx, gy)
    } else {
        start.walk::<false>(corners, stride, gx, gy)
    };

    // Along a line the bilinear patch is a quadratic: Ramsey, Potter and Hansen 2004.
    let stopped = start.going & !walk.going;
    let [h00, h10, h01, h11] = walk.square;
    let (h00, h10, h01, h11) = (L::widen(h00), L::widen(h10), L::widen(h01), L::widen(h11));
    let half = L::splat(0.5);
    let count_x = L::floor((start.local[0] - walk.offset[0]) + half);
    let count_y = L::floor((start.local[1] - walk.offset[1]) + half);
    let [dx, dy] = direction;
    let (x, y) = (local[0] - L::widen(count_x), local[1] - L::widen(count_y));
    let from = L::widen(walk.from);
    let exit = L::min_wide(
        crossing::<L>(L::widen(start.ahead[0]) - x, dx, inverse[0]),
        crossing::<L>(L::widen(start.ahead[1]) - y, dy, inverse[1]),
    );
    // No ray is longer than from the lid to the floor.
    let exit = L::max_wide(L::min_wide(exit, L::splat_wide(2.0)), from);
    let (zero, minus) = (L::splat_wide(0.0), L::splat_wide(-1.0));
    let (x, y) = (x + from * dx, y + from * dy);
    let along_x = h10 - h00;
    let along_y = h01 - h00;
    let twist = (h11 - h10) - along_y;
    let slant = along_y + x * twist;
    let gap = (above - from) - (h00 + x * along_x + y * slant);
    let slope = minus - (along_x + y * twist) * dx - slant * dy;
    let bend = zero - twist * dx * dy;
    let discriminant = slope * slope - L::splat_wide(4.0) * bend * gap;
    let square_root = L::sqrt_wide(L::max_wide(discriminant, zero));
    // The smaller positive root, without a difference of two numbers that are about the same.
    let falling = slope;
    let twice = L::select_signed_wide(falling, square_root - slope, zero - (slope + square_root));
    let numerator = L::select_signed_wide(falling, gap + gap, twice);
    let denominator = L::select_signed_wide(falling, twice, bend + bend);
    // Rays that are not above the surface when they enter meet it there.
    let above = zero - gap;
    let root = L::select_signed_wide(above, numerator / denominator, zero);
    let discriminant = L::select_signed_wide(above, discriminant, zero);
    let found = stopped & L::le_wide(zero, L::min_wide(discriminant, root)) & L::le_wide(root, exit - from);
    let hit = drop + from + root;

    let moved = L::to_int(L::abs(count_x) + L::abs(count_y)) + L::splat_int(1);
    let cells = L::select_int(start.going, moved, L::splat_int(0));
    let steps = L::load_int(&block.steps[at..]) + packet.steps + cells;
    write::<L>(block, at, active, found, hit, steps, results);
    let again = active & !found;
    if L::any(again) {
        let least = L::min(L::abs(inverse[0]), L::abs(inverse[1]));
        let beyond = exit + L::widen(L::min(L::splat(NUDGE) * least, one));
        let drop = drop + L::select_wide(stopped, beyond, from);
        // Rounded down, so that coarse steps do not pass what has not been seen.
        let rounded = L::narrow(drop * L::splat_wide(1.0 - f64::from(f32::EPSILON)));
        L::store(rounded, &mut block.single[DROP][at..]);
        let level = L::splat(AGAIN.min(field.margins().narrowest().top() as f32));
        L::store(level, &mut block.single[LEVEL][at..]);
        L::store_wide(drop, &mut block.double[FINE_DROP][at..]);
        L::store_int(steps, &mut block.steps[at..]);
        block.keep::<L>(at, again);
    }
}

/// When a ray gets to the side of a cell at some distance along an axis.
#[inline(always)]
fn crossing<L: Lanes>(distance: L::D, direction: L::D, inverse: L::F) -> L::D {
    // One step of Newton's method doubles the digits of the inverse.
    let rough = L::widen(inverse);
    distance * (rough * (L::splat_wide(2.0) - direction * rough))
}

/// Writes what was found; of a run of rays that all look for their hit, whole vectors.
#[inline(always)]
fn write<L: Lanes>(
    block: &Block,
    at: usize,
    active: L::M,
    found: L::M,
    hit: L::D,
    steps: L::I,
    results: &mut Results,
) {
    let run = L::load_int(&LANES) + L::splat_int(block.ray[at]);
    let together = active & L::eq_int(run, L::load_int(&block.ray[at..]));
    if L::bits(together).count_ones() as usize == L::WIDTH {
        let first = block.ray[at] as usize;
        let hit = L::select_wide(found, hit, L::splat_wide(f64::NAN));
        L::store_wide(hit, &mut results.drop[first..]);
        L::store_int(steps, &mut results.steps[first..]);
        return;
    }
    let (mut drops, mut counts) = ([0.0; 16], [0; 16]);
    L::store_wide(hit, &mut drops);
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
