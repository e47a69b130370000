//! Is this normal map what it says? Green channel, axes, lengths, and the height map beside it.
//!
//! **Without heights** the evidence is that slopes of a surface have no curl: `d/dy (dz/dx)` and
//! `d/dx (dz/dy)` are the same second derivative. Read with the wrong green channel they are each
//! other's negative, so of the two readings the one with the lower curl is right; the same for a red
//! and green that are exchanged. Turning *both* axes round cannot be told from turning the heights
//! upside down, and neither has curl: only heights, or eyes, can say.
//!
//! **With heights** the slopes are compared with those of the heights, axis by axis.

use heightfield::{HeightField, Wrap};
use rayon::prelude::*;

use super::evidence::{Against, against_heights};
use super::integrate::slopes;
use crate::resample::area_average;
use crate::{BakeError, Convention, Progress};

/// Steepest slope that counts in full: few steep texels must not outvote the rest.
const STEEP: f64 = 4.0;
/// Least confidence, and least share of blocks that agree, for a verdict.
const SURE: f64 = 0.1;
const AGREED: f64 = 0.6;
/// Blocks along an axis that vote, and the least side of one.
const BLOCKS: usize = 16;
const LEAST_BLOCK: usize = 8;
/// A length further from 1 than this is not a unit normal's, 8-bit steps allowed for.
const UNIT_TOLERANCE: f64 = 0.02;

/// A way to read red and green.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Axes {
    /// Which way green points.
    pub convention: Convention,
    /// Whether red holds y and green x.
    pub swapped: bool,
}

impl Axes {
    /// The four ways: OpenGL, DirectX, and both with red and green exchanged.
    pub const ALL: [Axes; 4] = [
        Axes { convention: Convention::OpenGl, swapped: false },
        Axes { convention: Convention::DirectX, swapped: false },
        Axes { convention: Convention::OpenGl, swapped: true },
        Axes { convention: Convention::DirectX, swapped: true },
    ];

    /// Slopes `[dz/dx, dz/dy]`, y down, of slopes read as OpenGL.
    pub(super) fn slopes(self, [p, q]: [f64; 2]) -> [f64; 2] {
        let [p, q] = if self.swapped { [-q, -p] } else { [p, q] };
        if self.convention == Convention::OpenGl { [p, q] } else { [p, -q] }
    }
}

/// Lengths of the normals as they are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lengths {
    /// Mean length.
    pub mean: f64,
    /// Shortest.
    pub least: f64,
    /// Longest.
    pub most: f64,
    /// Share of texels whose length is off by more than 0.02.
    pub off: f64,
    /// Share of texels that point into the surface, z below 0.
    pub inward: f64,
}

/// The evidence of the normals alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curl {
    /// Squared curl over the squared derivatives it is the difference of, for each of [`Axes::ALL`]: 0 for
    /// slopes of a surface, 1 for slopes that have nothing to do with each other, 2 for the wrong sign.
    pub share: [f64; 4],
    /// The reading with the least curl.
    pub best: Axes,
    /// One less the least share over the next one: 0 undecided, 1 certain.
    pub confidence: f64,
    /// Share of the map's blocks, of those with relief, whose green channel reads as the whole does.
    pub votes: f64,
}

impl Curl {
    /// Whether the evidence is worth a verdict.
    pub fn decides(&self) -> bool {
        self.confidence >= SURE && self.votes >= AGREED
    }
}

/// All that is known of a normal map.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// Of the stored vectors.
    pub lengths: Lengths,
    /// `None` when the map is flat or too small to have any.
    pub curl: Option<Curl>,
    /// Against the heights, if there are any.
    pub against: Option<Against>,
}

impl Check {
    /// How to read red and green, and how sure that is (0..1), by the heights or else by the curl;
    /// `None` when neither decides.
    pub fn axes(&self) -> Option<(Axes, f64)> {
        let by_heights =
            self.against.filter(Against::decides).map(|against| (against.best, against.confidence));
        by_heights.or_else(|| self.curl.filter(Curl::decides).map(|curl| (curl.best, curl.confidence)))
    }
}

/// Checks `normals`, `width * height * 3` floats as stored, against themselves and, if given, against
/// `heights`, which may be of another size; its tile size gives slopes their unit.
///
/// # Errors
/// [`BakeError::Shape`], [`BakeError::Interrupted`].
pub fn check_normals(
    normals: &[f32],
    width: usize,
    height: usize,
    wrap: Wrap,
    heights: Option<&HeightField>,
    mut progress: Progress<'_>,
) -> Result<Check, BakeError> {
    let texels = width.checked_mul(height).filter(|n| *n > 0 && n.checked_mul(3) == Some(normals.len()));
    if texels.is_none() {
        return Err(BakeError::Shape { width, height, channels: 3, got: normals.len() });
    }
    progress.report(0, height)?;
    let lengths = lengths(normals);
    let curl = curl(&read(normals), width, height, wrap);
    progress.report(height / 2, height)?;
    let against = match heights {
        None => None,
        Some(field) => {
            let size = [width.min(field.width()), height.min(field.height())];
            let normals = area_average(normals, [width, height], 3, size);
            let heights = area_average(&field.texels(), [field.width(), field.height()], 1, size);
            let field =
                HeightField::new(&heights, size[0], size[1], field.wrap())?.with_extent(*field.extent())?;
            against_heights(&normals, &read(&normals), &field)?
        }
    };
    progress.report(height, height)?;
    Ok(Check { lengths, curl, against })
}

