//! Sizes beyond which a mesh is refused rather than left to exhaust the machine.

use crate::error::MeshError;

/// Most vertices in one mesh, and most triangles.
pub const MAX_ELEMENTS: usize = 1 << 25;

/// Most bytes in one mesh file or in one of the buffers it names.
pub const MAX_FILE_BYTES: u64 = 4 << 30;

/// Most bytes in one material library.
pub const MAX_MTL_BYTES: u64 = 64 << 20;

/// Most material libraries one OBJ may name.
pub const MAX_LIBRARIES: usize = 64;

/// Most bytes of images carried inside one glTF file.
pub const MAX_IMAGE_BYTES: u64 = 1 << 30;

/// Longest name kept, in characters. Each part carries its name, and one long name can be given to
/// a million parts.
const MAX_NAME: usize = 256;

/// A name, cut to a sensible length.
pub(crate) fn name(text: &str) -> &str {
    text.char_indices().nth(MAX_NAME).map_or(text, |(at, _)| &text[..at])
}

/// Fails when `got` is above [`MAX_ELEMENTS`].
pub(crate) fn check_elements(what: &str, got: usize) -> Result<(), MeshError> {
    if got > MAX_ELEMENTS {
        return Err(MeshError::TooLarge {
            what: what.to_owned(),
            got: got as u64,
            limit: MAX_ELEMENTS as u64,
        });
    }
    Ok(())
}
