//! Rises close to a texel: the steepest points of the cells around it, and texels a few steps away.

use heightfield::lanes::{Kernel, Lanes};

use super::lattice::{Lattice, NEAR, ROUND};

/// For a row of texels, from column -1 on: the steepest rise to a texel near by.
pub(super) struct ToTexels<'a> {
    pub lattice: &'a Lattice,
    pub step: [f64; 2],
    pub row: i64,
    pub out: &'a mut [f32],
}

impl Kernel for ToTexels<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { lattice, step, row, out } = self;
        let reach = NEAR;
        let size = (2 * reach + 1) as usize;
        // 1 / distance, 0 for the texel itself.
        let inverse: Vec<f32> = (0..size * size)
            .map(|at| {
                let offset = [(at % size) as i64 - reach, (at / size) as i64 - reach];
                let away = (offset[0] as f64 * step[0]).hypot(offset[1] as f64 * step[1]);
                if away > 0.0 { away.recip() as f32 } else { 0.0 }
            })
            .collect();
        for (at, out) in out.chunks_exact_mut(L::WIDTH).enumerate() {
            let i = (at * L::WIDTH) as i64 - 1;
            let low = L::load(lattice.from(i, row));
            let mut steepest = L::splat(0.0);
            for (y, inverse) in (row - reach..).zip(inverse.chunks_exact(size)) {
                let heights = &lattice.from(i - reach, y)[..size + ROUND];
                for (x, &inverse) in inverse.iter().enumerate() {
                    let rise = L::load(&heights[x..]) - low;
                    steepest = L::max(steepest, rise * L::splat(inverse));
                }
            }
            L::store(steepest, out);
        }
    }
}

/// For a row of texels, from column -1 on: the steepest rise inside one of the four cells around each, and
/// out of these into one of the twelve around them, close to where they meet.
///
/// The gradient of a cell is steepest at a corner. Out of a cell it counts where it leads outwards.
pub(super) struct ToCells<'a> {
    pub lattice: &'a Lattice,
    pub step: [f64; 2],
    pub row: i64,
    pub out: &'a mut [f32],
}

impl Kernel for ToCells<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { lattice, step, row, out } = self;
        let per_unit = step.map(|step| L::splat(step.recip() as f32));
        for (at, out) in out.chunks_exact_mut(L::WIDTH).enumerate() {
            let i = (at * L::WIDTH) as i64 - 1;
            let mut square = L::splat(0.0);
            for y in -2..=1_i64 {
                let (upper, lower) = (lattice.from(i - 2, row + y), lattice.from(i - 2, row + y + 1));
                for x in -2..=1_i64 {
                    let at = (x + 2) as usize;
                    let corners = [&upper[at..], &upper[at + 1..], &lower[at..], &lower[at + 1..]];
                    square = L::max(square, steepest_corner::<L>(corners, per_unit, [x, y]));
                }
            }
            L::store(L::sqrt(square), out);
        }
    }
}

/// The square of the greatest gradient that counts at the corners of the cell at `place` from the texel.
#[inline(always)]
fn steepest_corner<L: Lanes>(corners: [&[f32]; 4], per_unit: [L::F; 2], place: [i64; 2]) -> L::F {
    let [h00, h10, h01, h11] = corners.map(L::load);
    let u = [(h10 - h00) * per_unit[0], (h11 - h01) * per_unit[0]];
    let v = [(h01 - h00) * per_unit[1], (h11 - h10) * per_unit[1]];
    let zero = L::splat(0.0);
    // The side of the four cells that this one lies on: 0 within, 1 behind them, -1 before.
    let side = place.map(|at| i64::from(at == 1) - i64::from(at == -2));
    let mut greatest = zero;
    for (y, du) in u.into_iter().enumerate() {
        for (x, dv) in v.into_iter().enumerate() {
            // Only corners of the four cells.
            let touches = |side: i64, far: usize| side == 0 || (side > 0) == (far == 0);
            if !touches(side[0], x) || !touches(side[1], y) {
                continue;
            }
            let mut square = du * du + dv * dv;
            for (side, slope) in [(side[0], du), (side[1], dv)] {
                if side > 0 {
                    square = L::select(L::lt(zero, slope), square, zero);
                } else if side < 0 {
                    square = L::select(L::lt(slope, zero), square, zero);
                }
            }
            greatest = L::max(greatest, square);
        }
    }
    greatest
}
