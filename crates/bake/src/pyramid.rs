//! Min/max pyramids: the lowest and highest point of ever larger blocks of the surface.
//!
//! Level 0 has one node for each *cell*, the bilinear patch between four texel centres, and bounds
//! it by its four corners; a plain 2 x 2 reduction of texels would miss the surface between them.
//! Node `(a, b)` of level `k` covers cells `a * 2^k` to `min((a + 1) * 2^k, cells)`, so any size
//! works, down to one node. A repeating map has as many cells as texels; see
//! `heightfield::HeightField` for the others. Source: Tevs, Ihrke, Seidel 2008, "Maximum mipmaps
//! for fast, accurate, and scalable dynamic height field rendering".

use heightfield::HeightField;
use rayon::prelude::*;

use crate::encode::Range;
use crate::maps::{Channel, Form, Layer, Map, MapInfo, Plan};
use crate::{BakeError, Progress};

/// Lowest and highest point of blocks, in levels.
pub static PYRAMID: Map = Map {
    info: MapInfo {
        name: "pyramid",
        summary: "lowest and highest height of ever larger blocks, in levels",
        source: "Tevs, Ihrke, Seidel 2008",
        version: 1,
        costly: false,
        form: Form::Levels,
        channels: &[Channel::fixed("low", Range::LOWER_BOUND), Channel::fixed("high", Range::UPPER_BOUND)],
        options: &[],
    },
    plan: |grid, _| Plan::levels(grid.cells()),
    bake: |field, _, progress| {
        let layer = |level: Level| Layer::flat(level.width, level.height, level.min_max);
        Ok(pyramid(field, progress)?.into_iter().map(layer).collect())
    },
};

/// One level of a pyramid.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Nodes across.
    pub width: usize,
    /// Nodes down.
    pub height: usize,
    /// Lowest and highest height under each node, interleaved: `height * width * 2` floats.
    pub min_max: Vec<f32>,
}

/// All levels of the min/max pyramid, finest first.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn pyramid(field: &HeightField, mut progress: Progress<'_>) -> Result<Vec<Level>, BakeError> {
    let [width, height] = field.cells();
    progress.report(0, height)?;
    let mut levels = vec![finest(field)];
    while let Some(below) = levels.last().filter(|level| (level.width, level.height) != (1, 1)) {
        // Half of the work that is left is in the next level: count rows of the finest one.
        progress.report(height - below.height.div_ceil(2).min(height), height)?;
        let next = reduce(below);
        levels.push(next);
    }
    debug_assert_eq!((levels[0].width, levels[0].height), (width, height));
    progress.report(height, height)?;
    Ok(levels)
}

fn finest(field: &HeightField) -> Level {
    let [width, height] = field.cells();
    let corners = field.corners();
    let stride = width + 1;
    let mut min_max = vec![0.0_f32; width * height * 2];
    min_max.par_chunks_mut(2 * width).enumerate().for_each(|(j, row)| {
        let upper = &corners[j * stride..][..stride];
        let lower = &corners[(j + 1) * stride..][..stride];
        for (i, node) in row.chunks_exact_mut(2).enumerate() {
            node[0] = upper[i].min(upper[i + 1]).min(lower[i].min(lower[i + 1]));
            node[1] = upper[i].max(upper[i + 1]).max(lower[i].max(lower[i + 1]));
        }
    });
    Level { width, height, min_max }
}

fn reduce(below: &Level) -> Level {
    let (width, height) = (below.width.div_ceil(2), below.height.div_ceil(2));
    let mut min_max = vec![0.0_f32; width * height * 2];
    min_max.par_chunks_mut(2 * width).enumerate().for_each(|(b, row)| {
        let source = |j: usize| &below.min_max[j * 2 * below.width..][..2 * below.width];
        let upper = source(2 * b);
        let lower = source((2 * b + 1).min(below.height - 1));
        for (a, node) in row.chunks_exact_mut(2).enumerate() {
            // The last node of an odd row covers a single column: it meets that column twice.
            let (left, right) = (4 * a, 2 * (2 * a + 1).min(below.width - 1));
            node[0] = upper[left].min(upper[right]).min(lower[left].min(lower[right]));
            node[1] = upper[left + 1].max(upper[right + 1]).max(lower[left + 1].max(lower[right + 1]));
        }
    });
    Level { width, height, min_max }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heightfield::Wrap;

    #[test]
    fn bounds_hold_for_the_surface_and_agree_with_the_search_pyramid() {
        for (w, h) in [(1, 1), (1, 9), (7, 5), (16, 16), (33, 2)] {
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                let texels: Vec<f32> = (0..w * h).map(|i| ((i * 7919) % 101) as f32 / 101.0).collect();
                let field = HeightField::new(&texels, w, h, wrap).unwrap();
                let negated: Vec<f32> = texels.iter().map(|h| 1.0 - h).collect();
                let negated = HeightField::new(&negated, w, h, wrap).unwrap();
                let levels = pyramid(&field, Progress::none()).unwrap();
                assert_eq!(levels.len(), field.pyramid().levels().len());
                for (k, level) in levels.iter().enumerate() {
                    for (at, node) in level.min_max.chunks_exact(2).enumerate() {
                        let (a, b) = (at % level.width, at / level.width);
                        assert_eq!(node[1], field.pyramid().at(k, a, b));
                        assert!((node[0] - (1.0 - negated.pyramid().at(k, a, b))).abs() < 1e-7);
                    }
                }
                let last = levels.last().unwrap();
                assert_eq!((last.width, last.height), (1, 1));
            }
        }
    }

    #[test]
    fn it_can_be_stopped() {
        let field = HeightField::new(&[0.5; 64], 8, 8, Wrap::Repeat).unwrap();
        let mut stop = |_: usize, _: usize| false;
        assert!(matches!(pyramid(&field, Progress::new(&mut stop)), Err(BakeError::Interrupted)));
    }
}
