//! Where the lines of one azimuth run and where they are sampled.

use heightfield::{HeightField, Wrap};

use super::{Grid, NEAR};

/// Closer to a column of texels than this, in texels, a row of texels is not sampled again: rounding
/// would decide about the slope between the two.
const APART: f64 = 1.0 / 512.0;
/// Samples on each side that one is compared with before it is taken for a corner of a hull.
pub(super) const CHORDS: usize = 3;
/// Slants below this are rounding of an azimuth along an axis.
const STRAIGHT: f64 = 1e-12;

/// Where a texel's own line is sampled; the same for all lines but for whole texels of the cross axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    /// Steps along the line, in texels of the main axis.
    pub step: f64,
    /// Texel of the cross axis at or before the sample, relative to the line's first.
    pub row: i64,
    /// How far the sample is from it, 0..1.
    pub row_share: f32,
    /// Whole steps.
    pub column: i64,
    /// What is left of `step`, 0..1.
    pub column_share: f32,
}

impl Sample {
    fn new(step: f64, across: f64) -> Self {
        Self {
            step,
            row: across.floor() as i64,
            row_share: (across - across.floor()) as f32,
            column: step.floor() as i64,
            column_share: (step - step.floor()) as f32,
        }
    }
}

/// Where the lines of a sweep are sampled, ready for many lines.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FarSample {
    /// Steps along the line, in texels of the main axis.
    pub step: f32,
    /// The texels of the main axis before and after it.
    pub main: [u32; 2],
    /// Place of the cross axis at or before the sample, relative to the line's: see [`Grid::lanes`].
    pub place: i32,
    /// How far the sample is from it and from the first texel of the main axis, 0..1.
    pub shares: [f32; 2],
    /// How far along it lies between the samples beside it, between those beside them, and so on.
    pub chords: [f32; CHORDS],
}

/// The lines of one azimuth.
pub(crate) struct Plan {
    /// Whether the main axis is x.
    pub along_x: bool,
    /// Whether lines go towards higher texels of the main axis.
    pub forward: bool,
    /// Texels of the cross axis for each step.
    pub slant: f64,
    /// Texels of the main axis, and so points of a line that get a horizon.
    pub steps: usize,
    /// Texels of the cross axis.
    cross: usize,
    /// Where on the cross axis the first line starts.
    pub first_line: i64,
    pub line_count: usize,
    /// Whether the lines of one period of the cross axis stand for all.
    pub cyclic: bool,
    /// Slope of one height per step, as the tangent of its elevation.
    pub slope: f64,
    /// Horizontal unit direction in mesh space, y up.
    pub direction: [f64; 2],
    /// Samples of the first [`NEAR`] steps: wherever a line meets a row or column of texels, and
    /// before each of them the middle of the way there.
    pub near: Vec<Sample>,
    /// Samples of lines: at every whole step and wherever they meet a row of texels between.
    far: Vec<FarSample>,
    /// Index in `far` of the sample at each whole step.
    whole: Vec<u32>,
    wrap: Wrap,
}

impl Plan {
    /// The plan towards a horizontal unit direction; `grids`: of main axis x, and y.
    pub fn new(field: &HeightField, grids: [&Grid; 2], direction: [f64; 2]) -> Self {
        let extent = field.extent();
        let size = [field.width(), field.height()];
        let texel = [0, 1].map(|axis| f64::from(extent.tile_size[axis]) / size[axis] as f64);
        let advance = [direction[0] / texel[0], -direction[1] / texel[1]];
        let along_x = advance[0].abs() >= advance[1].abs();
        let (main, other) = if along_x { (0, 1) } else { (1, 0) };
        let slant = advance[other] / advance[main].abs();
        let slant = if slant.abs() < STRAIGHT { 0.0 } else { slant };
        let (steps, cross) = (size[main], size[other]);
        let cyclic = field.wrap() == Wrap::Repeat;
        let (first_line, line_count) = if cyclic {
            (0, cross)
        } else {
            // Each texel has a line at or before it and one after it.
            let drift = -slant * (steps - 1) as f64;
            let first = drift.min(0.0).floor() as i64;
            let last = drift.max(0.0).floor() as i64 + cross as i64;
            (first, (last - first + 1) as usize)
        };
        let (samples, whole) = samples(slant, (2 * steps).max(NEAR));
        let forward = advance[main] > 0.0;
        let row = |column: i64| grids[main].main(if forward { column } else { steps as i64 - 1 - column });
        Self {
            along_x,
            forward,
            slant,
            steps,
            cross,
            first_line,
            line_count,
            cyclic,
            slope: f64::from(extent.scale) / texel[main].hypot(slant * texel[other]),
            direction,
            near: with_middles(&samples[..=whole[NEAR] as usize], slant),
            far: prepared(&samples, slant, grids[main], row),
            whole,
            wrap: field.wrap(),
        }
    }

