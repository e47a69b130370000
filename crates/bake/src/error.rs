//! What can go wrong between a file and a map.

use std::io;
use std::path::PathBuf;

use heightfield::HeightFieldError;
use thiserror::Error;

/// Errors of this crate. The messages say what, where, what was expected and what was found.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The system could not open, read or write the file. `source.kind()` tells a missing file
    /// from a forbidden one.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// `"read"` or `"write"`.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The content of a file is not usable; `source` says why.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<BakeError>,
    },
    /// The bytes are no image, or one of a kind that is not read.
    #[error("not an image of a known format (PNG, TIFF, EXR, JPEG, WebP, BMP, TGA): {found}")]
    UnknownFormat {
        /// What was found instead.
        found: String,
    },
    /// The file is broken: truncated, corrupt or self-contradicting.
    #[error("broken {format} file: {problem}")]
    Malformed {
        /// Format name.
        format: &'static str,
        /// What the decoder found.
        problem: String,
    },
    /// The file may be fine, but this crate does not read that variety.
    #[error("{format} variety not supported: {feature}")]
    Unsupported {
        /// Format name.
        format: &'static str,
        /// The variety.
        feature: String,
    },
    /// The image is larger than what is accepted or what fits into memory.
    #[error("image of {width} x {height} texels x {channels} samples needs {bytes} bytes; {limit}")]
    TooLarge {
        /// Texels across.
        width: u64,
        /// Texels down.
        height: u64,
        /// Samples a texel.
        channels: u64,
        /// Bytes needed once decoded.
        bytes: u128,
        /// Which limit is exceeded.
        limit: String,
    },
    /// Size and number of samples of an image do not agree.
    #[error("image of {width} x {height} texels x {channels} channels cannot have {got} samples")]
    Shape {
        /// Texels across.
        width: usize,
        /// Texels down.
        height: usize,
        /// Samples a texel.
        channels: usize,
        /// Samples given.
        got: usize,
    },
    /// The image cannot be stored in that file format.
    #[error("cannot write {what} as {format}: {problem}")]
    Unwritable {
        /// What was to be written.
        what: String,
        /// Format name, or the file's suffix.
        format: String,
        /// Why not, and what would work.
        problem: String,
    },
    /// No map, kernel or convention of that name.
    #[error("unknown {what} {name:?}; known: {known}")]
    UnknownName {
        /// What kind of name.
        what: &'static str,
        /// The name asked for.
        name: String,
        /// All names, comma separated.
        known: String,
    },
    /// A map does not take that option, or the option not that value.
    #[error("map {map:?}, option {option:?}: {problem}")]
    Option {
        /// Name of the map.
        map: &'static str,
        /// Name of the option.
        option: String,
        /// What is wrong, and what is taken.
        problem: String,
    },
    /// Heights of a file that is read by rows make no sense, or a map cannot be made by rows.
    #[error("{problem}")]
    Stream {
        /// What is wrong, where, and what would work.
        problem: String,
    },
    /// A map would not fit into memory; nothing was allocated.
    #[error("{what} needs {bytes} bytes; {available} bytes of memory are available")]
    Memory {
        /// Which map, and its size.
        what: String,
        /// Bytes needed.
        bytes: u128,
        /// Bytes that can be had.
        available: u128,
    },
    /// The height field or its extent makes no sense.
    #[error(transparent)]
    HeightField(#[from] HeightFieldError),
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
}
