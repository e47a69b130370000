//! Distance maps: how far the surface is, at least, from anywhere in a voxel of the relief's slab.
//!
//! Slice `k` of `n` holds the voxels with heights from `k / n` to `(k + 1) / n`, one under each texel:
//! texel `(i, j)` of it covers `u` from `i / W` to `(i + 1) / W`, and `v` alike. A value is in mesh units
//! (`tile_size` along `u` and `v`, `scale` along the height) and a **lower bound**: no point of the
//! bilinear surface, and none below it, is nearer to any point of the voxel. So a value read without
//! filtering (nearest texel, nearest slice) is a safe step from wherever in the voxel a ray is. Filtered
//! values are not: half a voxel farther on the bound is another one.
//!
//! The proof: below the highest point `m` of the surface over a texel's footprint nothing is assumed to be
//! free. So solid are boxes, one a texel; the distance between voxel and box is exact, axis by axis
//! `max(0, |di| - 1)` texels sideways and `max(0, k / n - m)` upwards, and rounding is downwards.
//!
//! William Donnelly, Per-Pixel Displacement Mapping with Distance Functions, GPU Gems 2, chapter 8, 2005,
//! whose map takes the distance from the voxel's centre to the nearest texel, and is no bound. Pedro
//! Felzenszwalb and Daniel Huttenlocher, Distance Transforms of Sampled Functions, Theory of Computing 8,
//! 2012: one pass along each axis, linear in voxels.

mod transform;

use heightfield::{HeightField, Wrap};
use rayon::prelude::*;

use crate::encode::Rounding;
use crate::maps::{Channel, Form, Grid, Kind, Layer, Map, MapInfo, MapOption, Plan};
use crate::sweep::transposed;
use crate::{BakeError, Progress};

use transform::{Transform, transform_rows};

/// Most slices of a map.
pub const MAX_DEPTH: usize = 1024;
/// What rounding may have added to a distance, relative to it.
const ROUNDING: f32 = 2e-6;

/// Distances, one slice a height.
pub static DISTANCE: Map = Map {
    info: MapInfo {
        name: "distance",
        summary: "least distance from anywhere in a voxel to the surface, mesh units, one slice a height",
        source: "Donnelly 2005; Felzenszwalb and Huttenlocher 2012",
        version: 1,
        costly: true,
        form: Form::Stack { axis: "height" },
        channels: &[Channel::found("distance", Rounding::Down)],
        options: &[MapOption {
            name: "depth",
            summary: "slices between the lowest and the highest height",
            kind: Kind::Whole { default: 32, min: 1, max: MAX_DEPTH as i64 },
        }],
    },
    plan: |grid, options| Plan::stack(grid, options.whole("depth") as usize).working(working_bytes(grid)),
    bake: |field, options, progress| {
        let depth = options.whole("depth") as usize;
        let texels = distance_map(field, depth, progress)?;
        Ok(vec![Layer { width: field.width(), height: field.height(), depth, texels }])
    },
};

/// Bytes needed besides the map: maxima, and a turned slice for each thread.
fn working_bytes(grid: Grid) -> u128 {
    let slices = 2 + rayon::current_num_threads() as u128;
    slices * grid.texels() * size_of::<f32>() as u128
}

/// The distance map: `depth` slices of `height * width` distances in mesh units, lowest slice first.
///
/// # Errors
/// [`BakeError::Option`] for a depth out of 1..[`MAX_DEPTH`], [`BakeError::Interrupted`].
pub fn distance_map(
    field: &HeightField,
    depth: usize,
    mut progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    if !(1..=MAX_DEPTH).contains(&depth) {
        let problem = format!("must be a whole number in 1..{MAX_DEPTH}, got {depth}");
        return Err(BakeError::Option { map: DISTANCE.info.name, option: "depth".to_owned(), problem });
    }
    let (width, height) = (field.width(), field.height());
    let extent = field.extent();
    let cyclic = field.wrap() == Wrap::Repeat;
    let along_x = Transform::new(width, extent.tile_size[0] / width as f32, cyclic);
    let along_y = Transform::new(height, extent.tile_size[1] / height as f32, cyclic);
    let tops = tops(field);
    let mut map = vec![0.0_f32; depth * height * width];
    progress.report(0, height)?;
    let batch = rayon::current_num_threads();
    for (at, slices) in map.chunks_mut(batch * height * width).enumerate() {
        slices.par_chunks_mut(height * width).enumerate().for_each(|(k, slice)| {
            let floor = (at * batch + k) as f32 / depth as f32;
            for (square, &top) in slice.iter_mut().zip(&tops) {
                let up = (floor - top).max(0.0) * extent.scale;
                *square = up * up;
            }
            transform_rows(&along_x, slice);
            let mut turned = transposed(slice, width, height);
            transform_rows(&along_y, &mut turned);
            slice.copy_from_slice(&transposed(&turned, height, width));
            for square in slice {
                *square = square.sqrt() * (1.0 - ROUNDING);
            }
        });
        progress.report(height * ((at + 1) * batch).min(depth) / depth, height)?;
    }
    Ok(map)
}

/// The highest point of the bilinear surface over the footprints of each texel and its eight neighbours:
/// a voxel is nowhere nearer to the next footprint but one than that one's neighbour is.
fn tops(field: &HeightField) -> Vec<f32> {
    let (w, h, wrap) = (field.width() as i64, field.height() as i64, field.wrap());
    // Over a footprint the surface is bilinear in each quarter: its corners are the texel's centre, the
    // middles between it and its neighbours, and the middles of its four cells.
    let highest = |i: i64, j: i64| {
        let around = |dx: i64, dy: i64| {
            let [a, b] = [field.texel(i, j), field.texel(i + dx, j)];
            let [c, d] = [field.texel(i, j + dy), field.texel(i + dx, j + dy)];
            let middle = 0.25 * ((a + b) + (c + d));
            (0.5 * (a + b)).max(0.5 * (a + c)).max(middle)
        };
        let sides = [(-1, -1), (1, -1), (-1, 1), (1, 1)];
        sides.into_iter().map(|(dx, dy)| around(dx, dy)).fold(field.texel(i, j), f32::max)
    };
    let mut own = vec![0.0; (w * h) as usize];
    own.par_chunks_mut(w as usize).enumerate().for_each(|(j, row)| {
        row.iter_mut().enumerate().for_each(|(i, top)| *top = highest(i as i64, j as i64));
    });
    let mut tops = vec![0.0_f32; own.len()];
    tops.par_chunks_mut(w as usize).enumerate().for_each(|(j, row)| {
        for dy in [-1, 0, 1] {
            let from = &own[wrap.index(j as i64 + dy, h as usize) * w as usize..][..w as usize];
            for (i, top) in row.iter_mut().enumerate() {
                let side = |dx: i64| from[wrap.index(i as i64 + dx, w as usize)];
                *top = top.max(side(-1)).max(from[i]).max(side(1));
            }
        }
    });
    // Sums are rounded.
    tops.par_iter_mut().for_each(|top| *top *= 1.0 + 4.0 * f32::EPSILON);
    tops
}
