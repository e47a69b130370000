//! Rows of a NumPy array file.
//!
//! Format: the magic bytes, a version, the length of a header, the header (a Python dictionary with
//! the type, the order and the shape), then the numbers. Source: NEP 1.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use half::f16;

use super::source::{Numbers, Shape, Source, check_size, convert, reader};
use crate::BakeError;

const FORMAT: &str = "npy";

/// An open `.npy` file.
pub(super) struct Npy {
    path: PathBuf,
    file: BufReader<File>,
    shape: Shape,
    /// `"<f4"`: byte order, kind, bytes a number.
    kind: (u8, u8, usize),
    start: u64,
    row: Vec<u8>,
}

impl Npy {
    pub fn open(path: &Path) -> Result<Self, BakeError> {
        let io = |source| BakeError::Io { action: "read", path: path.to_owned(), source };
        let mut file = reader(path)?;
        let mut head = [0; 8];
        let short = |_| malformed("the header is cut off");
        file.read_exact(&mut head).map_err(short)?;
        let length = if head[6] == 1 {
            let mut bytes = [0; 2];
            file.read_exact(&mut bytes).map_err(short)?;
            u64::from(u16::from_le_bytes(bytes))
        } else {
            let mut bytes = [0; 4];
            file.read_exact(&mut bytes).map_err(short)?;
            u64::from(u32::from_le_bytes(bytes))
        };
        if !(1..=3).contains(&head[6]) || length > 1 << 16 {
            return Err(malformed("the header has an unknown version or an absurd length"));
        }
        let mut header = Vec::new();
        (&mut file).take(length).read_to_end(&mut header).map_err(io)?;
        if header.len() as u64 != length {
            return Err(malformed("the header is cut off"));
        }
        let start = file.stream_position().map_err(io)?;
        let header = String::from_utf8(header).map_err(|_| malformed("the header is no text"))?;
        let kind = kind(&field(&header, "descr")?)?;
        if field(&header, "fortran_order")?.starts_with("True") {
            return Err(unsupported("columns come one after another (fortran_order); save it in C order"));
        }
        let sides = shape(&field(&header, "shape")?)?;
        let (width, height, channels) = match *sides.as_slice() {
            [height, width] => (width, height, 1),
            [height, width, channels] => (width, height, channels),
            _ => return Err(unsupported(&format!("shape {sides:?}; (H, W) or (H, W, C) is read"))),
        };
        check_size(FORMAT, width, height, channels)?;
        let bytes = width as u128 * height as u128 * channels as u128 * kind.2 as u128;
        let found = file.get_ref().metadata().map_err(io)?.len().saturating_sub(start);
        if u128::from(found) < bytes {
            return Err(malformed(&format!("{bytes} bytes of numbers are announced, {found} are there")));
        }
        let numbers = match kind {
            (_, b'b', _) => Numbers::Bool,
            (_, b'u', 1) => Numbers::U8,
            (_, b'u', 2) => Numbers::U16,
            (_, b'f', _) => Numbers::Floats,
            _ => Numbers::Integers,
        };
        let shape =
            Shape { width: width as usize, height: height as usize, channels: channels as usize, numbers };
        let row = vec![0; shape.width * shape.channels * kind.2];
        Ok(Self { path: path.to_owned(), file, shape, kind, start, row })
    }
}

impl Source for Npy {
    fn shape(&self) -> Shape {
        self.shape
    }

    fn seek(&mut self, row: usize) -> Result<(), BakeError> {
        let offset = self.start + row as u64 * self.row.len() as u64;
        let io = |source| BakeError::Io { action: "read", path: self.path.clone(), source };
        self.file.seek(SeekFrom::Start(offset)).map(|_| ()).map_err(io)
    }

