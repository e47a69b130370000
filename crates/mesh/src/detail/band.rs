//! One band of rows: samples, rays, and what is stored of what they meet.

use glam::{DVec2, Vec3};

use super::ao::Sky;
use super::charts::Layout;
use super::cover::Cover;
use super::ground::{Facet, Ground, Spot};
use super::options::{DetailOptions, NormalSpace};
use super::raster::{NONE, Triangle};
use super::surface::Surface;
use super::tree::{Hit, Ray, Scratch, Sides};

/// Samples of a tile along each side; their rays travel together.
const TILE: usize = 8;
/// Rays further apart than this many texels are sent separately: they start on different charts.
const FAR: f32 = 32.0;
/// Numbers of touched texels begin here, beyond those of samples.
const TOUCHED: u64 = 1 << 60;

/// What all bands share.
pub(super) struct Job<'a> {
    pub ground: Ground<'a>,
    pub surface: Surface<'a>,
    pub layout: Layout,
    pub sky: Option<Sky>,
    pub options: DetailOptions,
}

/// The rows of a band and the places its results go.
pub(super) struct Band<'a> {
    pub index: usize,
    pub covered: &'a mut [bool],
    pub normal: Option<&'a mut [f32]>,
    pub heights: Option<&'a mut [f32]>,
    pub ao: Option<&'a mut [f32]>,
}

/// Counts over a band; see [`super::DetailReport`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Tally {
    pub met: (f32, f32),
    pub texels: usize,
    pub rays: u64,
    pub missed: u64,
    pub averted: u64,
    pub empty: usize,
    pub overlapping: u64,
}

impl Tally {
    pub(super) const NOTHING: Self = Self {
        met: (f32::INFINITY, f32::NEG_INFINITY),
        texels: 0,
        rays: 0,
        missed: 0,
        averted: 0,
        empty: 0,
        overlapping: 0,
    };

    pub(super) fn and(self, other: Self) -> Self {
        Self {
            met: (self.met.0.min(other.met.0), self.met.1.max(other.met.1)),
            texels: self.texels + other.texels,
            rays: self.rays + other.rays,
            missed: self.missed + other.missed,
            averted: self.averted + other.averted,
            empty: self.empty + other.empty,
            overlapping: self.overlapping + other.overlapping,
        }
    }
}

/// Texel rows of a band for a grid of samples: a tile's worth.
pub(super) fn band_rows(grid: usize) -> usize {
    (TILE / grid).max(1)
}

/// A sample on its way.
#[derive(Clone, Copy)]
struct Sample {
    /// Texel within the tile.
    texel: usize,
    number: u64,
    spot: Spot,
    ray: Ray,
    /// Mesh units a texel spans there.
    span: f32,
}

/// Sums over the samples of a texel that met something.
#[derive(Clone, Copy, Default)]
struct Sum {
    asked: u32,
    met: u32,
    normal: Vec3,
    height: f32,
    open: f32,
}

/// The triangle that the last sample lay on.
struct Current {
    chart: u32,
    triangle: Triangle,
    facet: Facet,
    span: f32,
}

/// A worker's memory.
#[derive(Default)]
pub(super) struct Worker {
    samples: Vec<Sample>,
    apart: Vec<Sample>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    scratch: Scratch,
}

