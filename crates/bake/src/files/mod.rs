//! Reading and writing image files.
//!
//! Every reader checks the size that the header claims before it allocates, decodes only from
//! memory, and answers hostile bytes with a [`BakeError`]. What a file *is* follows from its first
//! bytes, not from its name; only TGA, which has no mark, is known by its suffix.
//!
//! | format | samples |
//! |---|---|
//! | PNG | 1 to 8 bits as `U8`, 16 as `U16`; palettes become RGB, transparency an alpha channel |
//! | TIFF | see the `tiff` reader: integers, floats, strips, tiles, planes |
//! | EXR | `F32` under the channels' own names |
//! | JPEG, WebP, BMP, TGA | `U8` |
//!
//! Numbers are never converted by a colour profile: a height is what is stored. A profile, or a
//! lossy format, leaves a line in [`Image::warnings`].

mod exr;
mod guard;
mod marks;
mod raster;
pub(crate) mod replace;
mod tiff;
mod write;

use std::fs;
use std::path::Path;

use ::image::ImageFormat;

use crate::{BakeError, Image};
pub use write::{WriteOptions, write_image, write_image_unless_stopped, write_image_with};

/// First bytes of an EXR file.
const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Reads an image file.
///
/// # Errors
/// [`BakeError::Io`] when the file cannot be read; [`BakeError::File`] around what
/// [`decode_image`] says about its content.
pub fn read_image(path: &Path) -> Result<Image, BakeError> {
    let io = |source| BakeError::Io { action: "read", path: path.to_owned(), source };
    // Devices and pipes may never end.
    if !fs::metadata(path).map_err(io)?.is_file() {
        return Err(io(std::io::Error::new(std::io::ErrorKind::InvalidInput, "not a regular file")));
    }
    let bytes = fs::read(path).map_err(io)?;
    let is_tga = path.extension().is_some_and(|suffix| suffix.eq_ignore_ascii_case("tga"));
    let image = match decode_image(&bytes) {
        Err(BakeError::UnknownFormat { .. }) if is_tga => raster::decode(&bytes, ImageFormat::Tga),
        other => other,
    };
    image.map_err(|source| BakeError::File { path: path.to_owned(), source: Box::new(source) })
}

/// Decodes an image file held in memory.
///
/// # Errors
/// [`BakeError::UnknownFormat`], [`BakeError::Malformed`], [`BakeError::Unsupported`],
/// [`BakeError::TooLarge`].
pub fn decode_image(bytes: &[u8]) -> Result<Image, BakeError> {
    if bytes.starts_with(&EXR_MAGIC) {
        return exr::decode(bytes);
    }
    // BigTIFF has 43 where TIFF has 42.
    if bytes.starts_with(b"II+\0") || bytes.starts_with(b"MM\0+") {
        return tiff::decode(bytes);
    }
    match ::image::guess_format(bytes) {
        Ok(ImageFormat::Tiff) => tiff::decode(bytes),
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP | ImageFormat::Bmp)) => {
            raster::decode(bytes, format)
        }
        Ok(other) => Err(BakeError::UnknownFormat { found: format!("{other:?}") }),
        Err(_) if bytes.is_empty() => Err(BakeError::UnknownFormat { found: "an empty file".to_owned() }),
        Err(_) => {
            let start: Vec<String> = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            Err(BakeError::UnknownFormat { found: format!("bytes {}", start.join(" ")) })
        }
    }
}
