//! The plain mesh's triangles laid out on the map, and which of them meet which rows.

use std::ops::Range;

use glam::DVec2;

use crate::error::MeshError;
use crate::mesh::Mesh;

/// Charts may end this far beyond a tile's edge, in UV units, and still lie inside: exporters round.
const LOOSE: f64 = 1e-5;
/// Tiles one triangle may reach into.
const MAX_TILES: f64 = 64.0;
/// Entries of all bands together: 4 GiB.
const MAX_ENTRIES: u64 = 1 << 30;

/// A triangle in one tile of the texture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chart {
    /// Row of the plain mesh's indices.
    pub triangle: u32,
    /// Tile that is moved onto 0..1.
    tile: [i32; 2],
}

impl Chart {
    /// Whether it is where its UVs are, and not moved in from another tile.
    pub(super) fn is_inside(&self) -> bool {
        self.tile == [0, 0]
    }
}

/// All charts, those within 0..1 first, and the bands of rows they meet.
#[derive(Debug)]
pub(super) struct Layout {
    pub charts: Vec<Chart>,
    /// Indices into `charts`, band by band, ascending within a band.
    entries: Vec<u32>,
    /// Where each band's entries begin, and the end.
    starts: Vec<usize>,
    size: DVec2,
    /// Triangles whose UVs enclose no area.
    pub degenerate: usize,
    /// Triangles that reach beyond 0..1.
    pub wrapped: usize,
    /// Triangles left out because they repeat the texture too often.
    pub endless: usize,
}

impl Layout {
    /// Lays out a mesh on `width` x `height` texels, in bands of `rows`.
    pub(super) fn new(mesh: &Mesh, width: usize, height: usize, rows: usize) -> Result<Self, MeshError> {
        let mut layout = Self {
            charts: Vec::with_capacity(mesh.indices.len()),
            entries: Vec::new(),
            starts: Vec::new(),
            size: DVec2::new(width as f64, height as f64),
            degenerate: 0,
            wrapped: 0,
            endless: 0,
        };
        let mut beyond = Vec::new();
        for (triangle, corners) in mesh.indices.iter().enumerate() {
            layout.place(triangle as u32, corners.map(|i| mesh.uvs[i as usize].as_dvec2()), &mut beyond);
        }
        layout.charts.append(&mut beyond);
        layout.sort_into_bands(mesh, height, rows)?;
        Ok(layout)
    }

    fn place(&mut self, triangle: u32, uvs: [DVec2; 3], beyond: &mut Vec<Chart>) {
        if (uvs[1] - uvs[0]).perp_dot(uvs[2] - uvs[0]) == 0.0 {
            self.degenerate += 1;
            return;
        }
        let (low, high) = (uvs[0].min(uvs[1]).min(uvs[2]), uvs[0].max(uvs[1]).max(uvs[2]));
        let first = (low + LOOSE).floor();
        let last = ((high - LOOSE).ceil() - 1.0).max(first);
        let tiles = last - first + 1.0;
        if tiles.x * tiles.y > MAX_TILES || first.abs().max(last.abs()).max_element() > 1e9 {
            self.endless += 1;
            return;
        }
        let (first, last) = (first.as_ivec2(), last.as_ivec2());
        let mut outside = false;
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                let chart = Chart { triangle, tile: [x, y] };
                if chart.is_inside() {
                    self.charts.push(chart);
                } else {
                    beyond.push(chart);
                    outside = true;
                }
            }
        }
        self.wrapped += usize::from(outside);
    }

    fn sort_into_bands(&mut self, mesh: &Mesh, height: usize, rows: usize) -> Result<(), MeshError> {
        let bands = height.div_ceil(rows);
        let mut counts = vec![0u64; bands];
        // One more texel on either side: texels that are only touched count too.
        let reach = |chart: &Chart| -> Range<usize> {
            let y = self.corners(mesh, chart).map(|p| p.y);
            let (low, high) = (y[0].min(y[1]).min(y[2]) - 1.0, y[0].max(y[1]).max(y[2]) + 1.0);
            let band = |y: f64| (y.clamp(0.0, height as f64 - 1.0) as usize) / rows;
            if high < 0.0 || low > height as f64 { 0..0 } else { band(low)..band(high) + 1 }
        };
        for chart in &self.charts {
            reach(chart).for_each(|band| counts[band] += 1);
        }
        let total: u64 = counts.iter().sum();
        if total > MAX_ENTRIES {
            let what = "triangles of the plain mesh, counted once for each band of rows they meet".to_owned();
            return Err(MeshError::TooLarge { what, got: total, limit: MAX_ENTRIES });
        }
        let mut starts = Vec::with_capacity(bands + 1);
        let mut sum = 0;
        for count in counts {
            starts.push(sum);
            sum += count as usize;
        }
        starts.push(sum);
        let mut next = starts.clone();
        let mut entries = vec![0; sum];
        for (at, chart) in self.charts.iter().enumerate() {
            for band in reach(chart) {
                entries[next[band]] = at as u32;
                next[band] += 1;
            }
        }
        (self.entries, self.starts) = (entries, starts);
        Ok(())
    }

    /// The charts that may touch a band of rows.
    pub(super) fn band(&self, band: usize) -> &[u32] {
        &self.entries[self.starts[band]..self.starts[band + 1]]
    }

    /// The corners of a chart, in texels, y down.
    #[inline(always)]
    pub(super) fn corners(&self, mesh: &Mesh, chart: &Chart) -> [DVec2; 3] {
        let [x, y] = chart.tile;
        let tile = DVec2::new(f64::from(x), f64::from(y));
        mesh.indices[chart.triangle as usize].map(|i| (mesh.uvs[i as usize].as_dvec2() - tile) * self.size)
    }
}
