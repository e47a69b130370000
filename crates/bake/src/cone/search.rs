//! The steepest rise from every site: branch and bound over the tiles of the grid.
//!
//! Sites are worked through in blocks, row by row. A block collects the groups of tiles that could matter to
//! any of its sites, by their highest points; each site then tests these groups, the tiles of those that
//! remain and the sites of those, by bounding planes. The neighbours' results are tried first, which on
//! smooth ground leaves little to find.

use rayon::prelude::*;

use super::grid::{Block, Bounds, Grid, Tile};
use super::pair::may_rise;
use crate::{BakeError, Progress};

/// Sites along the side of a block.
const BLOCK: usize = 8;
/// Sites between two looks at the progress.
const BATCH: usize = 1 << 17;
/// What a distance may be too long by through rounding, UV units.
const GAP_MARGIN: f32 = 1e-6;

/// The site that a cone stands on.
pub(super) struct Apex {
    /// Position; may lie on another period of the map.
    pub site: [i64; 2],
    /// Corner heights.
    pub heights: [f32; 4],
}

/// What the searches differ in.
pub(super) trait Rule: Sync {
    /// A slope that the result is not below, at least 1: nothing flatter is looked for.
    fn floor(&self, grid: &Grid<'_>, apex: &Apex) -> f32;

    /// Sites up to this far along both axes are tried first.
    const FIRST: i64;

    /// Whether a site at this distance counts in [`Self::floor`] already.
    fn is_near(&self, offset: [i64; 2]) -> bool;

    /// Whether a tile may matter; `low` and `high` bound the way to its points, in UV units.
    fn admits(&self, tile: &Tile, low: [f32; 2], high: [f32; 2]) -> bool;

    /// The slope to the site at `offset` from the apex, with `heights` at its corners, or anything not
    /// above `best` when it is not steeper than that.
    fn slope(&self, grid: &Grid<'_>, apex: &Apex, offset: [i64; 2], heights: [f32; 4], best: f64) -> f64;
}

/// The apex as tiles are tested against it: its cell, and the slope known so far.
#[derive(Clone, Copy)]
struct Stand {
    centre: [f32; 2],
    half: [f32; 2],
    heights: [f32; 4],
    slope: f32,
}

impl Bounds {
    /// Whether there may be a point to which the surface rises from the apex with more than its slope:
    /// neither the highest point nor the plane rules that out. See [`may_rise`]: here the plane stands
    /// for the corners of `b`, and `p` leads from centre to centre.
    #[inline(always)]
    fn may_matter(&self, from: &Stand) -> bool {
        let (vx, vy) = (self.centre[0] - from.centre[0], self.centre[1] - from.centre[1]);
        let length = (vx * vx + vy * vy).sqrt();
        let scale = from.slope / length.max(1e-12);
        let (px, py) = (vx * scale, vy * scale);
        let above = self.level
            + (self.slope[0] - px).abs() * self.half[0]
            + (self.slope[1] - py).abs() * self.half[1]
            - from.slope * length;
        let [h00, h10, h01, h11] = from.heights;
        let (x, y) = (px * from.half[0], py * from.half[1]);
        let below = (h00 + x + y).min(h10 - x + y).min((h01 + x - y).min(h11 - x - y));
        let gap_x = (vx.abs() - self.half[0] - from.half[0] - GAP_MARGIN).max(0.0);
        let gap_y = (vy.abs() - self.half[1] - from.half[1] - GAP_MARGIN).max(0.0);
        let rise = self.max - h00.min(h10).min(h01.min(h11));
        let square = from.slope * from.slope * (gap_x * gap_x + gap_y * gap_y);
        (above > below) & (rise > 0.0) & (rise * rise > square)
    }
}

/// Groups of tiles of a block, as arrays so that many are tested at once.
#[derive(Default)]
struct Groups {
    bounds: [Vec<f32>; 8],
    keep: Vec<u32>,
    places: Vec<[[i64; 2]; 2]>,
}

impl Groups {
    fn clear(&mut self) {
        self.bounds.iter_mut().for_each(Vec::clear);
        self.places.clear();
    }

    fn push(&mut self, bounds: &Bounds, place: [[i64; 2]; 2]) {
        let Bounds { centre, half, slope, level, max } = *bounds;
        let numbers = [centre[0], centre[1], half[0], half[1], slope[0], slope[1], level, max];
        for (list, number) in self.bounds.iter_mut().zip(numbers) {
            list.push(number);
        }
        self.places.push(place);
    }

    /// Marks the groups that [may matter](Bounds::may_matter).
    fn mark(&mut self, from: &Stand) {
        let n = self.places.len();
        self.keep.clear();
        self.keep.resize(n, 0);
        let [x, y, half_x, half_y, slope_x, slope_y, level, max] = &self.bounds;
        let (x, y, half_x, half_y) = (&x[..n], &y[..n], &half_x[..n], &half_y[..n]);
        let (slope_x, slope_y, level, max) = (&slope_x[..n], &slope_y[..n], &level[..n], &max[..n]);
        for (k, keep) in self.keep[..n].iter_mut().enumerate() {
            let bounds = Bounds {
                centre: [x[k], y[k]],
                half: [half_x[k], half_y[k]],
                slope: [slope_x[k], slope_y[k]],
                level: level[k],
                max: max[k],
            };
            *keep = u32::from(bounds.may_matter(from));
        }
    }
}

/// A site and those beside it.
const AROUND: [[i64; 2]; 5] = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]];

