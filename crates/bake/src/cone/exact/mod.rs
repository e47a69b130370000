//! The steepest rise from anywhere around a texel to anywhere on the surface, exactly.
//!
//! For each texel, with `D` the four cells around it: the least upper bound of `(h(y) - h(x)) / |y - x|` over
//! `x` in `D` and all `y` of the bilinear surface. Few of these pairs need be looked at:
//!
//! 1. The mean slope of a way is not more than that of its steepest part. Inside one cell that is the gradient
//!    at most, greatest at a corner. So what remains are ways that start on the border of `D` and lead out.
//! 2. Let `x` be inside an edge, and `y` not at a corner. If `y` is inside a cell or on an edge parallel to that
//!    of `x`, moving both along that edge changes the rise linearly and the distance not at all, so one way or the
//!    other it does not get less steep until `x` comes to a corner or `y` to an edge across. If `y` is on
//!    an edge across, the rise is `c + g . (y - x)`, and its quotient by `|y - x|` has no maximum but
//!    where `c` is 0, and then it is the same for all multiples of `y - x`. So one of both is a corner of cells.
//! 3. What is left: from a *corner* to any point of a cell ([`pairs::to_cell`]); from *inside an edge* to
//!    a corner ([`pairs::to_edge`]); and `y` as close to `x` as one likes, where the gradient of the cell of `y`
//!    counts if it leads outwards ([`local::ToCells`]). All have closed forms.
//!
//! Corners and edges belong to several texels, so rises are found once for each: `2` has to look at
//! corners, `3` at both kinds of edges. Whatever is not steeper than what *all* its texels know already needs
//! no looking at, and with the gradients and the texels close by known first, that is most of rough ground.
//!
//! The rest is branch and bound over tiles, with [`packet::Packet`] for as many apexes side by side as the processor
//! has lanes. Tests are in single precision, with a margin; what passes them is worked out in double precision.
//! On planes everything ties: what is steeper by rounding alone is left out, and the ratios are made that much narrower.

pub(super) mod lattice;
mod local;
mod packet;
mod pairs;

use heightfield::HeightField;
use heightfield::lanes::{Kernel, Lanes, Level, dispatch_at};
use rayon::prelude::*;

use super::grid::{Grid, Sites, Stack};
use crate::{BakeError, Progress, maps};
use lattice::{Lattice, MARGIN, Plane, ROUND};
use local::{ToCells, ToTexels};
use packet::{From, NOBODY, Packet};

/// Bytes that a bake needs besides its result.
pub(super) fn working_bytes(grid: maps::Grid) -> u128 {
    let area = |more: usize| (grid.width + more) as u128 * (grid.height + more) as u128;
    let cells: u128 = grid.cells().map(|n| n as u128).iter().product();
    // Heights; slopes of texels, corners and edges; the slopes again without padding; tiles.
    4 * area(2 * MARGIN as usize + 2 * ROUND) + 3 * 4 * area(ROUND + 2) + 4 * area(0) + 4 * cells
}

/// Rows of a strip, which one thread works through.
const STRIP: usize = 32;
/// Strips between two looks at the progress.
const BATCH: usize = 8;

/// A slope that stands for all that are not steeper: a bit less than 1, so that what rounds to 1 is found.
pub(super) const FLATTEST: f32 = 1.0 - 1e-6;

/// The steepest rises, one a texel, row by row; at least [`FLATTEST`].
pub(super) fn steepest_rises(
    field: &HeightField,
    progress: &mut Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    steepest_rises_at(Level::best(), field, progress)
}

fn steepest_rises_at(
    level: Level,
    field: &HeightField,
    progress: &mut Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let (width, height) = (field.width(), field.height());
    let job = Job {
        level,
        grid: &Grid::new(field, Sites::Cells),
        lattice: &Lattice::new(field),
        first: -field.first_texel(),
    };
    let mut progress = Rows { progress, done: 0, total: 3 * (height + 2) };
    progress.add(0)?;

    let mut corners = Plane::new(width, height, 0.0);
    let step = [width, height].map(|n| 1.0 / n as f64);
    let lattice = job.lattice;
    corners.rows_mut(|row, out| dispatch_at(level, ToTexels { lattice, step, row, out }));
    let mut texels = Plane::new(width, height, 0.0);
    texels.rows_mut(|row, out| dispatch_at(level, ToCells { lattice, step, row, out }));
    texels.raise(width, height, &corners, &AROUND_AND_SELF);

    corners.least_of(width, height, &texels, &AROUND);
    job.search(From::Points, &mut corners, None, &mut progress)?;
    texels.raise(width, height, &corners, &AROUND);
    let mut edges = Plane::new(width, height, 0.0);
    for axis in 0..2 {
        edges.least_of(width, height, &texels, &TEXELS_OF_EDGE[axis]);
        job.search(From::Edges(axis), &mut edges, Some(&corners), &mut progress)?;
        texels.raise(width, height, &edges, &EDGES_OF_TEXEL[axis]);
    }
    let rows = (0..height as i64).flat_map(|j| texels.row(j)[1..][..width].iter());
    Ok(rows.map(|&slope| slope.max(FLATTEST)).collect())
}

