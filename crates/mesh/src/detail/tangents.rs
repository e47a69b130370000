//! The tangent frame of a mesh as a map.

use super::charts::Layout;
use super::cover::Cover;
use super::ground::Ground;
use super::options::check_side;
use super::raster::{NONE, Triangle};
use super::{check_coordinates, padding, place_for};
use crate::error::MeshError;
use crate::mesh::Mesh;
use rayon::prelude::*;

/// Texel rows of a band.
const ROWS: usize = 16;
/// Bands between two progress reports.
const BATCH: usize = 64;

/// The tangents of a mesh at each texel: `height * width * 4` floats, the unit tangent in the space of
/// the mesh and `w`, +1 or -1, as in glTF: `w (N x T)` points up the image.
///
/// Charts are grown by `padding` texels; what they do not reach is 0. `progress` gets
/// `(done, total)` in rows and answers whether to go on.
///
/// # Errors
/// [`MeshError::Parameter`] for a size out of range, [`MeshError::TooLarge`],
/// [`MeshError::Arrays`] for coordinates beyond 1e15, [`MeshError::Interrupted`].
pub fn tangent_map(
    mesh: &Mesh,
    width: usize,
    height: usize,
    padding: usize,
    progress: &mut dyn FnMut(usize, usize) -> bool,
) -> Result<Vec<f32>, MeshError> {
    check_side("width", width)?;
    check_side("height", height)?;
    check_coordinates("mesh", mesh)?;
    let texels = width * height;
    let mut map = place_for(texels * 4, 0.0_f32)?;
    let mut covered = place_for(texels, false)?;
    let layout = Layout::new(mesh, width, height, ROWS)?;
    let ground = Ground { mesh, cage: None, front: 0.0, rear: 0.0, slack: 0.0 };
    for (batch, (map, covered)) in
        map.chunks_mut(BATCH * ROWS * width * 4).zip(covered.chunks_mut(BATCH * ROWS * width)).enumerate()
    {
        if !progress((batch * BATCH * ROWS).min(height), height) {
            return Err(MeshError::Interrupted);
        }
        let bands = map.par_chunks_mut(ROWS * width * 4).zip(covered.par_chunks_mut(ROWS * width));
        bands.enumerate().for_each(|(band, (map, covered))| {
            let index = batch * BATCH + band;
            let cover = Cover::new(&layout, mesh, index, index * ROWS, covered.len() / width, width, 1);
            for (at, (texel, covered)) in map.chunks_exact_mut(4).zip(covered).enumerate() {
                let touch = cover.touch(at);
                let centre = cover.window.centre(at / width, at % width);
                let (chart, point) = match (cover.owners[at], touch) {
                    (NONE, None) => continue,
                    (NONE, Some(touch)) => (touch.chart, touch.point),
                    (owner, _) => (owner, centre),
                };
                let chart = &layout.charts[chart as usize];
                let triangle = Triangle::new(layout.corners(mesh, chart));
                let (spot, _) = ground.spot(&ground.facet(chart.triangle), triangle.weights(point));
                *covered = true;
                let tangent = spot.tangent.normalize_or_zero();
                texel.copy_from_slice(&tangent.extend(spot.w).to_array());
            }
        });
    }
    padding::fill(&mut map, 4, &padding::sources(&covered, width, padding));
    if progress(height, height) { Ok(map) } else { Err(MeshError::Interrupted) }
}