/// No partner.
const NOBODY: [i64; 2] = [i64::MAX; 2];

struct Scratch {
    groups: Groups,
    stack: Vec<(usize, [usize; 2], [i64; 2])>,
    /// For each site of the strip: where its steepest rise leads.
    partners: Vec<[i64; 2]>,
    /// For each site of the block: its lowest corner, and the slope known so far.
    lows: Vec<f32>,
    slopes: Vec<f32>,
}

impl Scratch {
    fn new(sites: usize) -> Self {
        Self {
            groups: Groups::default(),
            stack: Vec::new(),
            partners: vec![NOBODY; sites],
            lows: Vec::new(),
            slopes: Vec::new(),
        }
    }
}

/// The steepest rise from each of `size[0] * size[1]` sites, `first` being the upper left one. At
/// least 1: flatter ones are not told apart.
pub(super) fn steepest_rises<R: Rule>(
    grid: &Grid<'_>,
    rule: &R,
    first: [i64; 2],
    size: [usize; 2],
    progress: &mut Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let [width, height] = size;
    let mut slopes = vec![1.0_f32; width * height];
    let strips = (BATCH / (BLOCK * width)).max(1);
    progress.report(0, height)?;
    for (batch, rows) in slopes.chunks_mut(strips * BLOCK * width).enumerate() {
        let done = batch * strips * BLOCK;
        rows.par_chunks_mut(BLOCK * width).enumerate().for_each_init(
            || Scratch::new(BLOCK * width),
            |scratch, (strip, rows)| {
                let top = first[1] + (done + strip * BLOCK) as i64;
                scratch.partners.fill(NOBODY);
                for left in (0..width).step_by(BLOCK) {
                    block(grid, rule, [first[0], top], left, width, rows, scratch);
                }
            },
        );
        progress.report((done + strips * BLOCK).min(height), height)?;
    }
    Ok(slopes)
}

/// One block of a strip, `left` columns in.
fn block<R: Rule>(
    grid: &Grid<'_>,
    rule: &R,
    origin: [i64; 2],
    left: usize,
    width: usize,
    slopes: &mut [f32],
    scratch: &mut Scratch,
) {
    let rows = slopes.len() / width;
    let right = (left + BLOCK).min(width);
    let apex_at = |i: usize, j: usize| {
        let site = [origin[0] + i as i64, origin[1] + j as i64];
        Apex { site, heights: grid.heights(grid.wrap(site)) }
    };
    scratch.lows.clear();
    scratch.slopes.clear();
    for j in 0..rows {
        for i in left..right {
            let apex = apex_at(i, j);
            let at = j * width + i;
            slopes[at] = rule.floor(grid, &apex);
            let beside = if i > 0 { scratch.partners[at - 1] } else { NOBODY };
            let above = if j > 0 { scratch.partners[at - width] } else { NOBODY };
            let partner = &mut scratch.partners[at];
            for other in [beside, above].into_iter().filter(|&other| other != NOBODY) {
                for step in AROUND {
                    let site = [other[0] + step[0], other[1] + step[1]];
                    try_site(grid, rule, &apex, site, &mut slopes[at], partner);
                }
            }
            for y in -R::FIRST..=R::FIRST {
                for x in -R::FIRST..=R::FIRST {
                    let site = [apex.site[0] + x, apex.site[1] + y];
                    try_site(grid, rule, &apex, site, &mut slopes[at], partner);
                }
            }
            scratch.lows.push(apex.heights.into_iter().fold(f32::INFINITY, f32::min));
            scratch.slopes.push(slopes[at]);
        }
    }
    let sites = Block {
        first: [origin[0] + left as i64, origin[1]],
        last: [origin[0] + right as i64 - 1, origin[1] + rows as i64 - 1],
    };
    let Scratch { groups, stack, partners, lows, slopes: known } = scratch;
    groups.clear();
    grid.groups_above(&sites, lows, known, stack, |tile, from, to| {
        groups.push(&Bounds::new(grid, tile, from, to, sites.first), [from, to]);
    });
    for j in 0..rows {
        for i in left..right {
            let apex = apex_at(i, j);
            let at = j * width + i;
            visit(grid, rule, &apex, sites.first, groups, &mut slopes[at], &mut partners[at]);
        }
    }
}

