//! TIFF and BigTIFF, through the `tiff` crate.
//!
//! Grey, RGB and any number of plain channels, with or without alpha; strips or tiles, interleaved or
//! in planes; uncompressed, LZW, Deflate, PackBits, fax. Unsigned integers of 1 to 16 bits keep
//! their meaning of 0..1 (1, 2 and 4 bits as `U8`), wider ones become floats in 0..1. Floats of any width and
//! *signed* integers, as in elevation models, are numbers as they are.

use std::io::Cursor;

use ::tiff::decoder::{BufferLayoutPreference, ChunkType, Decoder, DecodingResult, Limits};
use ::tiff::tags::Tag;
use ::tiff::{ColorType, TiffError};
use half::f16;

use super::guard::Claim;
use crate::{BakeError, Image, Samples};

const FORMAT: &str = "TIFF";

/// Decodes the first image of a TIFF file.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, BakeError> {
    // The `tiff` crate checks some sizes with assertions. Those known to fire are kept from it below;
    // should another one fire, the file is at fault and not the program. Nothing outlives the call.
    std::panic::catch_unwind(|| decode_unguarded(bytes)).unwrap_or_else(|_| {
        Err(BakeError::Malformed { format: FORMAT, problem: "its sizes contradict each other".to_owned() })
    })
}

fn decode_unguarded(bytes: &[u8]) -> Result<Image, BakeError> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(explain)?;
    let (width, height) = decoder.dimensions().map_err(explain)?;
    let color = decoder.colortype().map_err(explain)?;
    let (channels, bits) = layout(color)?;
    let claim = Claim {
        format: FORMAT,
        width: width.into(),
        height: height.into(),
        channels: channels as u64,
        bytes_per_sample: u64::from(bits).div_ceil(8),
        file_bytes: bytes.len(),
    };
    let samples = claim.samples()?;
    check_chunks(&mut decoder, claim)?;
    let mut limits = Limits::default();
    limits.decoding_buffer_size = samples * usize::from(bits).div_ceil(8);
    limits.intermediate_buffer_size = limits.intermediate_buffer_size.max(bytes.len());
    let mut decoder = decoder.with_limits(limits.clone());
    let shape = Shape { width: width as usize, height: height as usize, channels, bits };
    let (result, found) = read(&mut decoder, &shape, &limits)?;
    let mut warnings = Vec::new();
    let samples = convert(result, &shape, &found, &mut warnings)?;
    let mut image = Image::new(shape.width, shape.height, channels, samples)?;
    if matches!(color, ColorType::Multiband { .. }) && channels > 2 {
        image.names = (0..channels).map(|channel| format!("C{channel}")).collect();
    }
    image.warnings = warnings;
    Ok(image)
}

struct Shape {
    width: usize,
    height: usize,
    channels: usize,
    bits: u8,
}

/// Channels and bits a sample of a supported layout.
fn layout(color: ColorType) -> Result<(usize, u8), BakeError> {
    let bits = color.bit_depth();
    match color {
        ColorType::Gray(_)
        | ColorType::GrayA(_)
        | ColorType::RGB(_)
        | ColorType::RGBA(_)
        | ColorType::Multiband { .. }
            if matches!(bits, 1 | 2 | 4 | 8 | 16 | 32 | 64) =>
        {
            Ok((color.num_samples().into(), bits))
        }
        _ => Err(unsupported(format!("sample layout {color:?}"))),
    }
}

/// What would only be found after memory is taken for it: chunks outside the file, or absurd tiles.
fn check_chunks(decoder: &mut Decoder<Cursor<&[u8]>>, claim: Claim) -> Result<(), BakeError> {
    for tag in [Tag::StripOffsets, Tag::TileOffsets] {
        let offsets = decoder.find_tag_unsigned_vec::<u64>(tag).map_err(explain)?.unwrap_or_default();
        if let Some(offset) = offsets.into_iter().find(|&offset| offset >= claim.file_bytes as u64) {
            let problem = format!("it has pixels at byte {offset} but ends at {}", claim.file_bytes);
            return Err(BakeError::Malformed { format: FORMAT, problem });
        }
    }
    if decoder.get_chunk_type() == ChunkType::Tile {
        let (width, height) = decoder.chunk_dimensions();
        let channels = decoder.find_tag_unsigned::<u64>(Tag::SamplesPerPixel).map_err(explain)?.unwrap_or(1);
        Claim { width: width.into(), height: height.into(), channels, ..claim }.samples()?;
    }
    Ok(())
}

/// Reads the whole picture; planes come one after the other.
fn read(
    decoder: &mut Decoder<Cursor<&[u8]>>,
    shape: &Shape,
    limits: &Limits,
) -> Result<(DecodingResult, BufferLayoutPreference), BakeError> {
    let mut result = DecodingResult::U8(Vec::new());
    let layout = decoder.image_buffer_layout().map_err(explain)?;
    if layout.planes > 1 && shape.bits < 8 {
        return Err(unsupported(format!("{} bits a sample in planes", shape.bits)));
    }
    if layout.planes > 1 && decoder.get_chunk_type() == ChunkType::Tile {
        result.resize_to(&layout, limits).map_err(explain)?;
        read_tiled_planes(decoder, shape, result.as_buffer(0).as_bytes_mut()).map_err(explain)?;
        return Ok((result, layout));
    }
    let layout = decoder.read_image_to_buffer(&mut result).map_err(explain)?;
    Ok((result, layout))
}