    fn next_row(&mut self, channel: usize, out: &mut [f64]) -> Result<(), BakeError> {
        let io = |source| BakeError::Io { action: "read", path: self.path.clone(), source };
        self.file.read_exact(&mut self.row).map_err(io)?;
        let (order, letter, size) = self.kind;
        let (bytes, stride) = (&self.row[channel * size..], size * self.shape.channels);
        if order == b'>' {
            // Reversed, a big-endian number is a little-endian one.
            self.row.chunks_exact_mut(size).for_each(<[u8]>::reverse);
            let bytes = &self.row[channel * size..];
            numbers(bytes, stride, letter, size, out);
        } else {
            numbers(bytes, stride, letter, size, out);
        }
        Ok(())
    }
}

fn numbers(bytes: &[u8], stride: usize, letter: u8, size: usize, out: &mut [f64]) {
    match (letter, size) {
        (b'b', _) => convert::<1>(bytes, stride, out, |b| f64::from(u8::from(b[0] != 0))),
        (b'u', 1) => convert::<1>(bytes, stride, out, |b| f64::from(b[0])),
        (b'u', 2) => convert(bytes, stride, out, |b| f64::from(u16::from_le_bytes(b))),
        (b'u', 4) => convert(bytes, stride, out, |b| f64::from(u32::from_le_bytes(b))),
        (b'u', _) => convert(bytes, stride, out, |b| u64::from_le_bytes(b) as f64),
        (b'i', 1) => convert::<1>(bytes, stride, out, |b| f64::from(b[0] as i8)),
        (b'i', 2) => convert(bytes, stride, out, |b| f64::from(i16::from_le_bytes(b))),
        (b'i', 4) => convert(bytes, stride, out, |b| f64::from(i32::from_le_bytes(b))),
        (b'i', _) => convert(bytes, stride, out, |b| i64::from_le_bytes(b) as f64),
        (_, 2) => convert(bytes, stride, out, |b| f16::from_le_bytes(b).to_f64()),
        (_, 4) => convert(bytes, stride, out, |b| f64::from(f32::from_le_bytes(b))),
        _ => convert(bytes, stride, out, f64::from_le_bytes),
    }
}

/// The text after a key of the header.
fn field(header: &str, key: &str) -> Result<String, BakeError> {
    let quoted = [format!("'{key}'"), format!("\"{key}\"")];
    let rest = quoted.iter().find_map(|quoted| header.split_once(quoted.as_str())).map(|pair| pair.1);
    let rest = rest.and_then(|rest| rest.trim_start().strip_prefix(':'));
    rest.map(|rest| rest.trim_start().to_owned())
        .ok_or_else(|| malformed(&format!("the header has no {key:?}")))
}

fn kind(text: &str) -> Result<(u8, u8, usize), BakeError> {
    let quote = text.chars().next().unwrap_or(' ');
    let name = text.trim_start_matches(quote).split(quote).next().unwrap_or_default();
    let other = || unsupported(&format!("numbers of type {name:?}"));
    let &[order, letter, ref size @ ..] = name.as_bytes() else { return Err(other()) };
    let size = std::str::from_utf8(size).ok().and_then(|size| size.parse().ok()).unwrap_or(0);
    let known = match letter {
        b'b' => size == 1,
        b'u' | b'i' => matches!(size, 1 | 2 | 4 | 8),
        b'f' => matches!(size, 2 | 4 | 8),
        _ => false,
    };
    let known = known && matches!(quote, '\'' | '"') && matches!(order, b'<' | b'>' | b'|' | b'=');
    known.then_some((order, letter, size)).ok_or_else(other)
}

fn shape(text: &str) -> Result<Vec<u64>, BakeError> {
    let inner = text.strip_prefix('(').and_then(|rest| rest.split_once(')')).map(|pair| pair.0);
    let sides = inner.map(|inner| inner.split(',').map(str::trim).filter(|side| !side.is_empty()));
    sides
        .and_then(|sides| sides.map(|side| side.parse().ok()).collect())
        .ok_or_else(|| malformed("the header has no shape"))
}

fn malformed(problem: &str) -> BakeError {
    BakeError::Malformed { format: FORMAT, problem: problem.to_owned() }
}

fn unsupported(feature: &str) -> BakeError {
    BakeError::Unsupported { format: FORMAT, feature: feature.to_owned() }
}
