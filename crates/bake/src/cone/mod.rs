//! Cone maps: how far a cone that stands on the surface may open.
//!
//! A ratio `c` is in UV units per height unit, 0..1: the cone over a point `x` of the surface holds the
//! points above `h(x) + |y - x| / c`, lengths in UV units. Distances run across the edge of tiled and
//! mirrored maps. Flat maps have ratio 1 everywhere.
//!
//! # What a ratio promises
//!
//! [`ConeMode::Conservative`]: the cone of a texel's ratio is empty ([`cone_map`]), or pierced at most once
//! by any ray that falls or stays level as it leaves the axis ([`relaxed_cone_map`]), over *every* point of
//! the bilinear surface that lies less than a texel away from the texel's centre along both axes. So any
//! mean of the ratios of the four texels around a point, such as bilinear interpolation, is safe there, and
//! so is the widest of the four.
//!
//! Why it holds: the ratio of an empty cone is `1 / s`, rounded down, with `s` the least upper bound of
//! `(h(y) - h(x)) / |y - x|` over all these `x` and all `y` of the surface; `exact` says how it is found. No wider
//! ratio is safe, and rounding costs less than 1e-6.
//!
//! For relaxed cones only those `y` count at which the surface falls along the way from `x`: a ray that left the axis
//! above the surface and is below it can come out again only at such a point, and the cone holds none. Their slopes are
//! bounds, close but not exact: see `falling`. Where the empty cone is as wide it takes their place, as it is
//! pierced by no ray at all.
//!
//! [`ConeMode::Texel`]: the definitions as published. The plain cone of a texel's centre holds no other
//! texel's centre (Dummer 2006); the relaxed one comes from rays through other texels, sampled at equal steps
//! (Policarpo and Oliveira, GPU Gems 3, chapter 18, 2007). Neither holds between texels.
//!
//! Files of 8 bits hold ratios down to 1/255 only, below which they become 0, and cones of noise are narrower.
//! Option `curve` = `sqrt` stores square roots, as Policarpo and Oliveira do, rounded down all the same: to be
//! squared when they are read. What searches read is never stored that way.
//!
//! Sources: Jonathan Dummer, Cone Step Mapping: An Iterative Ray-Heightfield Intersection Algorithm, 2006;
//! Robert Ban, Gabor Valasek, Csaba Balint and Viktor Vad, Robust Cone Step Mapping, EGSR 2024.

mod exact;
mod falling;
mod grid;

use heightfield::HeightField;
use rayon::prelude::*;

use crate::encode::Range;
use crate::maps::{self, Channel, Form, Kind, Layer, Map, MapInfo, MapOption, Options, Plan};
use crate::{BakeError, Progress};

/// What the ratios of a cone map promise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ConeMode {
    /// Safe on the bilinear surface, interpolated or not.
    #[default]
    Conservative,
    /// As published, for comparison.
    Texel,
}

const MODE: MapOption = MapOption {
    name: "mode",
    summary: "conservative: safe on the bilinear surface; texel: as published, for comparison",
    kind: Kind::Choice { default: "conservative", choices: &["conservative", "texel"] },
};

const CURVE: MapOption = MapOption {
    name: "curve",
    summary: "linear: ratios as they are; sqrt: their square roots, which keep narrow cones in 8 bits",
    kind: Kind::Choice { default: "linear", choices: &["linear", "sqrt"] },
};

/// The map as the options want it stored: a square root is rounded so that its square is not above the ratio.
fn stored(field: &HeightField, mut map: Vec<f32>, options: &Options) -> Vec<Layer> {
    if options.choice(CURVE.name) == "sqrt" {
        map.par_iter_mut().for_each(|value| {
            let root = value.sqrt();
            let above = f64::from(root) * f64::from(root) > f64::from(*value);
            *value = if above { root.next_down() } else { root };
        });
    }
    vec![Layer::flat(field.width(), field.height(), map)]
}

impl ConeMode {
    fn of(options: &Options) -> Self {
        if options.choice(MODE.name) == "texel" { Self::Texel } else { Self::Conservative }
    }
}

/// Ratios of empty cones.
pub static CONE: Map = Map {
    info: MapInfo {
        name: "cone",
        summary: "how far an empty cone over the surface opens, UV units per height unit, 0..1",
        source: "Dummer 2006; Ban, Valasek, Balint and Vad 2024",
        version: 4,
        costly: true,
        form: Form::Single,
        channels: &[Channel::fixed("ratio", Range::LOWER_BOUND)],
        options: &[MODE, CURVE],
    },
    plan,
    bake: |field, options, progress| {
        let map = cone_map(field, ConeMode::of(options), progress)?;
        Ok(stored(field, map, options))
    },
};

/// Ratios of cones that a ray pierces at most once.
pub static RELAXED_CONE: Map = Map {
    info: MapInfo {
        name: "relaxed_cone",
        summary: "how far a cone that a ray pierces at most once opens, UV units per height unit, 0..1",
        source: "Policarpo and Oliveira 2007; Ban, Valasek, Balint and Vad 2024",
        version: 5,
        costly: true,
        form: Form::Single,
        channels: &[Channel::fixed("ratio", Range::LOWER_BOUND)],
        options: &[MODE, CURVE],
    },
    plan,
    bake: |field, options, progress| {
        let map = relaxed_cone_map(field, ConeMode::of(options), progress)?;
        Ok(stored(field, map, options))
    },
};

fn plan(grid: maps::Grid, _options: &Options) -> Plan {
    Plan::single(grid).working(exact::working_bytes(grid).max(falling::working_bytes(grid)))
}

/// How much steeper than found a rise between points may be: rounding, and what the search does not tell from a tie.
const ROUNDING: f64 = 8e-7;
/// The same of the published relaxed cones: rounding alone.
const ROUNDING_OF_RAYS: f64 = 4e-7;

/// Ratios of empty cones, one a texel, row by row.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn cone_map(
    field: &HeightField,
    mode: ConeMode,
    mut progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let slopes = match mode {
        ConeMode::Conservative => exact::steepest_rises(field, &mut progress)?,
        ConeMode::Texel => exact::steepest_between_texels(field, &mut progress)?,
    };
    Ok(ratios(slopes, ROUNDING))
}

/// Ratios of cones that a ray pierces at most once, one a texel, row by row.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn relaxed_cone_map(
    field: &HeightField,
    mode: ConeMode,
    mut progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    if mode == ConeMode::Texel {
        return Ok(ratios(falling::steepest_between_texels(field, &mut progress)?, ROUNDING_OF_RAYS));
    }
    let rows = field.height();
    let mut half = |second: usize, done: usize, total: usize| {
        progress.report(second * rows + done * rows / total.max(1), 2 * rows).is_ok()
    };
    let empty = exact::steepest_rises(field, &mut Progress::new(&mut |done, total| half(0, done, total)))?;
    let mut second = |done, total| half(1, done, total);
    Ok(ratios(falling::steepest_rises(field, empty, &mut Progress::new(&mut second))?, ROUNDING))
}

/// Slopes that may be steeper by `rounding`, as the ratios of their cones.
fn ratios(mut slopes: Vec<f32>, rounding: f64) -> Vec<f32> {
    slopes.par_iter_mut().for_each(|value| *value = ratio(*value, rounding));
    slopes
}

/// The ratio whose cone has this slope, rounded down, at most 1.
fn ratio(slope: f32, rounding: f64) -> f32 {
    let exact = ((1.0 - rounding) / f64::from(slope)).min(1.0);
    let near = exact as f32;
    if f64::from(near) > exact { near.next_down() } else { near }
}