/// Tries all groups of the block for one apex.
fn visit<R: Rule>(
    grid: &Grid<'_>,
    rule: &R,
    apex: &Apex,
    origin: [i64; 2],
    groups: &mut Groups,
    slope: &mut f32,
    partner: &mut [i64; 2],
) {
    let half = grid.step.map(|step| 0.5 * grid.extent * step);
    let centre = [0, 1].map(|axis| (apex.site[axis] - origin[axis]) as f32 * grid.step[axis] + half[axis]);
    let mut from = Stand { centre, half, heights: apex.heights, slope: *slope };
    groups.mark(&from);
    for (&[first, last], _) in groups.places.iter().zip(&groups.keep).filter(|(_, keep)| **keep != 0) {
        grid.tiles_of(first, last, |tile, first, last| {
            from.slope = *slope;
            if Bounds::new(grid, tile, first, last, origin).may_matter(&from) {
                let way = |end: [i64; 2], sign: f32| {
                    [0, 1].map(|axis| {
                        ((end[axis] - apex.site[axis]) as f32 + sign * grid.extent) * grid.step[axis]
                    })
                };
                if rule.admits(tile, way(first, -1.0), way(last, 1.0)) {
                    try_tile(grid, rule, apex, [first, last], slope, partner);
                }
            }
        });
    }
}

/// Tries the sites of a tile.
fn try_tile<R: Rule>(
    grid: &Grid<'_>,
    rule: &R,
    apex: &Apex,
    [first, last]: [[i64; 2]; 2],
    slope: &mut f32,
    partner: &mut [i64; 2],
) {
    let half = grid.step.map(|step| 0.5 * grid.extent * step);
    let place = grid.wrap(first);
    for y in 0..=last[1] - first[1] {
        for x in 0..=last[0] - first[0] {
            let offset = [first[0] + x - apex.site[0], first[1] + y - apex.site[1]];
            if rule.is_near(offset) {
                continue;
            }
            let heights = grid.heights([place[0] + x as usize, place[1] + y as usize]);
            let way = [offset[0] as f32 * grid.step[0], offset[1] as f32 * grid.step[1]];
            if may_rise(apex.heights, heights, way, [half; 2], *slope) {
                take(grid, rule, apex, offset, heights, slope, partner);
            }
        }
    }
}

fn try_site<R: Rule>(
    grid: &Grid<'_>,
    rule: &R,
    apex: &Apex,
    site: [i64; 2],
    slope: &mut f32,
    partner: &mut [i64; 2],
) {
    let offset = [site[0] - apex.site[0], site[1] - apex.site[1]];
    if rule.is_near(offset) {
        return;
    }
    let heights = grid.heights(grid.wrap(site));
    take(grid, rule, apex, offset, heights, slope, partner);
}

/// Keeps the slope to a site if it is steeper.
#[inline]
fn take<R: Rule>(
    grid: &Grid<'_>,
    rule: &R,
    apex: &Apex,
    offset: [i64; 2],
    heights: [f32; 4],
    slope: &mut f32,
    partner: &mut [i64; 2],
) {
    let found = rule.slope(grid, apex, offset, heights, f64::from(*slope));
    if found > f64::from(*slope) {
        // Rounded up: a cone that opens as wide as the next lower slope might touch.
        let rounded = found as f32;
        *slope = if f64::from(rounded) < found { rounded.next_up() } else { rounded };
        *partner = [apex.site[0] + offset[0], apex.site[1] + offset[1]];
    }
}
