//! Writing image files: under a temporary name in the same folder, renamed when complete.

use std::io::{Seek, Write};
use std::path::Path;

use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, SmallVec, WritableImage,
};
use ::image::codecs::png::{CompressionType, FilterType, PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder};
use ::tiff::encoder::colortype::{self, ColorType};
use ::tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder, TiffValue};
use ::tiff::tags::ExtraSamples;
use half::f16;

use super::replace::replace;
use crate::{BakeError, Image, Progress, Samples};

/// How to store an image where a format leaves a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WriteOptions {
    /// EXR only: 16-bit floats instead of 32-bit ones.
    pub half: bool,
}

/// Writes an image; the suffix says how: `.png` (8- and 16-bit integers, 1 to 4 channels), `.tif`
/// or `.tiff` (also 32-bit floats), `.exr` (32-bit floats under the channels' names, integers as
/// 0..1). All are compressed without loss.
///
/// A reader of `path` sees the old file or the new one, never half of one.
///
/// # Errors
/// [`BakeError::Unwritable`] when the format cannot hold the image or is unknown;
/// [`BakeError::Io`] when the folder is missing or may not be written; [`BakeError::Shape`].
pub fn write_image(path: &Path, image: &Image) -> Result<(), BakeError> {
    write_image_with(path, image, WriteOptions::default())
}

/// [`write_image`] with options.
///
/// # Errors
/// See [`write_image`]; also [`BakeError::Unwritable`] when an option does not apply.
pub fn write_image_with(path: &Path, image: &Image, options: WriteOptions) -> Result<(), BakeError> {
    write_image_unless_stopped(path, image, options, &mut Progress::none())
}

