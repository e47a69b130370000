//! The published relaxed cones: rays from over a texel's centre through all others.
//!
//! A ray comes from the lid over the apex, goes in at another texel and is followed down to the first of
//! [`RAY_SAMPLES`] samples above the surface. It has come out between the last two, where the surface falls along its way,
//! and the rise to that place is not less than the one to the sample. So the search looks for cells that fall
//! outwards, and only then for texels between the apex and such a cell through which a ray gets there at the
//! height of that cell. Texels as high as the lid are a case of their own: rays through them end there.

use heightfield::HeightField;

use super::super::exact::FLATTEST;
use super::packet::Apex;

/// Samples of a ray between the texel it goes in at and the floor, as in the published program.
const RAY_SAMPLES: u32 = 128;
/// What steepness and direction of rays may be off by through rounding, in proportion.
const MARGIN: f64 = 1e-6;

/// A texel's centre.
#[derive(Clone, Copy)]
pub(super) struct Texel<'a> {
    pub field: &'a HeightField,
    /// UV units between texels.
    pub step: [f64; 2],
}

/// The way from the apex to another texel.
struct Way {
    /// UV units.
    along: [f64; 2],
    distance: f64,
    /// Where the ray goes in.
    top: f64,
}

impl Way {
    /// Height of a sample and how far out it lies, in units of the distance.
    fn sample(&self, k: u32) -> (f64, f64) {
        let z = self.top * (1.0 - f64::from(k) / f64::from(RAY_SAMPLES));
        (z, (1.0 - z) / (1.0 - self.top))
    }
}

impl Texel<'_> {
    fn way(&self, site: [i64; 2], offset: [i64; 2]) -> Way {
        let first = self.field.first_texel();
        let along = [0, 1].map(|axis| offset[axis] as f64 * self.step[axis]);
        let top = f64::from(self.field.texel(site[0] + offset[0] + first, site[1] + offset[1] + first));
        Way { along, distance: along[0].hypot(along[1]), top }
    }

    /// Whether a sample lies above the surface.
    fn out(&self, site: [i64; 2], way: &Way, k: u32) -> bool {
        let first = self.field.first_texel();
        let (z, out) = way.sample(k);
        let at = |axis: usize| ((site[axis] + first) as f64 + 0.5) * self.step[axis] + out * way.along[axis];
        self.field.height_at(at(0), at(1)) < z
    }

    /// The slope to the first sample above the surface; `known` if that is not less.
    fn follow(&self, site: [i64; 2], way: &Way, low: f64, known: f64) -> f64 {
        if way.top >= 1.0 {
            return known.max((way.top - low) / way.distance);
        }
        for k in 1..=RAY_SAMPLES {
            let (z, out) = way.sample(k);
            let slope = (z - low) / (out * way.distance);
            if slope <= known {
                return known;
            }
            if self.out(site, way, k) {
                return slope;
            }
        }
        known
    }

    /// The steepest rise by rays through the texels around the one at `site`, at least `known`.
    fn around(&self, site: [i64; 2], low: f64, mut known: f64) -> f64 {
        for y in -1..=1_i64 {
            for x in -1..=1_i64 {
                let way = self.way(site, [x, y]);
                if way.distance > 0.0 && way.top - low > known * way.distance {
                    known = self.follow(site, &way, low, known);
                }
            }
        }
        known
    }

    /// As [`Self::follow`] for a ray that may come out between two distances.
    fn try_ray(&self, site: [i64; 2], way: &Way, low: f64, [near, far]: [f64; 2], known: f64) -> f64 {
        // The samples on both sides of these.
        let samples = f64::from(RAY_SAMPLES);
        let number = |distance: f64| {
            let z = 1.0 - (1.0 - way.top) * distance / way.distance;
            (1.0 - z / way.top) * samples
        };
        let from = number(near).floor().clamp(1.0, samples) as u32;
        let to = (number(far).ceil() + 1.0).clamp(1.0, samples) as u32;
        if (from..=to).any(|k| self.out(site, way, k)) { self.follow(site, way, low, known) } else { known }
    }
}

impl Apex for Texel<'_> {
    const EXTENT: f32 = 0.0;
    const LID: bool = true;

    fn start(self, texel: [i64; 2], site: [i64; 2]) -> [f32; 2] {
        let size = [self.field.width(), self.field.height()];
        if (0..2).any(|axis| !(0..size[axis] as i64).contains(&texel[axis])) {
            return [0.0; 2];
        }
        let low = f64::from(self.field.texel(texel[0], texel[1]));
        [self.around(site, low, f64::from(FLATTEST)) as f32, f32::INFINITY]
    }

    #[inline(always)]
    fn touches(offset: [i64; 2]) -> bool {
        (-1..=0).contains(&offset[0]) && (-1..=0).contains(&offset[1])
    }

    fn steepest(
        self,
        site: [i64; 2],
        own: [f32; 4],
        offset: [i64; 2],
        heights: [f32; 4],
        mut known: f64,
    ) -> f64 {
        let low = f64::from(own[0]);
        let corners = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| [offset[0] + x, offset[1] + y]);
        for (corner, height) in corners.into_iter().zip(heights).filter(|(_, height)| *height >= 1.0) {
            let distance = (corner[0] as f64 * self.step[0]).hypot(corner[1] as f64 * self.step[1]);
            known = known.max((f64::from(height) - low) / distance);
        }
        let near = [0, 1].map(|axis| offset[axis].max(-1 - offset[axis]) as f64 * self.step[axis]);
        let far = [0, 1].map(|axis| (offset[axis] + 1).max(-offset[axis]) as f64 * self.step[axis]);
        let (near, far) = (near[0].hypot(near[1]), far[0].hypot(far[1]));
        let [lowest, highest] = heights.iter().fold([1.0_f64, 0.0], |[low, high], &height| {
            [low.min(f64::from(height)), high.max(f64::from(height))]
        });
        // How fast rays fall that pass the cell between its lowest and its highest point.
        let least = (1.0 - highest) / far * (1.0 - MARGIN) - MARGIN;
        let most = (1.0 - lowest) / near * (1.0 + MARGIN) + MARGIN;
        // Texels on the way: by column, or by row where the way leads down or up.
        let major = usize::from((2 * offset[1] + 1).abs() > (2 * offset[0] + 1).abs());
        let tangents = corners.map(|corner| corner[1 - major] as f64 / corner[major] as f64);
        let [from, to] = tangents.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], &tangent| {
            [from.min(tangent), to.max(tangent)]
        });
        let (sign, end) = if offset[major] >= 0 { (1, offset[major] + 1) } else { (-1, -offset[major]) };
        for step in 1..=end {
            let run = step as f64;
            let bounds = if sign > 0 { [from * run, to * run] } else { [-to * run, -from * run] };
            for across in (bounds[0] - MARGIN * run).ceil() as i64..=(bounds[1] + MARGIN * run).floor() as i64
            {
                let mut place = [sign * step; 2];
                place[1 - major] = across;
                let way = self.way(site, place);
                let fall = (1.0 - way.top) / way.distance;
                let steep = way.top - low > known * way.distance;
                if steep && way.top < 1.0 && fall >= least && fall <= most {
                    known = self.try_ray(site, &way, low, [near, far], known);
                }
            }
        }
        known
    }
}
