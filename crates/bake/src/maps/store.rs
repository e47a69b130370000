//! Baked maps as image files.

use std::path::{Path, PathBuf};

use super::{Baked, Encoded, Form, MapInfo};
use crate::encode::{Depth, Range, encode};
use crate::files::{WriteOptions, write_image_unless_stopped};
use crate::{BakeError, Image, Progress, Samples};

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

/// A baked map that can be stored.
pub trait Storable {
    /// What it is.
    fn info(&self) -> &'static MapInfo;

    /// What integers stand for in each channel.
    fn ranges(&self) -> Vec<Range>;

    /// Texels across and down, and slices, of each layer.
    fn shapes(&self) -> Vec<[usize; 3]>;

    /// The interleaved samples of one slice, as integers of that depth, or as floats for `None`.
    fn samples(&self, layer: usize, slice: usize, depth: Option<Depth>, ranges: &[Range]) -> Samples;
}

fn part<T>(texels: &[T], depth: usize, slice: usize) -> &[T] {
    let length = texels.len() / depth.max(1);
    texels.get(slice * length..(slice + 1) * length).unwrap_or_default()
}

impl Storable for Baked {
    fn info(&self) -> &'static MapInfo {
        self.info
    }

    fn ranges(&self) -> Vec<Range> {
        self.ranges()
    }

    fn shapes(&self) -> Vec<[usize; 3]> {
        self.layers.iter().map(|layer| [layer.width, layer.height, layer.depth]).collect()
    }

    fn samples(&self, layer: usize, slice: usize, depth: Option<Depth>, ranges: &[Range]) -> Samples {
        let texels = part(&self.layers[layer].texels, self.layers[layer].depth, slice);
        depth.map_or_else(|| Samples::F32(texels.to_vec()), |depth| encode(texels, ranges, depth))
    }
}

/// Integers are stored as they are; the depth asked for has to be theirs.
impl Storable for Encoded {
    fn info(&self) -> &'static MapInfo {
        self.info
    }

    fn ranges(&self) -> Vec<Range> {
        self.ranges.clone()
    }

    fn shapes(&self) -> Vec<[usize; 3]> {
        self.layers.iter().map(|layer| [layer.width, layer.height, layer.depth]).collect()
    }

    fn samples(&self, layer: usize, slice: usize, _: Option<Depth>, _: &[Range]) -> Samples {
        let depth = self.layers[layer].depth;
        match &self.layers[layer].samples {
            Samples::U8(samples) => Samples::U8(part(samples, depth, slice).to_vec()),
            Samples::U16(samples) => Samples::U16(part(samples, depth, slice).to_vec()),
            Samples::F32(samples) => Samples::F32(part(samples, depth, slice).to_vec()),
        }
    }
}

/// Texels of two channels with a third of 0: PNG and TIFF have no colour of two channels.
fn with_blue(samples: &Samples) -> Samples {
    fn widen<T: Copy + Default>(samples: &[T]) -> Vec<T> {
        samples.chunks_exact(2).flat_map(|t| [t[0], t[1], T::default()]).collect()
    }
    match samples {
        Samples::U8(samples) => Samples::U8(widen(samples)),
        Samples::U16(samples) => Samples::U16(widen(samples)),
        Samples::F32(samples) => Samples::F32(widen(samples)),
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

/// The image files that hold a slice, by the name of their channel: mostly one, without a name.
fn images(
    info: &'static MapInfo,
    [width, height, _]: [usize; 3],
    samples: Samples,
    format: FileFormat,
) -> Result<Vec<(&'static str, Image)>, BakeError> {
    let channels = info.channels.len();
    let named = |names: &[&str], samples| {
        Image::named(width, height, names.iter().map(|&name| name.to_owned()).collect(), samples)
    };
    if channels > format.channels() {
        let each = info.channels.iter().enumerate();
        return each
            .map(|(at, channel)| Ok((channel.name, named(&["Y"], channel_of(&samples, at, channels))?)))
            .collect();
    }
    let image = match channels {
        1 => named(&["Y"], samples)?,
        2 if format != FileFormat::Exr => named(&["R", "G", "B"], with_blue(&samples))?,
        2..=4 => named(&["R", "G", "B", "A"][..channels], samples)?,
        _ => named(&info.channels.iter().map(|channel| channel.name).collect::<Vec<_>>(), samples)?,
    };
    Ok(vec![("", image)])
}

/// A file that holds a slice of a map, or one channel of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stored {
    /// The file.
    pub path: PathBuf,
    /// Index of its layer.
    pub layer: usize,
    /// Index of its slice.
    pub slice: usize,
    /// Name of its only channel, or `None` when it has all of them.
    pub channel: Option<&'static str>,
}

/// Writes a map into a folder and returns the files made.
///
/// A map is `<stem>_<map>.png` (or `.tiff`, `.exr`); the levels of a pyramid and the slices of a
/// stack are `<stem>_<map>_00.png` and so on; the channels of a map that has more of them than the
/// format are `<stem>_<map>_<channel>.png`. An empty `stem` drops the first underscore. Maps of two
/// channels have a blue channel of 0 in PNG and TIFF. Integers follow [`Storable::ranges`], so lower
/// bounds are rounded down and upper ones up.
///
/// # Errors
/// See [`write_image`](crate::write_image); [`BakeError::Interrupted`], with whole files only.
pub fn save(
    map: &impl Storable,
    folder: &Path,
    stem: &str,
    format: FileFormat,
    mut progress: Progress<'_>,
) -> Result<Vec<Stored>, BakeError> {
    let separator = if stem.is_empty() { "" } else { "_" };
    let (info, ranges, shapes) = (map.info(), map.ranges(), map.shapes());
    let name = info.name;
    let slices: usize = shapes.iter().map(|shape| shape[2]).sum();
    let digits = slices.saturating_sub(1).to_string().len().max(2);
    let mut files = Vec::new();
    let parts = shapes.iter().enumerate().flat_map(|(layer, shape)| (0..shape[2]).map(move |k| (layer, k)));
    for (number, (layer, slice)) in parts.enumerate() {
        progress.report(number, slices)?;
        let number = if info.form == Form::Single { String::new() } else { format!("_{number:0digits$}") };
        let samples = map.samples(layer, slice, format.depth(), &ranges);
        for (channel, image) in images(info, shapes[layer], samples, format)? {
            let suffix = format.suffix();
            let end = if channel.is_empty() { String::new() } else { format!("_{channel}") };
            let path = folder.join(format!("{stem}{separator}{name}{number}{end}.{suffix}"));
            write_image_unless_stopped(&path, &image, WriteOptions::default(), &mut progress)?;
            let channel = (!channel.is_empty()).then_some(channel);
            files.push(Stored { path, layer, slice, channel });
        }
    }
    progress.report(slices, slices)?;
    Ok(files)
}
