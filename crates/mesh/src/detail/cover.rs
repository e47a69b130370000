//! Which chart each sample and each touched texel of a band belongs to.

use super::charts::Layout;
use super::raster::{NONE, Touch, Triangle, Window};
use crate::mesh::Mesh;

/// A band of texel rows with its owners.
#[derive(Debug)]
pub(super) struct Cover {
    /// The samples of the band.
    pub window: Window,
    /// A chart for each sample, or [`NONE`].
    pub owners: Vec<u32>,
    /// For texels without any owned sample, the chart that touches them; empty when there are none.
    pub touches: Vec<Touch>,
    /// Samples that more than one chart claims, counted for each but the first.
    pub overlapping: u64,
}

impl Cover {
    /// Rasterises the charts of band `index`, `rows` texel rows from row `first` on, `width` wide.
    pub(super) fn new(
        layout: &Layout,
        mesh: &Mesh,
        index: usize,
        first: usize,
        rows: usize,
        width: usize,
        grid: usize,
    ) -> Self {
        let window = Window { rows: first * grid..(first + rows) * grid, width: width * grid, grid };
        let mut owners = vec![NONE; rows * grid * window.width];
        let charts = layout.band(index);
        let mut overlapping = 0;
        let triangle = |at: u32| Triangle::new(layout.corners(mesh, &layout.charts[at as usize]));
        for &at in charts {
            let taken = window.cover(&triangle(at), at, &mut owners) as u64;
            // Charts moved in from other tiles take what is left, and make no claim on the rest.
            overlapping += if layout.charts[at as usize].is_inside() { taken } else { 0 };
        }
        let mut free = vec![true; rows * width];
        for (row, owners) in owners.chunks_exact(window.width).enumerate() {
            let free = &mut free[row / grid * width..][..width];
            for (free, owners) in free.iter_mut().zip(owners.chunks_exact(grid)) {
                *free &= owners.iter().all(|&owner| owner == NONE);
            }
        }
        let mut touches = Vec::new();
        if free.contains(&true) {
            touches = vec![Touch::NEVER; rows * width];
            let texels = Window { rows: first..first + rows, width, grid: 1 };
            charts.iter().for_each(|&at| texels.touch(&triangle(at), at, &free, &mut touches));
        }
        Self { window, owners, touches, overlapping }
    }

    /// The chart that touches a texel of the band.
    #[inline(always)]
    pub(super) fn touch(&self, texel: usize) -> Option<Touch> {
        self.touches.get(texel).copied().filter(|touch| touch.chart != NONE)
    }
}
