//! Horizon maps: how high the relief stands around each texel.
//!
//! Azimuth `k` of `n` looks along `(cos a, sin a)`, `a = 2 pi k / n`, +X right and +Y **up** the
//! image, as normals do. A value is the **sine of the elevation** of the horizon there, in mesh
//! space (`scale`, `tile_size`): the highest line of sight from the displaced texel centre that meets
//! the surface. It is at least 0, since every relief lies on a mesh that goes on level, and below 1.
//! A distant light whose direction has sine of elevation `s` above the mesh is hidden where the value
//! at its azimuth is above `s`.
//!
//! Nelson Max, Horizon Mapping: Shadows for Bump-Mapped Surfaces, The Visual Computer 4(2), 1988. How
//! it is computed: [`sweep`](crate::sweep).
//!
//! Values are exact along the axes and the diagonals of square texels. In between, what stands `d` texels away is
//! seen up to a texel beside where it is, so beside the ends of upright walls a value may be that of an azimuth
//! `1 / d` radians away, or between both; which, depends on where the map begins: docs/performance.md has
//! figures.
//!
//! The relief is looked at for at least one length of the map along the azimuth's main axis, past the
//! border as the wrap mode says. What lies farther cannot rise above `scale / tile` of that length.

use heightfield::HeightField;
use rayon::prelude::*;

use crate::encode::Range;
use crate::maps::{Channel, Form, Kind, Layer, Map, MapInfo, MapOption, Plan};
use crate::sweep::{Grids, Lines, RowScratch, transpose, working_bytes};
use crate::{BakeError, Progress};

/// Most azimuths of a map.
pub const MAX_AZIMUTHS: usize = 4096;

/// Sines of the horizon's elevation, one slice an azimuth.
pub static HORIZON: Map = Map {
    info: MapInfo {
        name: "horizon",
        summary: "sine of the horizon's elevation, 0..1, one slice an azimuth, from +X towards +Y (up)",
        source: "Max 1988; Timonen and Westerholm 2010",
        version: 3,
        costly: true,
        form: Form::Stack { axis: "azimuth" },
        channels: &[Channel::fixed("sine", Range::UNIT)],
        options: &[azimuths_option(16)],
    },
    plan: |grid, options| {
        let turned = 4 * grid.texels();
        Plan::stack(grid, options.whole("azimuths") as usize).working(working_bytes(grid) + turned)
    },
    bake: |field, options, progress| {
        let azimuths = options.whole("azimuths") as usize;
        let texels = horizon_map(field, azimuths, progress)?;
        Ok(vec![Layer { width: field.width(), height: field.height(), depth: azimuths, texels }])
    },
};

/// The option that maps made by sweeps share.
pub(crate) const fn azimuths_option(default: i64) -> MapOption {
    MapOption {
        name: "azimuths",
        summary: "directions looked at, spread evenly over the full turn",
        kind: Kind::Whole { default, min: 1, max: MAX_AZIMUTHS as i64 },
    }
}

/// Unit direction of azimuth `k` of `n` in mesh space, x right and y up the image.
pub fn azimuth(k: usize, n: usize) -> [f64; 2] {
    // Quarter turns are exact.
    let quarter = 4 * k / n;
    let angle = std::f64::consts::TAU * (k as f64 / n as f64 - quarter as f64 / 4.0);
    let (sin, cos) = angle.sin_cos();
    match quarter % 4 {
        0 => [cos, sin],
        1 => [-sin, cos],
        2 => [-cos, -sin],
        _ => [sin, -cos],
    }
}

/// Checks a number of azimuths.
pub(crate) fn check_azimuths(map: &'static str, azimuths: usize) -> Result<(), BakeError> {
    if (1..=MAX_AZIMUTHS).contains(&azimuths) {
        return Ok(());
    }
    let problem = format!("must be a whole number in 1..{MAX_AZIMUTHS}, got {azimuths}");
    Err(BakeError::Option { map, option: "azimuths".to_owned(), problem })
}

/// The horizon map: `azimuths` planes of `height * width` sines of elevation, 0..1.
///
/// # Errors
/// [`BakeError::Option`] for a number of azimuths out of 1..[`MAX_AZIMUTHS`], [`BakeError::Interrupted`].
pub fn horizon_map(
    field: &HeightField,
    azimuths: usize,
    mut progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    check_azimuths(HORIZON.info.name, azimuths)?;
    let (width, height) = (field.width(), field.height());
    let mut map = vec![0.0_f32; azimuths * height * width];
    let grids = Grids::new(field);
    let mut lines = Lines::default();
    let mut turned = Vec::new();
    progress.report(0, height)?;
    for (k, plane) in map.chunks_exact_mut(width * height).enumerate() {
        let sweep = grids.towards(field, azimuth(k, azimuths));
        sweep.run(&mut lines);
        let (target, row) = if sweep.plan.along_x {
            turned.resize(width * height, 0.0);
            (turned.as_mut_slice(), height)
        } else {
            (&mut *plane, width)
        };
        target
            .par_chunks_mut(row)
            .enumerate()
            .for_each_init(RowScratch::default, |scratch, (at, out)| sweep.texels(&lines, at, scratch, out));
        if sweep.plan.along_x {
            transpose(&turned, height, width, plane);
        }
        progress.report(height * (k + 1) / azimuths, height)?;
    }
    Ok(map)
}
