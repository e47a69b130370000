//! Cells as what cones stand on: see the module above.

use super::super::exact::FLATTEST;
use super::super::grid::Grid;
use super::near::near_falling;
use super::packet::Apex;
use super::patch::{Patch, cuts, steepest};

/// A cell, named by its upper left texel.
#[derive(Clone, Copy)]
pub(super) struct Cell<'a> {
    pub grid: &'a Grid<'a>,
    /// Slopes of the texels' empty cones, and how many there are.
    pub empty: &'a [f32],
    pub size: [usize; 2],
}

impl Apex for Cell<'_> {
    const EXTENT: f32 = 1.0;
    const LID: bool = false;

    /// Enough are the steepest empty cones of the texels that the cell belongs to.
    fn start(self, [i, j]: [i64; 2], site: [i64; 2]) -> [f32; 2] {
        let [width, height] = self.size;
        let mut most = 0.0_f32;
        for y in j.max(0)..(j + 2).min(height as i64) {
            for x in i.max(0)..(i + 2).min(width as i64) {
                most = most.max(self.empty[y as usize * width + x as usize]);
            }
        }
        [if most > 0.0 { near_falling(self.grid, site).max(FLATTEST) } else { 0.0 }, most]
    }

    #[inline(always)]
    fn touches(offset: [i64; 2]) -> bool {
        offset[0].abs() <= 1 && offset[1].abs() <= 1
    }

    fn steepest(self, _: [i64; 2], own: [f32; 4], offset: [i64; 2], heights: [f32; 4], known: f64) -> f64 {
        let step = self.grid.step.map(f64::from);
        let at = |[i, j]: [i64; 2], heights: [f32; 4]| Patch {
            low: [i as f64 * step[0], j as f64 * step[1]],
            high: [(i + 1) as f64 * step[0], (j + 1) as f64 * step[1]],
            heights: heights.map(f64::from),
        };
        steepest(&at([0, 0], own), &at(offset, heights), cuts(offset), known)
    }
}
