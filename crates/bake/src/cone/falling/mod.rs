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
//!
//! The published construction is here by its name, for comparison: [`texels`].

mod blocks;
mod cells;
mod near;
mod packet;
mod patch;
mod rays;
mod texels;

use std::time::{Duration, Instant};

use heightfield::HeightField;
use heightfield::lanes::{Kernel, Lanes, dispatch};
use rayon::prelude::*;

use super::exact::lattice::{Lattice, Plane, ROUND};
use super::grid::{Grid, Sites, Stack};
use crate::{BakeError, Progress, maps};
use blocks::Blocks;
use cells::Cells;
use texels::Texels;

/// How much steeper than necessary a rise may be given, times the rise.
const TOLERANCE: f64 = 1.0 / 256.0;

/// Rows of a strip, which one thread works through.
const STRIP: usize = 8;
/// How long strips may take between two looks at the progress, if there is more than one a thread; more are taken
/// together while they take less than half of it.
const PATIENCE: Duration = Duration::from_millis(250);

/// Bytes that a bake needs besides its result.
pub(super) fn working_bytes(grid: maps::Grid) -> u128 {
    let area = |more: usize| (grid.width + more) as u128 * (grid.height + more) as u128;
    let cells: u128 = grid.cells().map(|n| n as u128).iter().product();
    // Heights and slopes with their margins, the empty cones; tiles or blocks.
    4 * (area(2 * ROUND) + area(ROUND + 2) + area(0)) + blocks::bytes(cells)
}

/// The steepest rises that count, one a texel, row by row, none of them above `empty`, those of empty cones.
pub(super) fn steepest_rises(
    field: &HeightField,
    mut empty: Vec<f32>,
    progress: &mut Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let grid = &Grid::new(field, Sites::Cells);
    let lattice = &Lattice::new(field);
    let size = [field.width(), field.height()];
    let cells = search(field, Cells { grid, lattice, empty: &empty, size }, progress)?;
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
    let blocks = &Blocks::new(field);
    let step = [width, height].map(|n| 1.0 / n as f64);
    let texels = search(field, Texels { field, blocks, step }, progress)?;
    Ok((0..height as i64).flat_map(|j| texels.row(j)[1..][..width].iter().copied()).collect())
}

/// What cones stand on.
trait Apexes: Copy + Sync {
    /// What is known beforehand of the one at this texel and site, and a slope above which nobody wants to know more.
    fn start(self, texel: [i64; 2], site: [i64; 2]) -> [f32; 2];

    /// Finds the steepest rises of as many in a row as there are lanes.
    fn raise<L: Lanes>(self, row: Row<'_>, stack: &mut Stack);
}

/// Apexes in a row and what is known of them.
struct Row<'a> {
    /// The first, as a texel and as a site.
    texel: [i64; 2],
    site: [i64; 2],
    slopes: &'a mut [f32],
    /// Slopes above which nobody wants to know more.
    enough: &'a [f32],
    /// Where the steepest rise may lead to, as a site, and then where one was found; may lie on another period.
    partners: &'a mut [Option<[i32; 2]>],
}

/// The slope of each apex, by texel from column and row -1 on.
fn search<A: Apexes>(
    field: &HeightField,
    apexes: A,
    progress: &mut Progress<'_>,
) -> Result<Plane, BakeError> {
    let (width, height) = (field.width(), field.height());
    let first = -field.first_texel();
    let mut plane = Plane::new(width, height, 0.0);
    let stride = plane.stride;
    let threads = rayon::current_num_threads();
    let (mut done, mut strips) = (0, threads);
    while done < height + 2 {
        progress.report(done, height + 2)?;
        let start = Instant::now();
        let rows = (strips * STRIP).min(height + 2 - done);
        let batch = &mut plane.values[done * stride..][..rows * stride];
        batch.par_chunks_mut(STRIP * stride).enumerate().for_each(|(strip, slopes)| {
            let top = (done + strip * STRIP) as i64 - 1;
            dispatch(Strip { apexes, first, top, stride, slopes });
        });
        done += rows;
        strips = match start.elapsed() {
            long if long > PATIENCE => (strips / 2).max(threads),
            short if short < PATIENCE / 2 => strips * 2,
            _ => strips,
        };
    }
    progress.report(done, height + 2)?;
    Ok(plane)
}

/// Rows of apexes from `top` on.
struct Strip<'a, A> {
    apexes: A,
    /// The site of texel 0.
    first: i64,
    top: i64,
    stride: usize,
    slopes: &'a mut [f32],
}

impl<A: Apexes> Kernel for Strip<'_, A> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { apexes, first, top, stride, slopes } = self;
        let mut stack = Stack::new();
        let mut partners = vec![None; stride];
        for (j, row) in (top..).zip(slopes.chunks_exact_mut(stride)) {
            let mut beside = None;
            for (at, slopes) in row.chunks_exact_mut(L::WIDTH).enumerate() {
                let i = (at * L::WIDTH) as i64 - 1;
                let partners = &mut partners[at * L::WIDTH..][..L::WIDTH];
                let mut enough = [0.0; ROUND];
                for (lane, (slope, enough)) in slopes.iter_mut().zip(&mut enough).enumerate() {
                    let texel = [i + lane as i64, j];
                    [*slope, *enough] = apexes.start(texel, texel.map(|at| at + first));
                }
                if slopes.iter().zip(&enough).all(|(slope, enough)| slope >= enough) {
                    beside = None;
                    partners.fill(None);
                    continue;
                }
                for partner in partners.iter_mut() {
                    *partner = partner.or(beside);
                }
                let (texel, site) = ([i, j], [i + first, j + first]);
                let enough = &enough[..L::WIDTH];
                let row = Row { texel, site, slopes, enough, partners: &mut *partners };
                apexes.raise::<L>(row, &mut stack);
                beside = partners[L::WIDTH - 1];
            }
        }
    }
}