/// Puts planes of tiles together. The `tiff` crate can do that itself, but it takes the lowest tiles
/// of all planes but the first for whole ones and then panics.
fn read_tiled_planes(
    decoder: &mut Decoder<Cursor<&[u8]>>,
    shape: &Shape,
    target: &mut [u8],
) -> Result<(), TiffError> {
    let (tile_width, tile_height) = decoder.chunk_dimensions();
    let (tile_width, tile_height) = (tile_width as usize, tile_height as usize);
    let sample = usize::from(shape.bits) / 8;
    let row = shape.width * sample;
    let mut tile = Vec::new();
    let mut chunk = 0;
    for plane in target.chunks_exact_mut(row * shape.height) {
        for y in (0..shape.height).step_by(tile_height) {
            for x in (0..shape.width).step_by(tile_width) {
                let layout = decoder.image_chunk_buffer_layout(chunk)?;
                tile.resize(layout.len, 0);
                decoder.read_chunk_bytes(chunk, &mut tile)?;
                chunk += 1;
                let stride = layout.row_stride.map_or(layout.len, |stride| stride.get());
                let wanted = tile_width.min(shape.width - x) * sample;
                let rows = plane.chunks_exact_mut(row).skip(y).take(tile_height);
                for (target, source) in rows.zip(tile.chunks_exact(stride)) {
                    target[x * sample..][..wanted].copy_from_slice(&source[..wanted]);
                }
            }
        }
    }
    Ok(())
}

fn convert(
    result: DecodingResult,
    shape: &Shape,
    found: &BufferLayoutPreference,
    warnings: &mut Vec<String>,
) -> Result<Samples, BakeError> {
    let mut signed = || {
        warnings.push("the TIFF holds signed integers: taken as numbers, not scaled to 0..1".to_owned());
    };
    let samples = match result {
        DecodingResult::U8(packed) if shape.bits < 8 => Samples::U8(unpack(&packed, shape)?),
        DecodingResult::U8(samples) => Samples::U8(interleave(samples, shape, found)?),
        DecodingResult::U16(samples) => Samples::U16(interleave(samples, shape, found)?),
        DecodingResult::U32(samples) => {
            floats(samples, shape, found, |v| (f64::from(v) / f64::from(u32::MAX)) as f32)?
        }
        DecodingResult::U64(samples) => {
            floats(samples, shape, found, |v| (v as f64 / u64::MAX as f64) as f32)?
        }
        DecodingResult::F16(samples) => floats(samples, shape, found, f16::to_f32)?,
        DecodingResult::F32(samples) => Samples::F32(interleave(samples, shape, found)?),
        DecodingResult::F64(samples) => floats(samples, shape, found, |v| v as f32)?,
        DecodingResult::I8(samples) if shape.bits == 8 => {
            signed();
            floats(samples, shape, found, f32::from)?
        }
        DecodingResult::I16(samples) => {
            signed();
            floats(samples, shape, found, f32::from)?
        }
        DecodingResult::I32(samples) => {
            signed();
            floats(samples, shape, found, |v| v as f32)?
        }
        DecodingResult::I64(samples) => {
            signed();
            floats(samples, shape, found, |v| v as f32)?
        }
        DecodingResult::I8(_) => return Err(unsupported(format!("signed integers of {} bits", shape.bits))),
    };
    Ok(samples)
}

fn floats<T: Copy>(
    samples: Vec<T>,
    shape: &Shape,
    found: &BufferLayoutPreference,
    convert: impl Fn(T) -> f32,
) -> Result<Samples, BakeError> {
    let samples = interleave(samples, shape, found)?;
    Ok(Samples::F32(samples.into_iter().map(convert).collect()))
}

/// Turns planes one after the other into interleaved texels.
fn interleave<T: Copy>(
    samples: Vec<T>,
    shape: &Shape,
    found: &BufferLayoutPreference,
) -> Result<Vec<T>, BakeError> {
    if found.planes <= 1 || samples.is_empty() {
        return Ok(samples);
    }
    let texels = shape.width * shape.height;
    if samples.len() < texels * shape.channels {
        return Err(unsupported(format!("planes of unequal size ({} samples)", samples.len())));
    }
    Ok((0..texels)
        .flat_map(|texel| (0..shape.channels).map(move |plane| (plane, texel)))
        .map(|(plane, texel)| samples[plane * texels + texel])
        .collect())
}

/// Widens samples of 1, 2 or 4 bits to 8, so that their full value is 255. Rows start at a byte.
fn unpack(packed: &[u8], shape: &Shape) -> Result<Vec<u8>, BakeError> {
    let across = shape.width * shape.channels;
    let bits = usize::from(shape.bits);
    let row_bytes = (across * bits).div_ceil(8);
    let full = (1_u16 << bits) - 1;
    if packed.len() < row_bytes * shape.height {
        return Err(BakeError::Malformed { format: FORMAT, problem: "pixels are missing".to_owned() });
    }
    let mut samples = Vec::with_capacity(across * shape.height);
    for row in packed.chunks_exact(row_bytes).take(shape.height) {
        samples.extend((0..across).map(|i| {
            let shift = 8 - bits - (i * bits) % 8;
            let value = u16::from(row[i * bits / 8] >> shift) & full;
            (value * 255 / full) as u8
        }));
    }
    Ok(samples)
}

fn explain(error: TiffError) -> BakeError {
    match error {
        TiffError::UnsupportedError(what) => unsupported(what.to_string()),
        TiffError::LimitsExceeded => BakeError::Malformed {
            format: FORMAT,
            problem: "it asks for more memory than its size needs".to_owned(),
        },
        other => BakeError::Malformed { format: FORMAT, problem: other.to_string() },
    }
}

fn unsupported(feature: String) -> BakeError {
    BakeError::Unsupported { format: FORMAT, feature }
}
