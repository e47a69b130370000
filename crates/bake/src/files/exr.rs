//! OpenEXR, through the `exr` crate.
//!
//! Any channel names; half, float and unsigned integer samples, all as `F32` (integers as numbers);
//! scan lines and tiles, of which the largest level is read; the first flat part of a multi-part
//! file. The image is the *display window*: pixels stored outside it are dropped and pixels missing
//! inside it are 0. Channels come in the file's order, which is alphabetical, but `R G B A` and
//! `Y A` come as written here.

use std::collections::HashSet;
use std::io::Cursor;

use ::exr::block::UncompressedBlock;
use ::exr::block::chunk::Chunk;
use ::exr::error::Error as ExrError;
use ::exr::math::Vec2;
use ::exr::meta::MetaData;
use ::exr::meta::attribute::{ChannelDescription, SampleType};
use ::exr::meta::header::Header;
use half::f16;
use rayon::prelude::*;

use super::guard::Claim;
use crate::{BakeError, Image, Samples};

const FORMAT: &str = "EXR";
/// Chunks decompressed at a time.
const BATCH: usize = 64;

/// Decodes an EXR file.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, BakeError> {
    let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(explain)?;
    let meta = reader.meta_data().clone();
    let part = meta.headers.iter().position(|header| !header.deep).ok_or_else(|| unsupported("deep data"))?;
    let header = &meta.headers[part];
    if let Some(channel) = header.channels.list.iter().find(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(unsupported(&format!("subsampled channel {:?}", channel.name.to_string())));
    }
    let chunks: u128 = meta.headers.iter().map(|header| header.chunk_count as u128).sum();
    if 8 * chunks > bytes.len() as u128 {
        return Err(malformed(format!("{} bytes cannot list {chunks} chunks", bytes.len())));
    }
    let order = channel_order(&header.channels.list);
    let mut canvas = Canvas::new(header, &order, bytes.len())?;
    let chunks = reader
        .filter_chunks(false, |_, tile, block| block.layer == part && tile.level_index == Vec2(0, 0))
        .map_err(explain)?;
    let mut seen = HashSet::new();
    let mut batch: Vec<Chunk> = Vec::with_capacity(BATCH);
    let mut chunks = chunks.peekable();
    while let Some(chunk) = chunks.next() {
        batch.push(chunk.map_err(explain)?);
        if batch.len() < BATCH && chunks.peek().is_some() {
            continue;
        }
        for block in decompress(&mut batch, &meta) {
            let block = block.map_err(explain)?;
            let Vec2(x, y) = block.index.pixel_position;
            // The offset table may name a chunk twice, or one of another part or level.
            if block.index.layer != part || block.index.level != Vec2(0, 0) || !seen.insert((x, y)) {
                return Err(malformed("the chunk table is inconsistent".to_owned()));
            }
            canvas.draw(&block, &header.channels.list)?;
        }
    }
    canvas.finish(header, &meta)
}

/// Decompresses in parallel. The `exr` crate has this too, but a panic in its threads would end the
/// process; here it would reach the caller.
fn decompress(batch: &mut Vec<Chunk>, meta: &MetaData) -> Vec<Result<UncompressedBlock, ExrError>> {
    batch.par_drain(..).map(|chunk| UncompressedBlock::decompress_chunk(chunk, meta, false)).collect()
}

/// The image being put together.
struct Canvas {
    width: usize,
    height: usize,
    names: Vec<String>,
    /// Where each of the file's channels goes in a texel.
    slots: Vec<usize>,
    /// Offset of the data window inside the display window.
    offset: [i64; 2],
    texels: Vec<f32>,
}

impl Canvas {
    fn new(header: &Header, order: &[usize], file_bytes: usize) -> Result<Self, BakeError> {
        let claim = |size: Vec2<usize>| Claim {
            format: FORMAT,
            width: size.0 as u64,
            height: size.1 as u64,
            channels: header.channels.list.len() as u64,
            bytes_per_sample: 4,
            file_bytes,
        };
        let display = header.shared_attributes.display_window;
        claim(header.layer_size).samples()?;
        let texels = claim(display.size).buffer::<f32>()?;
        let position = header.own_attributes.layer_position;
        let mut slots = vec![0; order.len()];
        for (slot, &channel) in order.iter().enumerate() {
            slots[channel] = slot;
        }
        let offset = [
            i64::from(position.0) - i64::from(display.position.0),
            i64::from(position.1) - i64::from(display.position.1),
        ];
        let names = order.iter().map(|&channel| header.channels.list[channel].name.to_string()).collect();
        Ok(Self { width: display.size.0, height: display.size.1, names, slots, offset, texels })
    }

