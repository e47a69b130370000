//! Maps as the integers that files hold.

use heightfield::{Extent, HeightField};

use super::{Baked, Grid, Map, MapInfo, Options, bake};
use crate::encode::{Depth, Range, Sample, encode};
use crate::normal::{Factors, NORMAL, NORMAL_XY, Normals, settings};
use crate::relief::RELIEF;
use crate::texels::Texels;
use crate::{BakeError, Progress, Samples};

/// A baked map in integers.
#[derive(Debug, Clone, PartialEq)]
pub struct Encoded {
    /// Which map.
    pub info: &'static MapInfo,
    /// The options it was baked with.
    pub options: Options,
    /// What the integers of each channel stand for.
    pub ranges: Vec<Range>,
    /// Its pictures; at least one.
    pub layers: Vec<EncodedLayer>,
}

/// A picture of integers, or several of one size; compare `Layer`.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedLayer {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// Slices.
    pub depth: usize,
    /// `depth * height * width * channels` samples, never floats.
    pub samples: Samples,
}

impl Baked {
    /// The map in integers, rounded as each channel says.
    pub fn encoded(&self, depth: Depth) -> Encoded {
        let ranges = self.ranges();
        let layers = self
            .layers
            .iter()
            .map(|layer| EncodedLayer {
                width: layer.width,
                height: layer.height,
                depth: layer.depth,
                samples: encode(&layer.texels, &ranges, depth),
            })
            .collect();
        Encoded { info: self.info, options: self.options.clone(), ranges, layers }
    }
}

/// Bakes a map in integers: the same bits as [`bake`] and [`Baked::encoded`]. Normals and reliefs
/// never exist as floats on the way, which takes a fraction of the time and memory.
///
/// # Errors
/// See [`bake`].
pub fn bake_encoded(
    field: &HeightField,
    map: &'static Map,
    options: &Options,
    depth: Depth,
    progress: Progress<'_>,
) -> Result<Encoded, BakeError> {
    if !map.is_by_rows() {
        return Ok(bake(field, map, options, progress)?.encoded(depth));
    }
    (map.plan)(Grid::of(field), options).check_samples(&map.info, depth.bytes())?;
    let length = field.width() * field.height() * map.info.channels.len();
    let samples = match depth {
        Depth::U8 => {
            let mut samples = vec![0; length];
            bake_rows(&Texels::of(field), field.extent(), map, options, &mut samples, progress)?;
            Samples::U8(samples)
        }
        Depth::U16 => {
            let mut samples = vec![0; length];
            bake_rows(&Texels::of(field), field.extent(), map, options, &mut samples, progress)?;
            Samples::U16(samples)
        }
    };
    let layer = EncodedLayer { width: field.width(), height: field.height(), depth: 1, samples };
    let ranges = map.info.fixed_ranges();
    Ok(Encoded { info: &map.info, options: options.clone(), ranges, layers: vec![layer] })
}

impl Map {
    /// Whether a row of the map takes but a few rows of heights: such maps can be baked in any type of
    /// sample into memory of the caller's, and from files larger than memory.
    pub fn is_by_rows(&self) -> bool {
        [&NORMAL, &NORMAL_XY, &RELIEF].into_iter().any(|known| std::ptr::eq(known, self))
    }
}

/// Bakes a map that [is made by rows](Map::is_by_rows) into `out`, `height * width * channels` floats
/// or integers: the same bits as [`bake`], or as [`bake_encoded`]. Heights are taken as they are.
///
/// # Errors
/// [`BakeError::Shape`] when `out` has another length, or the map is none of those;
/// [`BakeError::Interrupted`].
pub fn bake_rows<S: Sample>(
    texels: &Texels<'_>,
    extent: &Extent,
    map: &Map,
    options: &Options,
    out: &mut [S],
    progress: Progress<'_>,
) -> Result<(), BakeError> {
    let ([width, height], channels) = (texels.size(), map.info.channels.len());
    if !map.is_by_rows() || out.len() != width * height * channels {
        return Err(BakeError::Shape { width, height, channels, got: out.len() });
    }
    let (kernel, convention) = settings(options)?;
    extent.validate()?;
    let factors = Factors::new(texels.size(), extent, convention);
    match channels {
        2 => Normals::<S, 2>::new(factors).bake_into(texels, kernel, out, progress),
        3 => Normals::<S, 3>::new(factors).bake_into(texels, kernel, out, progress),
        _ => Normals::<S, 4>::new(factors).bake_into(texels, kernel, out, progress),
    }
}