    /// The steps `first..=last` of a line that pass a texel, if there are any.
    #[inline(always)]
    pub fn receivers(&self, line: i64) -> Option<(usize, usize)> {
        let last = self.steps as f64 - 1.0;
        if self.cyclic {
            return Some((0, self.steps - 1));
        }
        // Within one texel of the map on the cross axis.
        let (low, high) = (-1.0 - line as f64, self.cross as f64 - line as f64);
        let (from, to) = if self.slant == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            (0.0, last)
        } else {
            let (a, b) = (low / self.slant, high / self.slant);
            (a.min(b).ceil().max(0.0), a.max(b).floor().min(last))
        };
        (from <= to).then_some((from as usize, to as usize))
    }

    /// How far a line is followed whose last receiver is `last`: one more length of the map, or to
    /// where the surface is level for ever.
    #[inline(always)]
    pub fn end(&self, line: i64, last: usize) -> usize {
        let reach = last + self.steps;
        if self.wrap != Wrap::Clamp {
            return reach;
        }
        let edge = if self.slant > 0.0 { self.cross as f64 } else { -1.0 };
        let leaves = if self.slant == 0.0 { 0.0 } else { (edge - line as f64) / self.slant };
        reach.min((leaves.clamp(0.0, reach as f64).ceil() as usize).max(self.steps))
    }

    /// The samples of steps `first..=last`, wherever a line meets a row or column of texels.
    #[inline(always)]
    pub fn samples(&self, first: usize, last: usize) -> &[FarSample] {
        &self.far[self.whole[first] as usize..=self.whole[last] as usize]
    }

    /// How many samples there are from step `first` to step `last`.
    #[inline(always)]
    pub fn samples_between(&self, first: usize, last: usize) -> usize {
        (self.whole[last] - self.whole[first]) as usize
    }

    /// The texel of the main axis after `column` steps, before wrapping.
    #[inline(always)]
    pub fn main(&self, column: i64) -> i64 {
        if self.forward { column } else { self.steps as i64 - 1 - column }
    }
}

/// Samples from step 0 to `last` at whole steps and at whole texels of the cross axis.
fn samples(slant: f64, last: usize) -> (Vec<Sample>, Vec<u32>) {
    let mut samples = Vec::with_capacity(2 * last + 2);
    let mut whole = Vec::with_capacity(last + 1);
    let rate = slant.abs();
    let mut crossing = 1.0_f64;
    for column in 0..=last {
        let step = column as f64;
        while crossing < rate * (step - APART) {
            let at = crossing / rate;
            if at > step - 1.0 + APART {
                samples.push(Sample::new(at, crossing * slant.signum()));
            }
            crossing += 1.0;
        }
        whole.push(samples.len() as u32);
        samples.push(Sample::new(step, slant * step));
    }
    (samples, whole)
}

/// Samples with what many lines ask of them. Their steps are rounded, and with them the places that they name; `row`
/// gives the texel of the main axis at a column.
fn prepared(samples: &[Sample], slant: f64, grid: &Grid, row: impl Fn(i64) -> usize) -> Vec<FarSample> {
    let step = |at: usize| f64::from(samples[at.min(samples.len() - 1)].step as f32);
    let share = |at: usize, apart: usize| {
        let (before, after) = (step(at.saturating_sub(apart)), step(at + apart));
        ((step(at) - before) / (after - before)) as f32
    };
    (0..samples.len())
        .map(|at| {
            let Sample { step, row: place, row_share, column, column_share } =
                Sample::new(step(at), slant * step(at));
            FarSample {
                step: step as f32,
                main: [row(column) as u32, row(column + 1) as u32],
                place: grid.relative(place),
                shares: [row_share, column_share],
                chords: std::array::from_fn(|apart| share(at, apart + 1)),
            }
        })
        .collect()
}

/// The samples after the first, each preceded by the middle of the way from the one before.
fn with_middles(samples: &[Sample], slant: f64) -> Vec<Sample> {
    let mut all = Vec::with_capacity(2 * samples.len());
    for pair in samples.windows(2) {
        let middle = 0.5 * (pair[0].step + pair[1].step);
        all.extend([Sample::new(middle, slant * middle), pair[1]]);
    }
    all
}
