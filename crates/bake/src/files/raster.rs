//! PNG, JPEG, WebP, BMP and TGA, through the `image` crate.

use std::error::Error;
use std::io::Cursor;

use ::image::codecs::bmp::BmpDecoder;
use ::image::codecs::jpeg::JpegDecoder;
use ::image::codecs::png::PngDecoder;
use ::image::codecs::tga::TgaDecoder;
use ::image::codecs::webp::WebPDecoder;
use ::image::{ColorType, ImageDecoder, ImageError, ImageFormat, Limits};

use super::guard::Claim;
use super::marks;
use crate::{BakeError, Image, Samples};

/// Bytes a decoder may use beyond the picture: profiles, texts, rows at work.
const SPARE: u64 = 64 << 20;

/// Decodes a file of that format.
pub(super) fn decode(bytes: &[u8], format: ImageFormat) -> Result<Image, BakeError> {
    let cursor = Cursor::new(bytes);
    let (name, image) = match format {
        ImageFormat::Png => ("PNG", decode_png(bytes)?),
        ImageFormat::Jpeg if !marks::jpeg_is_complete(bytes) => {
            let problem = "it stops before its end marker".to_owned();
            return Err(BakeError::Malformed { format: "JPEG", problem });
        }
        ImageFormat::Jpeg => ("JPEG", finish("JPEG", JpegDecoder::new(cursor), bytes.len())?),
        ImageFormat::WebP => ("WebP", finish("WebP", WebPDecoder::new(cursor), bytes.len())?),
        ImageFormat::Bmp => ("BMP", finish("BMP", BmpDecoder::new(cursor), bytes.len())?),
        _ => ("TGA", finish("TGA", TgaDecoder::new(cursor), bytes.len())?),
    };
    Ok(warn(image, name, bytes))
}

fn decode_png(bytes: &[u8]) -> Result<Image, BakeError> {
    // The decoder wants its limit before it tells the size.
    let Some((width, height)) = marks::png_size(bytes) else {
        return Err(BakeError::Malformed { format: "PNG", problem: "it has no header".to_owned() });
    };
    let claim = Claim {
        format: "PNG",
        width: width.into(),
        height: height.into(),
        channels: 1,
        bytes_per_sample: 1,
        file_bytes: bytes.len(),
    };
    let texels = claim.samples()? as u64;
    let mut limits = Limits::no_limits();
    // Four 16-bit channels at most, twice for what is at work.
    limits.max_alloc = Some(SPARE + 16 * texels);
    finish("PNG", PngDecoder::with_limits(Cursor::new(bytes), limits), bytes.len())
}

fn finish<D: ImageDecoder>(
    format: &'static str,
    decoder: Result<D, ImageError>,
    file_bytes: usize,
) -> Result<Image, BakeError> {
    let mut decoder = decoder.map_err(|error| explain(format, &error))?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let claim = Claim {
        format,
        width: width.into(),
        height: height.into(),
        channels: color.channel_count().into(),
        bytes_per_sample: (color.bytes_per_pixel() / color.channel_count()).into(),
        file_bytes,
    };
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(SPARE + 4 * decoder.total_bytes());
    let samples = match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            let mut samples = claim.buffer::<u8>()?;
            decoder.set_limits(limits).map_err(|error| explain(format, &error))?;
            decoder.read_image(&mut samples).map_err(|error| explain(format, &error))?;
            Samples::U8(samples)
        }
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            let mut samples = claim.buffer::<u16>()?;
            decoder.set_limits(limits).map_err(|error| explain(format, &error))?;
            let bytes = bytemuck::cast_slice_mut(&mut samples);
            decoder.read_image(bytes).map_err(|error| explain(format, &error))?;
            Samples::U16(samples)
        }
        other => return Err(BakeError::Unsupported { format, feature: format!("sample layout {other:?}") }),
    };
    Image::new(width as usize, height as usize, color.channel_count().into(), samples)
}

fn explain(format: &'static str, error: &ImageError) -> BakeError {
    // The error inside says the same without repeating the format.
    let text = error.source().map_or_else(|| error.to_string(), ToString::to_string);
    match error {
        ImageError::Unsupported(_) => BakeError::Unsupported { format, feature: text },
        _ => BakeError::Malformed { format, problem: text },
    }
}

fn warn(mut image: Image, format: &str, bytes: &[u8]) -> Image {
    match format {
        "PNG" => {
            if let Some(tag) = marks::png_colour_tag(bytes) {
                image.warnings.push(format!(
                    "the PNG is tagged as colour ({tag} chunk); its numbers are taken as linear data"
                ));
            }
        }
        "JPEG" => image.warnings.push("JPEG is lossy and has 8 bits: expect ringing and terraces".to_owned()),
        "WebP" if marks::webp_is_lossy(bytes) => {
            image.warnings.push("lossy WebP has 8 bits: expect ringing and terraces".to_owned());
        }
        _ => {}
    }
    image
}
