//! Cells as what cones stand on: see the module above.

use heightfield::lanes::Lanes;

use super::super::exact::FLATTEST;
use super::super::exact::lattice::Lattice;
use super::super::grid::{Grid, Stack};
use super::near::near_falling;
use super::packet::Packet;
use super::patch::{self, Patch, cuts};
use super::{Apexes, Row};

/// Cells, each named by its upper left texel.
#[derive(Clone, Copy)]
pub(super) struct Cells<'a> {
    pub grid: &'a Grid<'a>,
    pub lattice: &'a Lattice,
    /// Slopes of the texels' empty cones, and how many there are.
    pub empty: &'a [f32],
    pub size: [usize; 2],
}

impl Apexes for Cells<'_> {
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
    fn raise<L: Lanes>(self, row: Row<'_>, stack: &mut Stack) {
        let [i, j] = row.texel;
        let heights = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[x, y]| self.lattice.from(i + x, j + y));
        let mut packet = Packet::<L>::new(self.grid, row.site, heights, row.slopes, row.enough);
        for (lane, &partner) in row.partners.iter().enumerate() {
            if let Some(partner) = partner {
                packet.seed(lane, partner);
            }
        }
        packet.search(stack);
        row.slopes.copy_from_slice(&packet.slopes[..L::WIDTH]);
        row.partners.copy_from_slice(&packet.partners[..L::WIDTH]);
    }
}

/// Whether the cell at this offset is so close that it is known beforehand.
#[inline(always)]
pub(super) fn touches(offset: [i64; 2]) -> bool {
    offset[0].abs() <= 1 && offset[1].abs() <= 1
}

/// The steepest rise from a cell with these corner heights to where the cell at `offset` with its own falls outwards, or
/// `known` if that is not less.
pub(super) fn steepest(
    grid: &Grid<'_>,
    own: [f32; 4],
    offset: [i64; 2],
    heights: [f32; 4],
    known: f64,
) -> f64 {
    let step = grid.step.map(f64::from);
    let at = |[i, j]: [i64; 2], heights: [f32; 4]| Patch {
        low: [i as f64 * step[0], j as f64 * step[1]],
        high: [(i + 1) as f64 * step[0], (j + 1) as f64 * step[1]],
        heights: heights.map(f64::from),
    };
    patch::steepest(&at([0, 0], own), &at(offset, heights), cuts(offset), known)
}
