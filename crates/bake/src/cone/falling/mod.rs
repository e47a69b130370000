//! The steepest rise from anywhere around a texel to where the surface falls outwards.
//!
//! A ray that left the axis of a cone above the surface and is below it can come out again only where the surface
//! falls along its way, so a cone that holds no such point is pierced once. For each *cell* the search finds the
//! least upper bound of `(h(y) - h(x)) / |y - x|` over `x` in the cell and those `y` of the bilinear surface at which
//! `h` falls in the direction `y - x`; a texel gets the greatest of its four cells.
//!
//! There is no closed form for two free points and that condition. Pairs of cells that touch are bounded by
//! [`near::near_falling`]. All others are found by branch and bound, over tiles in a [`packet::Packet`] and then over parts
//! of cells ([`patch::steepest`]) until what is left can be no more than [`TOLERANCE`] steeper than a
//! rise that is there. That much is added, so ratios are never too wide.
//!
//! No relaxed cone needs to be narrower than the empty one: a cell as steep as its texels' empty cones is done with.

mod cells;
mod near;
mod packet;
mod patch;
mod texels;

use heightfield::HeightField;
use heightfield::lanes::{Kernel, Lanes, dispatch};
use rayon::prelude::*;

use super::exact::lattice::{Lattice, Plane, ROUND};
use super::grid::{Grid, Sites, Stack};
use crate::{BakeError, Progress, maps};
use cells::Cell;
use packet::{Apex, NOBODY, Packet};
use texels::Texel;

/// How much steeper than necessary a rise may be given, times the rise.
const TOLERANCE: f64 = 1.0 / 256.0;

/// Rows of a strip, which one thread works through.
const STRIP: usize = 16;
/// Strips between two looks at the progress.
const BATCH: usize = 8;

/// Bytes that a bake needs besides its result.
pub(super) fn working_bytes(grid: maps::Grid) -> u128 {
    let area = |more: usize| (grid.width + more) as u128 * (grid.height + more) as u128;
    let cells: u128 = grid.cells().map(|n| n as u128).iter().product();
    // Heights and slopes with their margins, the empty cones, tiles.
    4 * (area(2 * ROUND) + area(ROUND + 2) + area(0) + cells)
}

/// The steepest rises that count, one a texel, row by row, none of them above `empty`, those of empty cones.
pub(super) fn steepest_rises(
    field: &HeightField,
    mut empty: Vec<f32>,
    progress: &mut Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let grid = &Grid::new(field, Sites::Cells);
    let cell = Cell { grid, empty: &empty, size: [field.width(), field.height()] };
    let cells = search(field, grid, cell, progress)?;
    empty.par_chunks_mut(field.width()).enumerate().for_each(|(j, row)| {
        let (upper, lower) = (cells.row(j as i64 - 1), cells.row(j as i64));
        for (i, slope) in row.iter_mut().enumerate() {
            *slope = slope.min(upper[i].max(upper[i + 1]).max(lower[i].max(lower[i + 1])));
        }
    });
    Ok(empty)
}

/// The steepest rises of the published definition, one a texel, row by row.
pub(super) fn steepest_between_texels(
    field: &HeightField,
    progress: &mut Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let (width, height) = (field.width(), field.height());
    let grid = &Grid::new(field, Sites::Cells);
    let texel = Texel { field, step: [width, height].map(|n| 1.0 / n as f64) };
    let texels = search(field, grid, texel, progress)?;
    Ok((0..height as i64).flat_map(|j| texels.row(j)[1..][..width].iter().copied()).collect())
}

/// The slope of each apex, by texel from column and row -1 on.
fn search<A: Apex>(
    field: &HeightField,
    grid: &Grid<'_>,
    apex: A,
    progress: &mut Progress<'_>,
) -> Result<Plane, BakeError> {
    let (width, height) = (field.width(), field.height());
    let lattice = &Lattice::new(field);
    let first = -field.first_texel();
    let mut plane = Plane::new(width, height, 0.0);
    let stride = plane.stride;
    progress.report(0, height + 2)?;
    for (batch, rows) in plane.values.chunks_mut(BATCH * STRIP * stride).enumerate() {
        let done = batch * BATCH * STRIP;
        rows.par_chunks_mut(STRIP * stride).enumerate().for_each(|(strip, slopes)| {
            let top = (done + strip * STRIP) as i64 - 1;
            dispatch(Strip { grid, lattice, apex, first, top, width, slopes });
        });
        progress.report(done + rows.len() / stride, height + 2)?;
    }
    Ok(plane)
}

/// Rows of apexes from `top` on.
struct Strip<'a, A> {
    grid: &'a Grid<'a>,
    lattice: &'a Lattice,
    apex: A,
    /// The site of texel 0.
    first: i64,
    top: i64,
    width: usize,
    slopes: &'a mut [f32],
}

impl<A: Apex> Kernel for Strip<'_, A> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { grid, lattice, apex, first, top, width, slopes } = self;
        let stride = (width + 2).next_multiple_of(ROUND);
        let mut stack = Stack::new();
        let mut partners = vec![NOBODY; stride];
        for (j, row) in (top..).zip(slopes.chunks_exact_mut(stride)) {
            let mut beside = NOBODY;
            for (at, slopes) in row.chunks_exact_mut(L::WIDTH).enumerate() {
                let column = at * L::WIDTH;
                let i = column as i64 - 1;
                let mut enough = [0.0; ROUND];
                for (lane, (slope, enough)) in slopes.iter_mut().zip(&mut enough).enumerate() {
                    let texel = [i + lane as i64, j];
                    [*slope, *enough] = apex.start(texel, texel.map(|at| at + first));
                }
                if slopes.iter().zip(&enough).all(|(slope, enough)| slope >= enough) {
                    beside = NOBODY;
                    partners[column..][..L::WIDTH].fill(NOBODY);
                    continue;
                }
                // The other corners of texels are the same.
                let away = |x: i64| if A::EXTENT > 0.0 { x } else { 0 };
                let heights =
                    [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| lattice.from(i + away(x), j + away(y)));
                let site = [i + first, j + first];
                let mut packet = Packet::<L, A>::new(grid, apex, site, heights, slopes, &enough);
                for lane in 0..L::WIDTH {
                    let above = partners[column + lane];
                    let partner = if above == NOBODY { beside } else { above };
                    if partner != NOBODY {
                        packet.seed(lane, partner);
                    }
                }
                packet.search(&mut stack);
                slopes.copy_from_slice(&packet.slopes[..L::WIDTH]);
                beside = packet.partners[L::WIDTH - 1];
                partners[column..][..L::WIDTH].copy_from_slice(&packet.partners[..L::WIDTH]);
            }
        }
    }
}
