//! The published relaxed cones: rays from over a texel's centre through all others.
//!
//! A ray comes from the lid over the apex, goes in at another texel and is followed down to the first of
//! [`RAY_SAMPLES`] samples above the surface. Texels as high as the lid are a case of their own: rays through them end
//! there. Samples farther along a ray are lower and farther out, so what they rise to is ever less steep:
//! [`super::rays`] needs to look only at rays whose first samples may be steep and out.

use heightfield::HeightField;
use heightfield::lanes::Lanes;

use super::super::exact::FLATTEST;
use super::super::grid::Stack;
use super::blocks::Blocks;
use super::rays::Rays;
use super::{Apexes, Row};

/// Samples of a ray between the texel it goes in at and the floor, as in the published program.
pub(super) const RAY_SAMPLES: u32 = 128;

/// The texels' centres.
#[derive(Clone, Copy)]
pub(super) struct Texels<'a> {
    pub field: &'a HeightField,
    pub blocks: &'a Blocks,
    /// UV units between texels.
    pub step: [f64; 2],
}

impl Texels<'_> {
    /// The steepest of `known` and the rise from the texel at `site`, `low` high, to where the ray through the texel at
    /// `offset` comes out, at sample `k` or later.
    #[inline(always)]
    pub fn follow(&self, site: [i64; 2], offset: [i64; 2], low: f64, k: u32, known: f64) -> f64 {
        let first = self.field.first_texel();
        let apex = site.map(|at| at + first);
        let top = f64::from(self.field.texel(apex[0] + offset[0], apex[1] + offset[1]));
        let along = [0, 1].map(|axis| offset[axis] as f64 * self.step[axis]);
        let distance = (along[0] * along[0] + along[1] * along[1]).sqrt();
        if top - low <= known * distance {
            return known;
        }
        if top >= 1.0 {
            return (top - low) / distance;
        }
        for k in k..=RAY_SAMPLES {
            let z = top * (1.0 - f64::from(k) / f64::from(RAY_SAMPLES));
            let out = (1.0 - z) / (1.0 - top);
            let slope = (z - low) / (out * distance);
            if slope <= known {
                return known;
            }
            let at = |axis: usize| (apex[axis] as f64 + 0.5) * self.step[axis] + out * along[axis];
            if self.field.height_at(at(0), at(1)) < z {
                return slope;
            }
        }
        known
    }

    /// Whether a ray may go in at the texel at this site: beside a clamped map there is none.
    #[inline(always)]
    pub fn is_texel(&self, site: [i64; 2]) -> bool {
        let first = self.field.first_texel();
        let size = [self.field.width(), self.field.height()];
        self.field.is_periodic() || (0..2).all(|axis| (0..size[axis] as i64).contains(&(site[axis] + first)))
    }
}

impl Apexes for Texels<'_> {
    fn start(self, texel: [i64; 2], _: [i64; 2]) -> [f32; 2] {
        let size = [self.field.width(), self.field.height()];
        let inside = (0..2).all(|axis| (0..size[axis] as i64).contains(&texel[axis]));
        if inside { [FLATTEST, f32::INFINITY] } else { [0.0; 2] }
    }

    #[inline(always)]
    fn raise<L: Lanes>(self, row: Row<'_>, stack: &mut Stack) {
        Rays::<L>::new(self, row).search(stack);
    }
}