    fn draw(&mut self, block: &UncompressedBlock, channels: &[ChannelDescription]) -> Result<(), BakeError> {
        let Vec2(columns, rows) = block.index.pixel_size;
        let x = block.index.pixel_position.0 as i64 + self.offset[0];
        let y = block.index.pixel_position.1 as i64 + self.offset[1];
        // The part of each line that lies inside the image.
        let first = (-x).clamp(0, columns as i64) as usize;
        let end = (self.width as i64 - x).clamp(first as i64, columns as i64) as usize;
        let stride = self.slots.len();
        let mut lines = block.data.as_slice();
        for row in 0..rows {
            for (channel, &slot) in channels.iter().zip(&self.slots) {
                let length = columns * channel.sample_type.bytes_per_sample();
                let Some((line, rest)) = lines.split_at_checked(length) else {
                    return Err(malformed("a chunk holds less than its pixels".to_owned()));
                };
                lines = rest;
                let Some(j) = usize::try_from(y + row as i64).ok().filter(|&j| j < self.height) else {
                    continue;
                };
                if first == end {
                    continue;
                }
                let start = (j * self.width + (x + first as i64) as usize) * stride + slot;
                let target = self.texels[start..].iter_mut().step_by(stride).take(end - first);
                match channel.sample_type {
                    SampleType::F16 => copy(line, first, target, |b| f16::from_ne_bytes(b).to_f32()),
                    SampleType::F32 => copy(line, first, target, f32::from_ne_bytes),
                    SampleType::U32 => copy(line, first, target, |b| u32::from_ne_bytes(b) as f32),
                }
            }
        }
        Ok(())
    }

    fn finish(self, header: &Header, meta: &MetaData) -> Result<Image, BakeError> {
        let mut image = Image::named(self.width, self.height, self.names, Samples::F32(self.texels))?;
        let Vec2(width, height) = header.layer_size;
        if self.offset != [0, 0] || (width, height) != (image.width, image.height) {
            let [x, y] = self.offset;
            image.warnings.push(format!(
                "the EXR stores {width} x {height} pixels from ({x}, {y}) for an image of {} x {}: \
                 cut to the image, missing pixels are 0",
                image.width, image.height
            ));
        }
        if meta.headers.len() > 1 {
            let name = header.own_attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default();
            image.warnings.push(format!("the EXR has {} parts; part {name:?} is read", meta.headers.len()));
        }
        Ok(image)
    }
}

fn copy<'a, const N: usize>(
    line: &[u8],
    first: usize,
    target: impl Iterator<Item = &'a mut f32>,
    convert: impl Fn([u8; N]) -> f32,
) {
    let (samples, _) = line.as_chunks::<N>();
    for (target, sample) in target.zip(&samples[first..]) {
        *target = convert(*sample);
    }
}

/// Indices of the file's channels in the order in which the image has them.
fn channel_order(channels: &[ChannelDescription]) -> Vec<usize> {
    let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    // "layer.R" goes by its last part.
    let letter = |i: usize| names[i].rsplit('.').next().unwrap_or_default();
    let has = |wanted: &str| (0..names.len()).any(|i| letter(i) == wanted);
    let wanted: &[&str] = if has("R") && !has("Y") { &["R", "G", "B", "A"] } else { &["Y", "A"] };
    let mut order: Vec<usize> = (0..names.len()).collect();
    if has("R") || (names.len() == 2 && has("Y") && has("A")) {
        order.sort_by_key(|&i| wanted.iter().position(|&name| name == letter(i)).unwrap_or(wanted.len()));
    }
    order
}

fn explain(error: ExrError) -> BakeError {
    match error {
        ExrError::NotSupported(what) => unsupported(&what),
        ExrError::Invalid(what) => malformed(format!("invalid {what}")),
        other => malformed(other.to_string()),
    }
}

fn malformed(problem: String) -> BakeError {
    BakeError::Malformed { format: FORMAT, problem }
}

fn unsupported(feature: &str) -> BakeError {
    BakeError::Unsupported { format: FORMAT, feature: feature.to_owned() }
}
