//! All maps by name: what they are, how to bake them, how to store them.

use std::path::{Path, PathBuf};

use heightfield::{Extent, HeightField};

use crate::encode::{Depth, Range, encode};
use crate::{
    BakeError, Convention, Image, Kernel, Progress, Samples, normal_map, normal_xy, pyramid, relief_map,
    write_image,
};

/// A map that can be baked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Map {
    /// Normal x, y, z.
    Normal,
    /// Normal x, y.
    NormalXy,
    /// Normal x, y, z and height.
    Relief,
    /// Lowest and highest point of blocks, in levels.
    Pyramid,
}

impl Map {
    /// All maps.
    pub const ALL: [Map; 4] = [Map::Normal, Map::NormalXy, Map::Relief, Map::Pyramid];

    /// The map's name.
    pub fn name(self) -> &'static str {
        match self {
            Map::Normal => "normal",
            Map::NormalXy => "normal_xy",
            Map::Relief => "relief",
            Map::Pyramid => "pyramid",
        }
    }

    /// What the map holds, in one line.
    pub fn summary(self) -> &'static str {
        match self {
            Map::Normal => "unit normal x, y, z in -1..1",
            Map::NormalXy => "unit normal x, y in -1..1; z = sqrt(1 - x^2 - y^2)",
            Map::Relief => "unit normal x, y, z in -1..1 and height in 0..1",
            Map::Pyramid => "lowest and highest height of ever larger blocks, in levels",
        }
    }

    /// The map of that name.
    ///
    /// # Errors
    /// [`BakeError::UnknownName`].
    pub fn named(name: &str) -> Result<Self, BakeError> {
        Self::ALL.into_iter().find(|map| map.name() == name).ok_or_else(|| BakeError::UnknownName {
            what: "map",
            name: name.to_owned(),
            known: Self::ALL.map(Map::name).join(", "),
        })
    }

    /// What each channel means, and so how it is rounded.
    pub fn ranges(self) -> &'static [Range] {
        use Range::{LowerBound, Signed, Unit, UpperBound};
        match self {
            Map::Normal => &[Signed, Signed, Signed],
            Map::NormalXy => &[Signed, Signed],
            Map::Relief => &[Signed, Signed, Signed, Unit],
            Map::Pyramid => &[LowerBound, UpperBound],
        }
    }
}

/// Settings of the maps that hold normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BakeOptions {
    /// How slopes are estimated.
    pub kernel: Kernel,
    /// Which way green points.
    pub convention: Convention,
}

/// One picture of a baked map.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// `height * width * channels` floats; [`Map::ranges`] has the meaning of each channel.
    pub texels: Vec<f32>,
}

/// A baked map: one layer, or the levels of a pyramid, finest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Baked {
    /// Which map.
    pub map: Map,
    /// Its pictures; at least one.
    pub layers: Vec<Layer>,
}

/// How a map is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum FileFormat {
    /// 8-bit PNG.
    #[default]
    Png8,
    /// 16-bit PNG.
    Png16,
    /// 32-bit float EXR.
    Exr,
}

/// Bakes a map.
///
/// # Errors
/// [`BakeError::HeightField`] for a senseless extent, [`BakeError::Interrupted`].
pub fn bake(
    field: &HeightField,
    extent: &Extent,
    map: Map,
    options: BakeOptions,
    progress: Progress<'_>,
) -> Result<Baked, BakeError> {
    let BakeOptions { kernel, convention } = options;
    let single = |texels| vec![Layer { width: field.width(), height: field.height(), texels }];
    let layers = match map {
        Map::Normal => single(normal_map(field, extent, kernel, convention, progress)?),
        Map::NormalXy => single(normal_xy(field, extent, kernel, convention, progress)?),
        Map::Relief => single(relief_map(field, extent, kernel, convention, progress)?),
        Map::Pyramid => pyramid(field, progress)?
            .into_iter()
            .map(|level| Layer { width: level.width, height: level.height, texels: level.min_max })
            .collect(),
    };
    Ok(Baked { map, layers })
}

impl Baked {
    /// A layer as an image to be written, or `None` when there is no such layer.
    ///
    /// PNG has no two-channel colour, so maps of two channels get a blue channel of 0 there; EXR
    /// stores them as R and G.
    pub fn image(&self, layer: usize, format: FileFormat) -> Option<Image> {
        let Layer { width, height, texels } = self.layers.get(layer)?;
        let ranges = self.map.ranges();
        let samples = match format {
            FileFormat::Exr => Samples::F32(texels.clone()),
            FileFormat::Png8 => with_blue(encode(texels, ranges, Depth::U8), ranges.len()),
            FileFormat::Png16 => with_blue(encode(texels, ranges, Depth::U16), ranges.len()),
        };
        let channels = samples.len() / (width * height);
        let names = ["R", "G", "B", "A"][..channels].iter().map(|&name| name.to_owned()).collect();
        Image::named(*width, *height, names, samples).ok()
    }
}

fn with_blue(samples: Samples, channels: usize) -> Samples {
    if channels != 2 {
        return samples;
    }
    match samples {
        Samples::U8(samples) => Samples::U8(samples.chunks_exact(2).flat_map(|t| [t[0], t[1], 0]).collect()),
        Samples::U16(samples) => {
            Samples::U16(samples.chunks_exact(2).flat_map(|t| [t[0], t[1], 0]).collect())
        }
        Samples::F32(samples) => {
            Samples::F32(samples.chunks_exact(2).flat_map(|t| [t[0], t[1], 0.0]).collect())
        }
    }
}

/// Writes a baked map into a folder and returns the files made.
///
/// A map is `<stem>_<map>.png` or `.exr`; the levels of a pyramid are `<stem>_pyramid_00.png` and so
/// on, where minima are rounded down and maxima up. An empty `stem` drops the first underscore.
///
/// # Errors
/// See [`write_image`].
pub fn save(baked: &Baked, folder: &Path, stem: &str, format: FileFormat) -> Result<Vec<PathBuf>, BakeError> {
    let suffix = if format == FileFormat::Exr { "exr" } else { "png" };
    let separator = if stem.is_empty() { "" } else { "_" };
    let name = baked.map.name();
    let mut paths = Vec::with_capacity(baked.layers.len());
    for layer in 0..baked.layers.len() {
        let level = if baked.map == Map::Pyramid { format!("_{layer:02}") } else { String::new() };
        let path = folder.join(format!("{stem}{separator}{name}{level}.{suffix}"));
        if let Some(image) = baked.image(layer, format) {
            write_image(&path, &image)?;
            paths.push(path);
        }
    }
    Ok(paths)
}
