//! Sizes beyond which a mesh is refused rather than left to exhaust the machine.

use crate::error::MeshError;

/// Most vertices in one mesh, and most triangles.
pub const MAX_ELEMENTS: usize = 1 << 25;

/// Most bytes in one mesh file or in one of the buffers it names.
pub const MAX_FILE_BYTES: u64 = 4 << 30;

/// Most bytes in one material library.
pub const MAX_MTL_BYTES: u64 = 64 << 20;

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
