//! Mip chains that average what may be averaged.
//!
//! Level `k` has `max(1, side >> k)` texels a side, as graphics hardware wants it, down to 1 x 1, and
//! each of its texels is the **area average** of the finest level. Where a size is odd a texel on
//! the border of two blocks counts in both by its share; the usual 2 x 2 reduction drops the last
//! row and column there and shifts the picture. A chain is taken from the finest level, or from one
//! whose texels lie whole under the new ones, so odd sizes do not blur what was blurred.
//!
//! A normal is no colour. Averaging unit normals gives a shorter vector whose direction is the mean
//! normal and whose *length* says how much the normals under it disagree:
//! * [`NormalLength::Unit`] stretches it back to 1, what a plain shader expects.
//! * [`NormalLength::Mean`] keeps it: Toksvig 2005 reads the roughness off it (see
//!   [`mod@crate::moments`]).
//!
//! Either way each level comes from the averages, never from normals stretched before. Heights are
//! bounded, not averaged, by [`mod@crate::pyramid`].

use crate::encode::Range;
use crate::maps::{Channel, Form, Grid, Kind, Layer, Map, MapInfo, MapOption, Plan};
use crate::resample::area_average;
use crate::{BakeError, Progress, normal, normal_map};

/// Normals in mip levels.
pub static NORMAL_MIPS: Map = Map {
    info: MapInfo {
        name: "normal_mips",
        summary: "averaged normals x, y, z in -1..1, in mip levels",
        source: "Toksvig 2005",
        version: 2,
        costly: false,
        form: Form::Levels,
        channels: &[
            Channel::fixed("x", Range::SIGNED),
            Channel::fixed("y", Range::SIGNED),
            Channel::fixed("z", Range::SIGNED),
        ],
        options: &[
            normal::OPTIONS[0],
            normal::OPTIONS[1],
            MapOption {
                name: "length",
                summary: "whether averaged normals are stretched to unit length or keep their mean length",
                kind: Kind::Choice { default: "unit", choices: NormalLength::NAMES },
            },
        ],
    },
    plan: |grid, _| plan(grid),
    bake: |field, options, progress| {
        let (kernel, convention) = normal::settings(options)?;
        let length = NormalLength::named(options.choice("length"))?;
        let normals = normal_map(field, kernel, convention, progress)?;
        normal_mips(normals, field.width(), field.height(), length, Progress::none())
    },
};

/// The pictures of a mip chain.
pub(crate) fn plan(grid: Grid) -> Plan {
    let layers = mip_sizes(grid.width, grid.height).into_iter().map(|[w, h]| [w, h, 1]).collect();
    Plan { layers, working_bytes: 0 }
}

/// What becomes of the length of an averaged normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum NormalLength {
    /// It is made 1 again.
    #[default]
    Unit,
    /// It stays what the average gives, 1 or less.
    Mean,
}

impl NormalLength {
    /// The names of both.
    pub const NAMES: &'static [&'static str] = &["unit", "mean"];

    /// The name: `"unit"` or `"mean"`.
    pub fn name(self) -> &'static str {
        match self {
            NormalLength::Unit => "unit",
            NormalLength::Mean => "mean",
        }
    }

    /// The length rule of that name.
    ///
    /// # Errors
    /// [`BakeError::UnknownName`].
    pub fn named(name: &str) -> Result<Self, BakeError> {
        [NormalLength::Unit, NormalLength::Mean].into_iter().find(|length| length.name() == name).ok_or_else(
            || BakeError::UnknownName {
                what: "length of normals",
                name: name.to_owned(),
                known: Self::NAMES.join(", "),
            },
        )
    }
}

/// Width and height of every level, finest first: halved and rounded down, not below 1.
pub fn mip_sizes(width: usize, height: usize) -> Vec<[usize; 2]> {
    let levels = width.max(height).max(1).ilog2() as usize;
    (0..=levels).map(|level| [(width >> level).max(1), (height >> level).max(1)]).collect()
}

/// All levels of area averages, finest first; the first one is `texels` itself.
///
/// `texels` are `height * width * channels` floats.
///
/// # Errors
/// [`BakeError::Shape`] when the number of texels is another, [`BakeError::Interrupted`].
pub fn mip_chain(
    texels: Vec<f32>,
    width: usize,
    height: usize,
    channels: usize,
    mut progress: Progress<'_>,
) -> Result<Vec<Layer>, BakeError> {
    check(&texels, width, height, channels)?;
    progress.report(0, height)?;
    let mut layers = vec![Layer::flat(width, height, texels)];
    for size in mip_sizes(width, height).into_iter().skip(1) {
        // Averages of averages are averages as long as blocks nest.
        let nests =
            |layer: &&Layer| layer.width.is_multiple_of(size[0]) && layer.height.is_multiple_of(size[1]);
        let source = layers.iter().rev().find(nests).unwrap_or(&layers[0]);
        let texels = area_average(&source.texels, [source.width, source.height], channels, size);
        layers.push(Layer::flat(size[0], size[1], texels));
        progress.report(height - size[1].min(height - 1), height)?;
    }
    progress.report(height, height)?;
    Ok(layers)
}

/// The mip chain of a normal map, finest first: `height * width * 3` floats a level.
///
/// `normals` are taken as they are; the finest level of [`NormalLength::Mean`] is the input. Where
/// opposite normals cancel, [`NormalLength::Unit`] gives (0, 0, 1).
///
/// # Errors
/// See [`mip_chain`].
pub fn normal_mips(
    normals: Vec<f32>,
    width: usize,
    height: usize,
    length: NormalLength,
    progress: Progress<'_>,
) -> Result<Vec<Layer>, BakeError> {
    let mut layers = mip_chain(normals, width, height, 3, progress)?;
    if length == NormalLength::Unit {
        for layer in &mut layers {
            layer.texels.chunks_exact_mut(3).for_each(stretch);
        }
    }
    Ok(layers)
}

/// Makes a vector a unit vector; one without direction points out.
fn stretch(normal: &mut [f32]) {
    let length = normal.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>().sqrt();
    if length > 1e-6 {
        normal.iter_mut().for_each(|c| *c = (f64::from(*c) / length) as f32);
    } else {
        normal.copy_from_slice(&[0.0, 0.0, 1.0]);
    }
}

fn check(texels: &[f32], width: usize, height: usize, channels: usize) -> Result<(), BakeError> {
    let expected = width.checked_mul(height).and_then(|texels| texels.checked_mul(channels));
    if texels.is_empty() || expected != Some(texels.len()) {
        return Err(BakeError::Shape { width, height, channels, got: texels.len() });
    }
    Ok(())
}
