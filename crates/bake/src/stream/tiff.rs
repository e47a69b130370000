//! Rows of a TIFF file, strip by strip or row of tiles by row of tiles.
//!
//! Compressed strips are decoded as a whole, so they may hold at most [`MAX_TEXELS`]; uncompressed
//! ones are read row by row where they lie.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::{ByteOrder, Tag};
use ::tiff::{ColorType, TiffError};
use half::f16;

use super::source::{Numbers, Shape, Source, check_size, convert, reader};
use crate::BakeError;

const FORMAT: &str = "TIFF";
/// Most samples decoded at a time.
const MAX_TEXELS: u64 = 1 << 24;

/// An open TIFF file.
pub(super) struct Tiff {
    path: PathBuf,
    decoder: Decoder<BufReader<File>>,
    shape: Shape,
    /// Texels of a strip or tile.
    chunk: [usize; 2],
    row: usize,
    /// The row of chunks that is decoded, and its samples, chunk by chunk.
    decoded: Option<usize>,
    samples: Vec<DecodingResult>,
    raw: Option<Raw>,
}

/// Uncompressed strips.
struct Raw {
    offsets: Vec<u64>,
    bytes: usize,
    little: bool,
    row: Vec<u8>,
}

impl Tiff {
    pub fn open(path: &Path) -> Result<Self, BakeError> {
        let mut decoder = Decoder::new(reader(path)?).map_err(|error| explain(path, error))?;
        let fail = |error| explain(path, error);
        let (width, height) = decoder.dimensions().map_err(fail)?;
        let color = decoder.colortype().map_err(fail)?;
        let bits = color.bit_depth();
        let channels = match color {
            ColorType::Gray(_)
            | ColorType::GrayA(_)
            | ColorType::RGB(_)
            | ColorType::RGBA(_)
            | ColorType::Multiband { .. }
                if matches!(bits, 8 | 16 | 32 | 64) =>
            {
                u64::from(color.num_samples())
            }
            _ => return Err(unsupported(format!("sample layout {color:?} read by rows"))),
        };
        check_size(FORMAT, width.into(), height.into(), channels)?;
        let tag = |decoder: &mut Decoder<_>, tag| {
            Ok::<_, BakeError>(decoder.find_tag_unsigned::<u64>(tag).map_err(fail)?.unwrap_or(1))
        };
        if channels > 1 && tag(&mut decoder, Tag::PlanarConfiguration)? == 2 {
            return Err(unsupported(
                "its channels lie in planes one behind the other, so that no row is in one place; save it with \
                 interleaved channels, or bake it as a whole"
                    .to_owned(),
            ));
        }
        let format = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(fail)?;
        let numbers = match (format.and_then(|format| format.first().copied()).unwrap_or(1), bits) {
            (1, 8) => Numbers::U8,
            (1, 16) => Numbers::U16,
            (3, _) => Numbers::Floats,
            _ => Numbers::Integers,
        };
        let (across, down) = decoder.chunk_dimensions();
        let down = down.clamp(1, height);
        let shape =
            Shape { width: width as usize, height: height as usize, channels: channels as usize, numbers };
        let large = u64::from(across.max(width)) * u64::from(down) * channels > MAX_TEXELS;
        let raw = large.then(|| Raw::find(&mut decoder, path, &shape, bits, down)).transpose()?;
        let mut limits = Limits::default();
        limits.decoding_buffer_size = MAX_TEXELS as usize * 8;
        limits.intermediate_buffer_size = MAX_TEXELS as usize * 8;
        Ok(Self {
            path: path.to_owned(),
            decoder: decoder.with_limits(limits),
            shape,
            chunk: [(across as usize).max(1), down as usize],
            row: 0,
            decoded: None,
            samples: Vec::new(),
            raw,
        })
    }

    fn decode(&mut self, band: usize) -> Result<(), BakeError> {
        let across = self.shape.width.div_ceil(self.chunk[0]);
        self.samples.clear();
        self.decoded = None;
        for chunk in band * across..(band + 1) * across {
            let index = u32::try_from(chunk).map_err(|_| unsupported("that many tiles".to_owned()))?;
            // The crate checks some sizes with assertions; should one fire, the file is at fault.
            let result = catch_unwind(AssertUnwindSafe(|| self.decoder.read_chunk(index)));
            let Ok(result) = result else { return Err(malformed("its sizes contradict each other")) };
            self.samples.push(result.map_err(|error| explain(&self.path, error))?);
        }
        self.decoded = Some(band);
        Ok(())
    }
}