impl Job<'_> {
    /// Bakes a band with the best instructions the processor has; the results are the same.
    pub(super) fn bake(&self, band: &mut Band<'_>, worker: &mut Worker) -> Tally {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            #[allow(unsafe_code)]
            // SAFETY: the processor has the instructions, asked on the line above.
            return unsafe { self.bake_avx2(band, worker) };
        }
        self.bake_plainly(band, worker)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn bake_avx2(&self, band: &mut Band<'_>, worker: &mut Worker) -> Tally {
        self.bake_plainly(band, worker)
    }

    #[inline(always)]
    fn bake_plainly(&self, band: &mut Band<'_>, worker: &mut Worker) -> Tally {
        let DetailOptions { width, grid, .. } = self.options;
        let first = band.index * band_rows(grid);
        let rows = band.covered.len() / width;
        let cover = Cover::new(&self.layout, self.ground.mesh, band.index, first, rows, width, grid);
        let mut tally = Tally { overlapping: cover.overlapping, ..Tally::NOTHING };
        let mut current: Option<Current> = None;
        let tile = band_rows(grid);
        for left in (0..width).step_by(tile) {
            let columns = tile.min(width - left);
            worker.samples.clear();
            self.gather(&cover, left, columns, rows, &mut current, &mut worker.samples);
            if worker.samples.is_empty() {
                continue;
            }
            let mut sums = [Sum::default(); TILE * TILE];
            self.trace(worker, &mut sums, &mut tally);
            for (texel, sum) in sums.iter().enumerate().take(rows * columns).filter(|(_, sum)| sum.asked > 0)
            {
                self.store(band, texel / columns * width + left + texel % columns, sum, &mut tally);
            }
        }
        tally
    }

    /// The samples of a tile: those that charts own, then one for each texel that is only touched.
    #[inline(always)]
    fn gather(
        &self,
        cover: &Cover,
        left: usize,
        columns: usize,
        rows: usize,
        current: &mut Option<Current>,
        samples: &mut Vec<Sample>,
    ) {
        let DetailOptions { width, grid, .. } = self.options;
        let window = &cover.window;
        for row in 0..rows * grid {
            for column in left * grid..(left + columns) * grid {
                let owner = cover.owners[row * window.width + column];
                if owner != NONE {
                    let texel = row / grid * columns + column / grid - left;
                    let number = ((window.rows.start + row) * window.width + column) as u64;
                    samples.push(self.sample(texel, number, owner, window.centre(row, column), current));
                }
            }
        }
        if cover.touches.is_empty() {
            return;
        }
        for row in 0..rows {
            for column in 0..columns {
                let at = row * width + left + column;
                if let Some(touch) = cover.touch(at) {
                    let number = TOUCHED + (window.rows.start / grid * width + at) as u64;
                    samples.push(self.sample(
                        row * columns + column,
                        number,
                        touch.chart,
                        touch.point,
                        current,
                    ));
                }
            }
        }
    }

    #[inline(always)]
    fn sample(
        &self,
        texel: usize,
        number: u64,
        chart: u32,
        at: DVec2,
        current: &mut Option<Current>,
    ) -> Sample {
        let known = match current.take() {
            Some(known) if known.chart == chart => known,
            _ => self.look_up(chart),
        };
        let (spot, ray) = self.ground.spot(&known.facet, known.triangle.weights(at));
        let span = known.span;
        *current = Some(known);
        Sample { texel, number, spot, ray, span }
    }

    fn look_up(&self, chart: u32) -> Current {
        let place = &self.layout.charts[chart as usize];
        let triangle = Triangle::new(self.layout.corners(self.ground.mesh, place));
        let facet = self.ground.facet(place.triangle);
        let span = (facet.area() / triangle.area()).sqrt() as f32;
        Current { chart, triangle, facet, span }
    }

    /// Sends the rays, neighbours together, and adds up what they meet.
    #[inline(always)]
    fn trace(&self, worker: &mut Worker, sums: &mut [Sum; TILE * TILE], tally: &mut Tally) {
        let Worker { samples, apart, rays, hits, scratch } = worker;
        let sides = if self.options.back_faces { Sides::Both } else { Sides::Front };
        while let Some(&lead) = samples.first() {
            let reach = (FAR * lead.span).powi(2);
            let (origin, direction) = (Vec3::from(lead.ray.origin), Vec3::from(lead.ray.direction));
            apart.clear();
            samples.retain(|sample| {
                let near = Vec3::from(sample.ray.origin).distance_squared(origin) <= reach
                    && Vec3::from(sample.ray.direction).dot(direction) > 0.5;
                let together = near || sample.number == lead.number;
                if !together {
                    apart.push(*sample);
                }
                together
            });
            rays.clear();
            rays.extend(samples.iter().map(|sample| sample.ray));
            hits.resize(rays.len(), None);
            self.surface.tree.nearest_hits(rays, hits, sides, scratch);
            tally.rays += rays.len() as u64;
            for (sample, hit) in samples.iter().zip(hits.iter()) {
                let sum = &mut sums[sample.texel];
                sum.asked += 1;
                match hit {
                    Some(hit) => self.shade(sample, hit, sum, tally, scratch),
                    None => {
                        tally.missed += 1;
                        let averted = sides == Sides::Front
                            && self.surface.tree.blocked(sample.ray, &mut scratch.stack);
                        tally.averted += u64::from(averted);
                    }
                }
            }
            std::mem::swap(samples, apart);
        }
    }

    #[inline(always)]
    fn shade(&self, sample: &Sample, hit: &Hit, sum: &mut Sum, tally: &mut Tally, scratch: &mut Scratch) {
        let height = sample.spot.height - hit.t;
        tally.met = (tally.met.0.min(height), tally.met.1.max(height));
        sum.met += 1;
        sum.height += height;
        let direction = Vec3::from(sample.ray.direction);
        if self.options.normal {
            let normal = self.surface.normal(hit, direction);
            sum.normal += match self.options.space {
                NormalSpace::Object => normal,
                NormalSpace::Tangent => sample.spot.tangent_space(normal),
            };
        }
        if let Some(sky) = &self.sky {
            let point = self.surface.point(hit, direction);
            sum.open += sky.open(&self.surface, &point, sample.number, &mut scratch.stack);
        }
    }

    /// Stores a texel; where nothing was met it keeps the plain surface it was filled with.
    #[inline(always)]
    fn store(&self, band: &mut Band<'_>, texel: usize, sum: &Sum, tally: &mut Tally) {
        band.covered[texel] = true;
        tally.texels += 1;
        if sum.met == 0 {
            tally.empty += 1;
            return;
        }
        let share = 1.0 / sum.met as f32;
        if let Some(normal) = &mut band.normal
            && let Some(mean) = sum.normal.try_normalize()
        {
            let green = if self.options.green_down && self.options.space == NormalSpace::Tangent {
                -mean.y
            } else {
                mean.y
            };
            normal[3 * texel..3 * texel + 3].copy_from_slice(&[mean.x, green, mean.z]);
        }
        if let Some(heights) = &mut band.heights {
            heights[texel] = self.ground.unit(sum.height * share);
        }
        if let Some(ao) = &mut band.ao {
            ao[texel] = sum.open * share;
        }
    }
}
