//! Relief maps: normal and height in one texture.
//!
//! Red, green and blue hold the normal, alpha the height, as in Policarpo, Oliveira and Comba 2005,
//! "Real-time relief mapping on arbitrary polygonal surfaces". Alpha is the height itself (1 high),
//! not the depth of that paper.

use heightfield::{Extent, HeightField};

use crate::normal::Factors;
use crate::rows::for_each_row;
use crate::{BakeError, Convention, Kernel, Progress};

/// The relief map, `height * width * 4` floats: normal x, y, z in -1..1, height in 0..1.
///
/// # Errors
/// [`BakeError::HeightField`] for a senseless extent, [`BakeError::Interrupted`].
pub fn relief_map(
    field: &HeightField,
    extent: &Extent,
    kernel: Kernel,
    convention: Convention,
    mut progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let factors = Factors::new(field, extent, convention)?;
    let mut map = vec![0.0; field.width() * field.height() * 4];
    for_each_row(field, kernel, &mut map, &mut progress, |row, out, normal| {
        factors.normals(row, normal);
        let [nx, ny, nz] = normal;
        for ((((texel, x), y), z), h) in out.chunks_exact_mut(4).zip(nx).zip(ny).zip(nz).zip(row.heights) {
            texel[0] = *x;
            texel[1] = *y;
            texel[2] = *z;
            texel[3] = *h;
        }
    })?;
    Ok(map)
}