/// The steepest rises between texel centres, one a texel, row by row; at least [`FLATTEST`].
pub(super) fn steepest_between_texels(
    field: &HeightField,
    progress: &mut Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let (width, height) = (field.width(), field.height());
    let job = Job {
        level: Level::best(),
        grid: &Grid::new(field, Sites::Texels),
        lattice: &Lattice::new(field),
        first: -field.first_texel(),
    };
    let mut progress = Rows { progress, done: 0, total: height + 2 };
    progress.add(0)?;
    let mut texels = Plane::new(width, height, f32::INFINITY);
    let step = [width, height].map(|n| 1.0 / n as f64);
    let lattice = job.lattice;
    texels.rows_mut(|row, out| {
        if (0..height as i64).contains(&row) {
            dispatch_at(job.level, ToTexels { lattice, step, row, out });
            out[0] = f32::INFINITY;
            out[1..][..width].iter_mut().for_each(|slope| *slope = slope.max(FLATTEST));
            out[width + 1..].fill(f32::INFINITY);
        }
    });
    job.search(From::Texels, &mut texels, None, &mut progress)?;
    let rows = (0..height as i64).flat_map(|j| texels.row(j)[1..][..width].iter());
    Ok(rows.copied().collect())
}

/// Offsets of a texel's neighbours.
const AROUND: [[i64; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];
const AROUND_AND_SELF: [[i64; 2]; 9] =
    [[-1, -1], [0, -1], [1, -1], [-1, 0], [0, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];
/// Offsets of the edges on the border of a texel's cells, along each axis; an edge is named by the first of
/// its ends.
const EDGES_OF_TEXEL: [[[i64; 2]; 4]; 2] =
    [[[-1, -1], [0, -1], [-1, 1], [0, 1]], [[-1, -1], [-1, 0], [1, -1], [1, 0]]];
/// Offsets of the texels whose cells have the edge on their border.
const TEXELS_OF_EDGE: [[[i64; 2]; 4]; 2] =
    [[[1, 1], [0, 1], [1, -1], [0, -1]], [[1, 1], [1, 0], [-1, 1], [-1, 0]]];

impl Plane {
    /// Calls `fill` for all rows in parallel, with the number of the row.
    fn rows_mut(&mut self, fill: impl Fn(i64, &mut [f32]) + Sync) {
        let rows = self.values.par_chunks_mut(self.stride).enumerate();
        rows.with_min_len(4).for_each(|(at, row)| fill(at as i64 - 1, row));
    }

    /// Each texel of the map becomes the greatest of itself and the `others` at these offsets.
    fn raise(&mut self, width: usize, height: usize, others: &Plane, offsets: &[[i64; 2]]) {
        self.rows_mut(|j, row| {
            if (0..height as i64).contains(&j) {
                let row = &mut row[1..][..width];
                for [x, y] in offsets {
                    let others = &others.row(j + y)[(1 + x) as usize..][..width];
                    row.iter_mut().zip(others).for_each(|(value, &other)| *value = value.max(other));
                }
            }
        });
    }

    /// Each becomes the least of the texels of the map at these offsets, at least [`FLATTEST`]; infinite
    /// without any.
    fn least_of(&mut self, width: usize, height: usize, texels: &Plane, offsets: &[[i64; 2]]) {
        self.rows_mut(|j, row| {
            row.fill(f32::INFINITY);
            for [x, y] in offsets.iter().filter(|[_, y]| (0..height as i64).contains(&(j + y))) {
                let texels = &texels.row(j + y)[1..][..width];
                // Column `i` of the row takes texel `i + x`.
                let row = &mut row[(1 - x) as usize..];
                row.iter_mut()
                    .zip(texels)
                    .for_each(|(value, &texel)| *value = value.min(texel.max(FLATTEST)));
            }
        });
    }
}

/// Progress in rows of several passes.
struct Rows<'a, 'b> {
    progress: &'a mut Progress<'b>,
    done: usize,
    total: usize,
}

impl Rows<'_, '_> {
    fn add(&mut self, rows: usize) -> Result<(), BakeError> {
        self.done += rows;
        self.progress.report(self.done, self.total)
    }
}

/// What all passes share.
struct Job<'a> {
    level: Level,
    grid: &'a Grid<'a>,
    lattice: &'a Lattice,
    /// The site of texel 0.
    first: i64,
}

impl Job<'_> {
    /// Raises the slopes of `plane` to the steepest rise from each of its apexes, where that is more. Edges
    /// are given what their ends reach.
    fn search(
        &self,
        from: From,
        plane: &mut Plane,
        ends: Option<&Plane>,
        progress: &mut Rows<'_, '_>,
    ) -> Result<(), BakeError> {
        let stride = plane.stride;
        for (batch, rows) in plane.values.chunks_mut(BATCH * STRIP * stride).enumerate() {
            rows.par_chunks_mut(STRIP * stride).enumerate().for_each(|(strip, slopes)| {
                let top = ((batch * BATCH + strip) * STRIP) as i64 - 1;
                dispatch_at(self.level, Strip { job: self, from, top, stride, ends, slopes });
            });
            progress.add(rows.len() / stride)?;
        }
        Ok(())
    }
}