impl Raw {
    fn find(
        decoder: &mut Decoder<BufReader<File>>,
        path: &Path,
        shape: &Shape,
        bits: u8,
        down: u32,
    ) -> Result<Self, BakeError> {
        let fail = |error| explain(path, error);
        let compression = decoder.find_tag_unsigned::<u64>(Tag::Compression).map_err(fail)?.unwrap_or(1);
        let offsets = decoder.find_tag_unsigned_vec::<u64>(Tag::StripOffsets).map_err(fail)?;
        let known =
            matches!((shape.numbers, bits), (Numbers::U8, 8) | (Numbers::U16, 16) | (Numbers::Floats, 32));
        match offsets {
            Some(offsets) if compression == 1 && known && offsets.len() * down as usize >= shape.height => {
                let bytes = usize::from(bits) / 8;
                let little = decoder.byte_order() == ByteOrder::LittleEndian;
                let row = vec![0; shape.width * shape.channels * bytes];
                Ok(Self { offsets, bytes, little, row })
            }
            _ => Err(unsupported(format!(
                "its strips or tiles are compressed {down} rows at a time, too many to decode at once; save it \
                 with fewer rows a strip, uncompressed, or bake it as a whole"
            ))),
        }
    }
}

impl Source for Tiff {
    fn shape(&self) -> Shape {
        self.shape
    }

    fn seek(&mut self, row: usize) -> Result<(), BakeError> {
        self.row = row;
        Ok(())
    }

    fn next_row(&mut self, channel: usize, out: &mut [f64]) -> Result<(), BakeError> {
        let (row, [across, down]) = (self.row, self.chunk);
        self.row += 1;
        let (band, inside) = (row / down, row % down);
        if let Some(raw) = &mut self.raw {
            let offset = raw.offsets[band] + (inside * raw.row.len()) as u64;
            let file = self.decoder.inner();
            let read = file.seek(SeekFrom::Start(offset)).and_then(|_| file.read_exact(&mut raw.row));
            read.map_err(|source| match source.kind() {
                std::io::ErrorKind::UnexpectedEof => malformed("it ends before its last row"),
                _ => BakeError::Io { action: "read", path: self.path.clone(), source },
            })?;
            let (bytes, stride) = (&raw.row[channel * raw.bytes..], raw.bytes * self.shape.channels);
            match (raw.bytes, raw.little) {
                (1, _) => convert::<1>(bytes, stride, out, |b| f64::from(b[0])),
                (2, true) => convert(bytes, stride, out, |b| f64::from(u16::from_le_bytes(b))),
                (2, false) => convert(bytes, stride, out, |b| f64::from(u16::from_be_bytes(b))),
                (_, true) => convert(bytes, stride, out, |b| f64::from(f32::from_le_bytes(b))),
                (_, false) => convert(bytes, stride, out, |b| f64::from(f32::from_be_bytes(b))),
            }
            return Ok(());
        }
        if self.decoded != Some(band) {
            self.decode(band)?;
        }
        let mut rest = out;
        for samples in &self.samples {
            let width = across.min(rest.len());
            let (part, after) = rest.split_at_mut(width);
            // A decoded chunk is cut to the picture.
            let start = inside * width * self.shape.channels + channel;
            copy(samples, start, self.shape.channels, part)
                .ok_or_else(|| malformed("a strip or tile is too short"))?;
            rest = after;
        }
        Ok(())
    }
}

/// Every `stride`-th number from `start` on.
fn copy(samples: &DecodingResult, start: usize, stride: usize, out: &mut [f64]) -> Option<()> {
    fn pick<T: Copy>(
        from: &[T],
        start: usize,
        stride: usize,
        out: &mut [f64],
        number: impl Fn(T) -> f64,
    ) -> Option<()> {
        let from = from.get(start..)?;
        if from.len() < (out.len() - 1) * stride + 1 {
            return None;
        }
        for (out, value) in out.iter_mut().zip(from.iter().step_by(stride)) {
            *out = number(*value);
        }
        Some(())
    }
    match samples {
        DecodingResult::U8(from) => pick(from, start, stride, out, f64::from),
        DecodingResult::U16(from) => pick(from, start, stride, out, f64::from),
        DecodingResult::U32(from) => pick(from, start, stride, out, f64::from),
        DecodingResult::U64(from) => pick(from, start, stride, out, |v| v as f64),
        DecodingResult::F16(from) => pick(from, start, stride, out, f16::to_f64),
        DecodingResult::F32(from) => pick(from, start, stride, out, f64::from),
        DecodingResult::F64(from) => pick(from, start, stride, out, |v| v),
        DecodingResult::I8(from) => pick(from, start, stride, out, f64::from),
        DecodingResult::I16(from) => pick(from, start, stride, out, f64::from),
        DecodingResult::I32(from) => pick(from, start, stride, out, f64::from),
        DecodingResult::I64(from) => pick(from, start, stride, out, |v| v as f64),
    }
}

fn explain(path: &Path, error: TiffError) -> BakeError {
    match error {
        TiffError::UnsupportedError(what) => unsupported(what.to_string()),
        TiffError::LimitsExceeded => unsupported("strips or tiles that large".to_owned()),
        TiffError::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            BakeError::Io { action: "read", path: path.to_owned(), source }
        }
        other => malformed(&other.to_string()),
    }
}

fn malformed(problem: &str) -> BakeError {
    BakeError::Malformed { format: FORMAT, problem: problem.to_owned() }
}

fn unsupported(feature: String) -> BakeError {
    BakeError::Unsupported { format: FORMAT, feature }
}