/// [`write_image_with`] that asks `progress` now and then whether to go on; it reports nothing.
///
/// # Errors
/// See [`write_image_with`]; also [`BakeError::Interrupted`], after which there is no new file.
pub fn write_image_unless_stopped(
    path: &Path,
    image: &Image,
    options: WriteOptions,
    progress: &mut Progress<'_>,
) -> Result<(), BakeError> {
    image.validate()?;
    let suffix =
        path.extension().map(|suffix| suffix.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let format = match suffix.as_str() {
        "png" => Format::Png,
        "tif" | "tiff" => Format::Tiff,
        "exr" => Format::Exr,
        _ => {
            let problem = "the suffix must be .png, .tif, .tiff or .exr";
            return Err(unwritable(image, &format!("{suffix:?}"), problem));
        }
    };
    if options.half && format != Format::Exr {
        return Err(unwritable(image, &suffix, "half floats exist in EXR only"));
    }
    replace(path, progress, |writer| match format {
        Format::Png => write_png(writer, image),
        Format::Tiff => write_tiff(writer, image),
        Format::Exr => write_exr(writer, image, options),
    })
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Png,
    Tiff,
    Exr,
}

fn write_png(writer: &mut impl Write, image: &Image) -> Result<(), BakeError> {
    use ExtendedColorType as Color;
    let (bytes, colors): (&[u8], _) = match &image.samples {
        Samples::U8(samples) => (samples, [Color::L8, Color::La8, Color::Rgb8, Color::Rgba8]),
        Samples::U16(samples) => {
            (bytemuck::cast_slice(samples), [Color::L16, Color::La16, Color::Rgb16, Color::Rgba16])
        }
        Samples::F32(_) => {
            return Err(unwritable(image, "PNG", "encode it to 8 or 16 bits, or write EXR or TIFF"));
        }
    };
    let Some(&color) = image.channels.checked_sub(1).and_then(|i| colors.get(i)) else {
        return Err(unwritable(image, "PNG", "it holds 1 to 4 channels"));
    };
    let (width, height) = sides(image, "PNG")?;
    PngEncoder::new_with_quality(writer, CompressionType::Fast, FilterType::Adaptive)
        .write_image(bytes, width, height, color)
        .map_err(|error| unwritable(image, "PNG", &error.to_string()))
}

fn write_tiff(writer: &mut (impl Write + Seek), image: &Image) -> Result<(), BakeError> {
    match &image.samples {
        Samples::U8(samples) => match image.channels {
            1 | 2 => tiff_as::<colortype::Gray8>(writer, image, samples),
            _ => tiff_as::<colortype::RGB8>(writer, image, samples),
        },
        Samples::U16(samples) => match image.channels {
            1 | 2 => tiff_as::<colortype::Gray16>(writer, image, samples),
            _ => tiff_as::<colortype::RGB16>(writer, image, samples),
        },
        Samples::F32(samples) => match image.channels {
            1 | 2 => tiff_as::<colortype::Gray32Float>(writer, image, samples),
            _ => tiff_as::<colortype::RGB32Float>(writer, image, samples),
        },
    }
}

fn tiff_as<C: ColorType>(
    writer: &mut (impl Write + Seek),
    image: &Image,
    samples: &[C::Inner],
) -> Result<(), BakeError>
where
    [C::Inner]: TiffValue,
{
    let (width, height) = sides(image, "TIFF")?;
    let failed = |error: ::tiff::TiffError| unwritable(image, "TIFF", &error.to_string());
    if image.channels > 4 {
        return Err(unwritable(image, "TIFF", "it holds 1 to 4 channels"));
    }
    if size_of_val(samples) as u64 > u64::from(u32::MAX) / 2 {
        return Err(unwritable(image, "TIFF", "it holds up to 2 GB; write EXR"));
    }
    let mut encoder = TiffEncoder::new(writer)
        .map_err(failed)?
        .with_compression(Compression::Deflate(DeflateLevel::Balanced));
    // Differences of neighbours compress better, but the encoder has them for integers without
    // extra channels only.
    let extra = image.channels - C::BITS_PER_SAMPLE.len();
    if !matches!(image.samples, Samples::F32(_)) && extra == 0 {
        encoder = encoder.with_predictor(Predictor::Horizontal);
    }
    let mut target = encoder.new_image::<C>(width, height).map_err(failed)?;
    if extra > 0 {
        target.extra_samples(&[ExtraSamples::UnassociatedAlpha]).map_err(failed)?;
    }
    target.write_data(samples).map_err(failed)
}

fn write_exr(
    writer: &mut (impl Write + Seek),
    image: &Image,
    options: WriteOptions,
) -> Result<(), BakeError> {
    let mut list = SmallVec::new();
    for (channel, name) in image.names.iter().enumerate() {
        let samples = image.channel_f32(channel).unwrap_or_default();
        let samples = if options.half {
            FlatSamples::F16(samples.into_iter().map(f16::from_f32).collect())
        } else {
            FlatSamples::F32(samples)
        };
        list.push(AnyChannel::new(name.as_str(), samples));
    }
    if list.len() != image.channels || has_twins(&image.names) {
        return Err(unwritable(image, "EXR", "every channel needs a name of its own"));
    }
    let size = (image.width, image.height);
    let channels = AnyChannels::sort(list);
    let layer = Layer::new(size, LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
    ::exr::image::Image::from_layer(layer)
        .write()
        .to_buffered(writer)
        .map_err(|error| unwritable(image, "EXR", &error.to_string()))
}

fn has_twins(names: &[String]) -> bool {
    names.iter().enumerate().any(|(i, name)| names[..i].contains(name))
}

fn sides(image: &Image, format: &str) -> Result<(u32, u32), BakeError> {
    match (u32::try_from(image.width), u32::try_from(image.height)) {
        (Ok(width), Ok(height)) => Ok((width, height)),
        _ => Err(unwritable(image, format, "a side is longer than 4294967295")),
    }
}

fn unwritable(image: &Image, format: &str, problem: &str) -> BakeError {
    BakeError::Unwritable {
        what: format!(
            "{} x {} texels with {} channels of {}",
            image.width,
            image.height,
            image.channels,
            image.samples.type_name()
        ),
        format: format.to_owned(),
        problem: problem.to_owned(),
    }
}
