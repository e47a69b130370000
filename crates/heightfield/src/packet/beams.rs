//! Bundles of neighbouring rays that go down together.
//!
//! Sixteen rays, then four, share one coarse walk along the middle of a box around them, over a
//! pyramid whose margin is as wide as the box. Down to where that walk stops all of them are free.

use super::block::{BLOCK, ROOM};
use super::grid::{Axis, Coarse, Grid};
use crate::lanes::Lanes;
use crate::margin::Margins;
use crate::{HeightField, RayArray};

/// Rays in the smaller bundles.
pub const FEW: usize = 4;
/// Rays in the larger ones.
const MANY: usize = 16;

/// Farthest position, in cells, that `f32` gives well within the half cell that is allowed for it.
const FARTHEST: f32 = (1 << 18) as f32;
/// Allowed for rounding, and for the overshoot of steps.
const ALLOWANCE: f32 = 0.5;

/// For each bundle: least and largest x and y at drop 0, then at drop 1, in cells.
type Boxes = [[f32; ROOM / FEW]; 8];

/// The drop down to which each group of four rays is free of surface: 0 where rays are too far apart.
#[inline(always)]
pub fn free_drops<L: Lanes>(
    field: &HeightField,
    margins: &Margins,
    origins: RayArray<'_>,
    directions: RayArray<'_>,
) -> [f32; ROOM / FEW] {
    let mut free = [0.0; ROOM / FEW];
    let bundles = origins.len().div_ceil(FEW);
    let boxes = enclose::<L>(field, origins, directions, bundles);
    let mut larger: Boxes = [[0.0; ROOM / FEW]; 8];
    let groups = bundles.div_ceil(MANY / FEW);
    for (k, (row, from)) in larger.iter_mut().zip(&boxes).enumerate() {
        for (to, four) in row.iter_mut().zip(from[..bundles].chunks(MANY / FEW)) {
            *to = four.iter().copied().fold(four[0], |a, b| if (a < b) == (k % 2 == 0) { a } else { b });
        }
    }
    let mut shared = [0.0; ROOM / FEW];
    descend::<L>(field, margins, &larger, groups, &mut shared);
    for (free, at) in free[..bundles].iter_mut().zip(0..) {
        *free = shared[at / (MANY / FEW)];
    }
    descend::<L>(field, margins, &boxes, bundles, &mut free);
    free
}

/// Boxes around groups of four rays.
#[inline(always)]
fn enclose<L: Lanes>(
    field: &HeightField,
    origins: RayArray<'_>,
    directions: RayArray<'_>,
    bundles: usize,
) -> Boxes {
    // The rays of a group at the same place in four arrays, so that one vector holds many groups.
    let mut rays = [[[0.0_f32; ROOM / FEW]; 6]; FEW];
    let last = origins.len() - 1;
    for i in 0..bundles * FEW {
        let (origin, direction) = (origins.get_f32(i.min(last)), directions.get_f32(i.min(last)));
        for k in 0..3 {
            rays[i % FEW][k][i / FEW] = origin[k];
            rays[i % FEW][3 + k][i / FEW] = direction[k];
        }
    }
    let highest = L::splat(field.pyramid().highest());
    let size = [L::splat(field.width() as f32), L::splat(field.height() as f32)];
    let shift = L::splat(0.5 + field.first_texel() as f32);
    let mut boxes: Boxes = [[0.0; ROOM / FEW]; 8];
    for at in (0..bundles).step_by(L::WIDTH) {
        let mut least = [L::splat(f32::INFINITY); 4];
        let mut largest = [L::splat(f32::NEG_INFINITY); 4];
        for part in &rays {
            let scale = L::splat(-1.0) / L::load(&part[5][at..]);
            let begin = highest - L::load(&part[2][at..]);
            for k in 0..2 {
                let direction = L::load(&part[3 + k][at..]) * size[k] * scale;
                let start = L::load(&part[k][at..]) * size[k] - shift - begin * direction;
                for (place, x) in [(k, start), (2 + k, start + direction)] {
                    least[place] = L::min(x, least[place]);
                    largest[place] = L::max(x, largest[place]);
                }
            }
        }
        for k in 0..4 {
            L::store(least[k], &mut boxes[2 * k][at..]);
            L::store(largest[k], &mut boxes[2 * k + 1][at..]);
        }
    }
    boxes
}

/// Walks the middles of boxes down from the given drops.
#[inline(always)]
fn descend<L: Lanes>(
    field: &HeightField,
    margins: &Margins,
    boxes: &Boxes,
    count: usize,
    free: &mut [f32; ROOM / FEW],
) {
    let [nx, ny] = field.cells();
    let gx = Grid::<L>::new(nx, field.is_periodic());
    let gy = Grid::<L>::new(ny, field.is_periodic());
    let limit = L::splat(FARTHEST);
    for at in (0..count).step_by(L::WIDTH) {
        let mut spread = L::splat(0.0);
        let mut middle = [L::splat(0.0); 4];
        let mut sound = L::first(count - at);
        for (k, middle) in middle.iter_mut().enumerate() {
            let (least, largest) = (L::load(&boxes[2 * k][at..]), L::load(&boxes[2 * k + 1][at..]));
            *middle = (least + largest) * L::splat(0.5);
            spread = L::max((largest - least) * L::splat(0.5), spread);
            sound = sound & L::le(L::abs(*middle), limit) & L::le(largest - least, limit);
        }
        // One pyramid for all lanes: as wide as most of them need, and for no lane too narrow.
        let mut widths = [0.0; 16];
        L::store(spread, &mut widths);
        let widths = &mut widths[..L::WIDTH.min(count - at)];
        widths.sort_unstable_by(f32::total_cmp);
        let Some(bound) = margins.at_least(widths[widths.len() * 3 / 4] + ALLOWANCE) else { continue };
        let width = L::splat((1_u32 << bound.margin()) as f32 - ALLOWANCE);
        let running = sound & L::le(spread, width);
        let level = L::splat_int((bound.margin() + 2).max(BEGIN).min(bound.top()) as i32);
        let x = along::<L>(middle[0], middle[2], &gx);
        let y = along::<L>(middle[1], middle[3], &gy);
        let start = L::load(&free[at..]);
        let mut rays = Coarse::new(x, y, start, level, running);
        while L::any(rays.running) {
            rays.step(bound, &gx, &gy);
        }
        L::store(L::select(running, rays.drop, start), &mut free[at..]);
    }
}

/// The axis of a ray from one place, in cells, at drop 0 to another at drop 1.
#[inline(always)]
fn along<L: Lanes>(from: L::F, to: L::F, grid: &Grid<L>) -> Axis<L> {
    let direction = to - from;
    Axis {
        start: grid.tiles(from),
        direction: grid.tiles(direction),
        inverse: Axis::<L>::inverse_of(direction),
    }
}

/// Level at which bundles begin, at least.
const BEGIN: usize = 4;

const _: () = assert!(BLOCK.is_multiple_of(MANY));
