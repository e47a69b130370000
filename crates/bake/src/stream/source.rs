//! What a file that is read by rows has to answer.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::{npy, png, tiff};
use crate::BakeError;

/// What the numbers of a file are, and so what they mean when nothing is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Numbers {
    /// 0..255 mean 0..1.
    U8,
    /// 0..65535 mean 0..1.
    U16,
    /// False and true.
    Bool,
    /// Integers without a meaning of their own.
    Integers,
    /// Floats, 0..1.
    Floats,
}

/// Size and kind of the numbers in a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    pub width: usize,
    pub height: usize,
    pub channels: usize,
    pub numbers: Numbers,
}

/// A file of rows.
pub(super) trait Source: Send {
    /// What is in it.
    fn shape(&self) -> Shape;

    /// Makes `row` the next one. Going back may mean to start again.
    fn seek(&mut self, row: usize) -> Result<(), BakeError>;

    /// One channel of the next row, in the units of the data.
    fn next_row(&mut self, channel: usize, out: &mut [f64]) -> Result<(), BakeError>;
}

/// Opens a file by its first bytes.
pub(super) fn open(path: &Path) -> Result<Box<dyn Source>, BakeError> {
    let io = |source| BakeError::Io { action: "read", path: path.to_owned(), source };
    if !std::fs::metadata(path).map_err(io)?.is_file() {
        return Err(io(std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a regular file")));
    }
    let mut magic = Vec::new();
    File::open(path).map_err(io)?.take(8).read_to_end(&mut magic).map_err(io)?;
    match magic.as_slice() {
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => Ok(Box::new(npy::Npy::open(path)?)),
        [0x89, b'P', b'N', b'G', ..] => Ok(Box::new(png::Png::open(path)?)),
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Ok(Box::new(tiff::Tiff::open(path)?)),
        _ => Err(BakeError::Unsupported {
            format: "image",
            feature: "reading by rows is for npy, PNG and TIFF; bake others as a whole".to_owned(),
        }),
    }
}

/// A buffered file.
pub(super) fn reader(path: &Path) -> Result<BufReader<File>, BakeError> {
    let file = File::open(path);
    let io = |source| BakeError::Io { action: "read", path: path.to_owned(), source };
    Ok(BufReader::with_capacity(1 << 18, file.map_err(io)?))
}

/// Checks sides and channels before anything is allocated for them.
pub(super) fn check_size(
    format: &'static str,
    width: u64,
    height: u64,
    channels: u64,
) -> Result<(), BakeError> {
    let max = heightfield::field::MAX_SIDE as u64;
    if width == 0 || height == 0 || channels == 0 {
        let problem = format!("the image is {width} x {height} texels x {channels} samples");
        return Err(BakeError::Malformed { format, problem });
    }
    if width > max || height > max || channels > 64 {
        let feature = format!("{width} x {height} texels x {channels} samples; at most {max} a side and 64");
        return Err(BakeError::Unsupported { format, feature });
    }
    Ok(())
}

/// Numbers of `N` bytes, each `stride` bytes after the last, as `f64`.
pub(super) fn convert<const N: usize>(
    bytes: &[u8],
    stride: usize,
    out: &mut [f64],
    number: impl Fn([u8; N]) -> f64,
) {
    for (out, sample) in out.iter_mut().zip(bytes.chunks(stride)) {
        if let Some(sample) = sample.first_chunk::<N>() {
            *out = number(*sample);
        }
    }
}
