//! Baked maps as image files.

use std::path::{Path, PathBuf};

use super::{Baked, Form, Layer};
use crate::encode::{Depth, Range, encode};
use crate::{BakeError, Image, Samples, write_image};

/// How a map is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum FileFormat {
    /// 8-bit PNG.
    #[default]
    Png8,
    /// 16-bit PNG.
    Png16,
    /// 8-bit TIFF.
    Tiff8,
    /// 16-bit TIFF.
    Tiff16,
    /// 32-bit float TIFF.
    Tiff32,
    /// 32-bit float EXR.
    Exr,
}

impl FileFormat {
    /// The format of that name (`"png"`, `"tiff"`, `"exr"`) and number of bits a sample.
    ///
    /// # Errors
    /// [`BakeError::UnknownName`].
    pub fn named(name: &str, bits: u8) -> Result<Self, BakeError> {
        Ok(match (name, bits) {
            ("png", 8) => FileFormat::Png8,
            ("png", 16) => FileFormat::Png16,
            ("tiff", 8) => FileFormat::Tiff8,
            ("tiff", 16) => FileFormat::Tiff16,
            ("tiff", 32) => FileFormat::Tiff32,
            ("exr", 32) => FileFormat::Exr,
            _ => {
                return Err(BakeError::UnknownName {
                    what: "file format",
                    name: format!("{name}, {bits} bits"),
                    known: "png with 8 or 16 bits, tiff with 8, 16 or 32, exr with 32".to_owned(),
                });
            }
        })
    }

    /// The suffix of its files.
    pub fn suffix(self) -> &'static str {
        match self {
            FileFormat::Png8 | FileFormat::Png16 => "png",
            FileFormat::Tiff8 | FileFormat::Tiff16 | FileFormat::Tiff32 => "tiff",
            FileFormat::Exr => "exr",
        }
    }

    /// The integers it holds, or `None` for floats.
    pub fn depth(self) -> Option<Depth> {
        match self {
            FileFormat::Png8 | FileFormat::Tiff8 => Some(Depth::U8),
            FileFormat::Png16 | FileFormat::Tiff16 => Some(Depth::U16),
            FileFormat::Tiff32 | FileFormat::Exr => None,
        }
    }

    /// Most channels in one file; further ones get a file each.
    fn channels(self) -> usize {
        if self == FileFormat::Exr { usize::MAX } else { 4 }
    }
}

/// The samples of one slice of a layer, interleaved, as the format stores them.
fn samples(layer: &Layer, slice: usize, ranges: &[Range], format: FileFormat) -> Samples {
    let length = layer.texels.len() / layer.depth;
    let texels = &layer.texels[slice * length..][..length];
    match format.depth() {
        None => Samples::F32(texels.to_vec()),
        Some(depth) => encode(texels, ranges, depth),
    }
}

/// Texels of two channels with a third of 0: PNG and TIFF have no colour of two channels.
fn with_blue(samples: Samples) -> Samples {
    fn widen<T: Copy + Default>(samples: &[T]) -> Vec<T> {
        samples.chunks_exact(2).flat_map(|t| [t[0], t[1], T::default()]).collect()
    }
    match samples {
        Samples::U8(samples) => Samples::U8(widen(&samples)),
        Samples::U16(samples) => Samples::U16(widen(&samples)),
        Samples::F32(samples) => Samples::F32(widen(&samples)),
    }
}

fn channel_of(samples: &Samples, channel: usize, channels: usize) -> Samples {
    fn pick<T: Copy>(samples: &[T], channel: usize, channels: usize) -> Vec<T> {
        samples.iter().skip(channel).step_by(channels).copied().collect()
    }
    match samples {
        Samples::U8(samples) => Samples::U8(pick(samples, channel, channels)),
        Samples::U16(samples) => Samples::U16(pick(samples, channel, channels)),
        Samples::F32(samples) => Samples::F32(pick(samples, channel, channels)),
    }
}

/// Names of a texel's samples inside a file.
fn names(baked: &Baked, channels: usize) -> Vec<String> {
    let own = || baked.info.channels.iter().map(|channel| channel.name.to_owned()).collect();
    match channels {
        1 => vec!["Y".to_owned()],
        2..=4 => ["R", "G", "B", "A"][..channels].iter().map(|&name| name.to_owned()).collect(),
        _ => own(),
    }
}

impl Baked {
    /// A slice of a layer as the image files that hold it: mostly one, with an empty name; one for
    /// each channel, under its name, where the format has fewer channels than the map.
    ///
    /// PNG and TIFF have no two-channel colour, so maps of two channels get a blue channel of 0
    /// there; EXR stores them as R and G. `ranges` are those of [`Baked::ranges`].
    ///
    /// # Errors
    /// [`BakeError::Shape`] for a layer that has not the size it claims, or that does not exist.
    pub fn images(
        &self,
        layer: usize,
        slice: usize,
        format: FileFormat,
        ranges: &[Range],
    ) -> Result<Vec<(&'static str, Image)>, BakeError> {
        let channels = self.info.channels.len();
        let Some(layer) = self.layers.get(layer).filter(|layer| slice < layer.depth) else {
            return Err(BakeError::Shape { width: 0, height: 0, channels, got: 0 });
        };
        let samples = samples(layer, slice, ranges, format);
        let image = |names, samples| Image::named(layer.width, layer.height, names, samples);
        if channels > format.channels() {
            let each = self.info.channels.iter().enumerate();
            return each
                .map(|(at, channel)| {
                    let samples = channel_of(&samples, at, channels);
                    Ok((channel.name, image(names(self, 1), samples)?))
                })
                .collect();
        }
        if channels == 2 && format != FileFormat::Exr {
            return Ok(vec![("", image(names(self, 3), with_blue(samples))?)]);
        }
        Ok(vec![("", image(names(self, channels), samples)?)])
    }
}

/// Writes a baked map into a folder and returns the files made.
///
/// A map is `<stem>_<map>.png` (or `.tiff`, `.exr`); the levels of a pyramid and the slices of a
/// stack are `<stem>_<map>_00.png` and so on; the channels of a map that has more of them than the
/// format are `<stem>_<map>_<channel>.png`. An empty `stem` drops the first underscore. Integers
/// follow [`Baked::ranges`], so lower bounds are rounded down and upper ones up.
///
/// # Errors
/// See [`write_image`].
pub fn save(baked: &Baked, folder: &Path, stem: &str, format: FileFormat) -> Result<Vec<PathBuf>, BakeError> {
    let separator = if stem.is_empty() { "" } else { "_" };
    let (name, ranges) = (baked.info.name, baked.ranges());
    let mut paths = Vec::new();
    let slices: usize = baked.layers.iter().map(|layer| layer.depth).sum();
    let digits = slices.saturating_sub(1).to_string().len().max(2);
    let parts =
        baked.layers.iter().enumerate().flat_map(|(at, layer)| (0..layer.depth).map(move |k| (at, k)));
    for (number, (layer, slice)) in parts.enumerate() {
        let number =
            if baked.info.form == Form::Single { String::new() } else { format!("_{number:0digits$}") };
        for (channel, image) in baked.images(layer, slice, format, &ranges)? {
            let channel = if channel.is_empty() { String::new() } else { format!("_{channel}") };
            let file = format!("{stem}{separator}{name}{number}{channel}.{}", format.suffix());
            let path = folder.join(file);
            write_image(&path, &image)?;
            paths.push(path);
        }
    }
    Ok(paths)
}