/// Rows from `top` on.
struct Strip<'a> {
    job: &'a Job<'a>,
    from: From,
    top: i64,
    stride: usize,
    ends: Option<&'a Plane>,
    slopes: &'a mut [f32],
}

impl Kernel for Strip<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { job: &Job { grid, lattice, first, .. }, from, top, stride, ends, slopes } = self;
        let mut stack = Stack::new();
        let mut partners = vec![NOBODY; stride];
        let way = match from {
            From::Points | From::Texels => [0, 0],
            From::Edges(0) => [1, 0],
            From::Edges(_) => [0, 1],
        };
        for (j, row) in (top..).zip(slopes.chunks_exact_mut(stride)) {
            let mut beside = NOBODY;
            for (at, slopes) in row.chunks_exact_mut(L::WIDTH).enumerate() {
                if slopes.iter().all(|slope| slope.is_infinite()) {
                    continue;
                }
                let column = at * L::WIDTH;
                let i = column as i64 - 1;
                let heights = [lattice.from(i, j), lattice.from(i + way[0], j + way[1])];
                let reach = match ends {
                    Some(ends) => reach::<L>(grid, ends, [column, (j + 1) as usize], way, slopes),
                    None => L::splat(f32::INFINITY),
                };
                let site = [i + first, j + first];
                let mut packet = Packet::<L>::new(grid, from, site, heights, slopes, reach);
                if matches!(from, From::Points | From::Texels) {
                    for lane in 0..L::WIDTH {
                        let above = partners[column + lane];
                        let partner = if above == NOBODY { beside } else { above };
                        if partner != NOBODY && slopes[lane].is_finite() {
                            packet.seed(lane, partner);
                        }
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

/// How far from an edge, squared, a texel may lie to which it rises with more than `slopes` from inside, when
/// its ends do not rise more than `ends` say.
///
/// Seen from the texel the slopes along the edge are `m cos(angle)`, with the steepest, `m`, inside and each end at
/// most an angle of `length / distance` away: `m <= end / cos(length / distance)`. From twice its length
/// on, the cosine is at least `1 / (1 + 0.56 angle^2)`.
#[inline(always)]
fn reach<L: Lanes>(
    grid: &Grid<'_>,
    ends: &Plane,
    [column, row]: [usize; 2],
    way: [i64; 2],
    slopes: &[f32],
) -> L::F {
    let at = row * ends.stride + column;
    let other = at + way[1] as usize * ends.stride + way[0] as usize;
    let load = |at: usize| {
        let mut values = [f32::INFINITY; ROUND];
        let found = &ends.values[at.min(ends.values.len())..];
        let n = found.len().min(L::WIDTH);
        values[..n].copy_from_slice(&found[..n]);
        L::load(&values)
    };
    let end = L::min(load(at), load(other)) * L::splat(1.0 + 1e-6);
    let length = if way[0] == 1 { grid.step[0] } else { grid.step[1] };
    let square = L::splat(length * length);
    let excess = L::load(slopes) - end;
    let far = square * L::splat(0.56) * end / excess;
    let far = L::max(far, square * L::splat(4.0));
    L::select(L::lt(L::splat(0.0), excess), far, L::splat(f32::INFINITY))
}

#[cfg(test)]
mod tests;