/// Slopes read as OpenGL, steep ones laid back.
fn read(normals: &[f32]) -> Vec<[f64; 2]> {
    let slope = |n: &[f32]| slopes([n[0], n[1], n[2]], Convention::OpenGl, STEEP).0;
    normals.par_chunks_exact(3).map(slope).collect()
}

fn lengths(normals: &[f32]) -> Lengths {
    let zero = Lengths { mean: 0.0, least: f64::INFINITY, most: 0.0, off: 0.0, inward: 0.0 };
    let one = |normal: &[f32]| {
        let length = normal.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>().sqrt();
        let off = f64::from(u8::from((length - 1.0).abs() > UNIT_TOLERANCE));
        let inward = f64::from(u8::from(normal[2] < 0.0));
        Lengths { mean: length, least: length, most: length, off, inward }
    };
    let both = |a: Lengths, b: Lengths| Lengths {
        mean: a.mean + b.mean,
        least: a.least.min(b.least),
        most: a.most.max(b.most),
        off: a.off + b.off,
        inward: a.inward + b.inward,
    };
    let sums = normals.par_chunks_exact(3).map(one).reduce(|| zero, both);
    let texels = (normals.len() / 3) as f64;
    Lengths { mean: sums.mean / texels, off: sums.off / texels, inward: sums.inward / texels, ..sums }
}

/// Sums over a block: squares and products of the two mixed derivatives, read plain and swapped.
#[derive(Clone, Copy, Default)]
struct Sums {
    squares: [f64; 2],
    products: [f64; 2],
}

fn curl(slopes: &[[f64; 2]], width: usize, height: usize, wrap: Wrap) -> Option<Curl> {
    let side = |n: usize| (n / BLOCKS).max(LEAST_BLOCK);
    let (across, down) = (width.div_ceil(side(width)), height.div_ceil(side(height)));
    // A texel at an edge that does not wrap has no derivative.
    let inside = |i: usize, n: usize| wrap == Wrap::Repeat || (i > 0 && i + 1 < n);
    let at = |i: usize, j: usize| slopes[(j % height) * width + i % width];
    let texel = |i: usize, j: usize| {
        // Sobel's kernel, of each component along the other axis and along its own.
        let (left, right, above, below) = (i + width - 1, i + 1, j + height - 1, j + 1);
        let blend = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| [0, 1].map(|k| 0.25 * (a[k] + 2.0 * b[k] + c[k]));
        let column = |i| blend(at(i, above), at(i, j), at(i, below));
        let row = |j| blend(at(left, j), at(i, j), at(right, j));
        let (l, r, a, b) = (column(left), column(right), row(above), row(below));
        let (dx, dy) = ([0, 1].map(|k| r[k] - l[k]), [0, 1].map(|k| b[k] - a[k]));
        ([dy[0], dx[1]], [dy[1], dx[0]])
    };
    let block = |number: usize| {
        let mut sums = Sums::default();
        let (left, top) = (number % across * side(width), number / across * side(height));
        for j in (top..(top + side(height)).min(height)).filter(|&j| inside(j, height)) {
            for i in (left..(left + side(width)).min(width)).filter(|&i| inside(i, width)) {
                let (plain, swapped) = texel(i, j);
                for (k, [a, b]) in [plain, swapped].into_iter().enumerate() {
                    sums.squares[k] += a * a + b * b;
                    sums.products[k] += a * b;
                }
            }
        }
        sums
    };
    let blocks: Vec<Sums> = (0..across * down).into_par_iter().map(block).collect();
    let total = |of: fn(&Sums) -> f64| blocks.iter().map(of).sum::<f64>();
    let squares = [total(|s| s.squares[0]), total(|s| s.squares[1])];
    let products = [total(|s| s.products[0]), total(|s| s.products[1])];
    if squares[0] <= 0.0 || squares[1] <= 0.0 {
        return None;
    }
    let share = |k: usize, sign: f64| ((squares[k] - sign * 2.0 * products[k]) / squares[k]).max(0.0);
    let share = [share(0, 1.0), share(0, -1.0), share(1, 1.0), share(1, -1.0)];
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&a, &b| share[a].total_cmp(&share[b]));
    let best = Axes::ALL[order[0]];
    let (k, sign) =
        (usize::from(best.swapped), if best.convention == Convention::OpenGl { 1.0 } else { -1.0 });
    // Blocks with next to no relief have nothing to say.
    let least = 0.01 * squares[k] / blocks.len() as f64;
    let voters = blocks.iter().filter(|s| s.squares[k] > least);
    let (agree, all) = voters.fold((0_usize, 0_usize), |(agree, all), s| {
        (agree + usize::from(s.products[k] * sign > 0.0), all + 1)
    });
    Some(Curl {
        share,
        best,
        confidence: if share[order[1]] > 0.0 { 1.0 - share[order[0]] / share[order[1]] } else { 0.0 },
        votes: agree as f64 / all.max(1) as f64,
    })
}
