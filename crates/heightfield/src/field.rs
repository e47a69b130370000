//! The height field itself: heights on a grid of cells, and the unit its slopes have.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::baked::{BakedMap, BakedMaps};
use crate::cone_map::{ConeKind, ConeMap};
use crate::distance_map::DistanceMap;
use crate::margin::Margins;
use crate::{HeightFieldError, MaxPyramid, SkipPyramid};

/// Longest accepted side, in texels. Cell ids and their sums stay exact in `f32` up to here.
pub const MAX_SIDE: usize = 1 << 16;

/// What lies beyond the edge of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// The map tiles the plane.
    #[default]
    Repeat,
    /// The edge texels go on for ever.
    Clamp,
    /// Every other tile is mirrored.
    Mirror,
}

impl Wrap {
    /// The texel in `0..n` that index `i` stands for.
    #[inline(always)]
    pub fn index(self, i: i64, n: usize) -> usize {
        let n = n as i64;
        let wrapped = match self {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Clamp => i.clamp(0, n - 1),
            Wrap::Mirror => {
                let m = i.rem_euclid(2 * n);
                if m < n { m } else { 2 * n - 1 - m }
            }
        };
        wrapped as usize
    }
}

/// The size of the relief in mesh units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Mesh units between height 0 and height 1.
    pub scale: f32,
    /// The height that lies on the mesh surface: 1 carves in, 0 raises.
    pub base: f32,
    /// Mesh units covered by one tile along `u` and `v`.
    pub tile_size: [f32; 2],
}

impl Default for Extent {
    fn default() -> Self {
        Self { scale: 0.1, base: 1.0, tile_size: [1.0, 1.0] }
    }
}

impl Extent {
    /// Checks that the scale is finite and not negative, the base in 0..1, the tile size positive.
    pub fn validate(&self) -> Result<(), HeightFieldError> {
        let bad =
            |name, value: f32, expected| HeightFieldError::Extent { name, value: f64::from(value), expected };
        if !(self.scale.is_finite() && self.scale >= 0.0) {
            return Err(bad("scale", self.scale, "it must be finite and not negative"));
        }
        if !(0.0..=1.0).contains(&self.base) {
            return Err(bad("base", self.base, "it must be in 0..1"));
        }
        for side in self.tile_size {
            if !(side.is_finite() && side > 0.0) {
                return Err(bad("tile_size", side, "it must be finite and positive"));
            }
        }
        Ok(())
    }

    /// Cosine of the angle between a texture-space direction and the surface normal, in mesh units.
    ///
    /// Returns 0 for a horizontal direction and 1 for a vertical one; a relief without height is
    /// seen along its lateral extent only.
    #[inline(always)]
    pub fn cos_theta(&self, direction: [f64; 3]) -> f32 {
        let x = direction[0] * f64::from(self.tile_size[0]);
        let y = direction[1] * f64::from(self.tile_size[1]);
        let z = direction[2] * f64::from(self.scale);
        let length = (x * x + y * y + z * z).sqrt();
        if length > 0.0 { (z.abs() / length) as f32 } else { 1.0 }
    }
}

/// Heights in 0..1 with bilinear interpolation between texel centres.
///
/// The surface is stored as *cells*: cell `(i, j)` is the bilinear patch between the centres of
/// four texels. [`Self::corners`] holds one row and one column more than there are cells, so a cell
/// finds its four heights without wrapping. [`Wrap::Repeat`] has as many cells as texels;
/// [`Wrap::Mirror`] stores both tiles of its period; [`Wrap::Clamp`] has a border of one cell on
/// each side that reaches to infinity.
#[derive(Debug)]
pub struct HeightField {
    width: usize,
    height: usize,
    wrap: Wrap,
    corners: Vec<f32>,
    cells: [usize; 2],
    extent: Extent,
    pyramid: OnceLock<MaxPyramid>,
    skip_pyramid: OnceLock<SkipPyramid>,
    baked: BakedMaps,
    margins: OnceLock<Margins>,
}

impl HeightField {
    /// Builds a field from `width * height` heights, row by row, row 0 at `v = 0`.
    ///
    /// # Errors
    /// [`HeightFieldError::Size`], [`HeightFieldError::Length`] or [`HeightFieldError::Height`].
    pub fn new(texels: &[f32], width: usize, height: usize, wrap: Wrap) -> Result<Self, HeightFieldError> {
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            return Err(HeightFieldError::Size { width, height, max: MAX_SIDE });
        }
        if texels.len() != width * height {
            return Err(HeightFieldError::Length {
                width,
                height,
                expected: width * height,
                got: texels.len(),
            });
        }
        let sound = |row: &[f32]| row.iter().fold(true, |sound, h| sound & (0.0..=1.0).contains(h));
        if let Some(at) = texels.par_chunks(width).position_first(|row| !sound(row)).and_then(|row| {
            texels[row * width..].iter().position(|h| !(0.0..=1.0).contains(h)).map(|at| row * width + at)
        }) {
            return Err(HeightFieldError::Height { row: at / width, column: at % width, value: texels[at] });
        }
        let cells = match wrap {
            Wrap::Repeat => [width, height],
            Wrap::Clamp => [width + 1, height + 1],
            Wrap::Mirror => [2 * width, 2 * height],
        };
        // Corners are numbered by 32 bits.
        if (cells[0] + 1).saturating_mul(cells[1] + 1) > i32::MAX as usize {
            return Err(HeightFieldError::Cells { width, height, wrap });
        }
        let first = Self::first_texel_of(wrap);
        let mut corners = vec![0.0; (cells[0] + 1) * (cells[1] + 1)];
        corners.par_chunks_mut(cells[0] + 1).enumerate().for_each(|(j, to)| {
            let row = &texels[wrap.index(j as i64 + first, height) * width..][..width];
            let before = usize::from(wrap == Wrap::Clamp);
            to[..before].fill(row[0]);
            to[before..][..width].copy_from_slice(row);
            let behind = &mut to[before + width..];
            match wrap {
                Wrap::Repeat => behind.fill(row[0]),
                Wrap::Clamp => behind.fill(row[width - 1]),
                Wrap::Mirror => {
                    behind.iter_mut().zip(row.iter().rev()).for_each(|(to, &from)| *to = from);
                    behind[width] = row[0];
                }
            }
        });
        Ok(Self {
            width,
            height,
            wrap,
            corners,
            cells,
            extent: Extent::default(),
            pyramid: OnceLock::new(),
            skip_pyramid: OnceLock::new(),
            baked: BakedMaps::default(),
            margins: OnceLock::new(),
        })
    }

    /// The same field with another size in mesh units.
    ///
    /// # Errors
    /// [`HeightFieldError::Extent`].
    pub fn with_extent(mut self, extent: Extent) -> Result<Self, HeightFieldError> {
        extent.validate()?;
        self.extent = extent;
        Ok(self)
    }

    /// The size of the relief in mesh units.
    #[inline(always)]
    pub fn extent(&self) -> &Extent {
        &self.extent
    }

    fn first_texel_of(wrap: Wrap) -> i64 {
        if wrap == Wrap::Clamp { -1 } else { 0 }
    }

    /// Texels across.
    #[inline(always)]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Texels down.
    #[inline(always)]
    pub fn height(&self) -> usize {
        self.height
    }

    /// What lies beyond the edge.
    #[inline(always)]
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// Cells along x and y.
    #[inline(always)]
    pub fn cells(&self) -> [usize; 2] {
        self.cells
    }

    /// Whether cell ids wrap around (`Repeat`, `Mirror`) or the border cells are endless (`Clamp`).
    #[inline(always)]
    pub fn is_periodic(&self) -> bool {
        self.wrap != Wrap::Clamp
    }

    /// The texel whose centre is the left (upper) side of cell 0: 0, or -1 for `Clamp`.
    #[inline(always)]
    pub fn first_texel(&self) -> i64 {
        Self::first_texel_of(self.wrap)
    }

    /// Corner heights, `(cells[0] + 1) * (cells[1] + 1)`, row by row.
    #[inline(always)]
    pub fn corners(&self) -> &[f32] {
        &self.corners
    }

    /// The four corner heights of a cell: `[h00, h10, h01, h11]`, first digit along x.
    #[inline(always)]
    pub fn cell(&self, i: usize, j: usize) -> [f32; 4] {
        let stride = self.cells[0] + 1;
        let at = j * stride + i;
        [self.corners[at], self.corners[at + 1], self.corners[at + stride], self.corners[at + stride + 1]]
    }

    /// The height of a texel, wrapped.
    #[inline(always)]
    pub fn texel(&self, i: i64, j: i64) -> f32 {
        let first = self.first_texel();
        let x = (self.wrap.index(i, self.width) as i64 - first) as usize;
        let y = (self.wrap.index(j, self.height) as i64 - first) as usize;
        self.corners[y * (self.cells[0] + 1) + x]
    }

    /// The heights as they were given, `width * height`, row by row.
    pub fn texels(&self) -> Vec<f32> {
        let first = (-self.first_texel()) as usize;
        let stride = self.cells[0] + 1;
        (0..self.height)
            .flat_map(|j| {
                let at = (j + first) * stride + first;
                self.corners[at..at + self.width].iter().copied()
            })
            .collect()
    }

    /// Cell and position inside it (0..1; any value in the endless cells of `Clamp`) along one axis.
    #[inline(always)]
    fn locate(&self, coordinate: f64, texels: usize, cells: usize) -> (usize, f64) {
        let x = coordinate * texels as f64 - 0.5 - self.first_texel() as f64;
        let floor = x.floor();
        if self.is_periodic() {
            let n = cells as f64;
            let id = floor - (floor / n).floor() * n;
            ((id.max(0.0) as usize).min(cells - 1), x - floor)
        } else {
            let id = floor.clamp(0.0, (cells - 1) as f64);
            (id as usize, (x - id).clamp(0.0, 1.0))
        }
    }

    /// Bilinear height at `(u, v)`, in 0..1.
    #[inline(always)]
    pub fn height_at(&self, u: f64, v: f64) -> f64 {
        let (i, x) = self.locate(u, self.width, self.cells[0]);
        let (j, y) = self.locate(v, self.height, self.cells[1]);
        let [h00, h10, h01, h11] = self.cell(i, j).map(f64::from);
        let top = h00 + (h10 - h00) * x;
        let bottom = h01 + (h11 - h01) * x;
        top + (bottom - top) * y
    }

    /// Bilinear height at `(u, v)` in `f32`: the twin of WGSL `height_at`.
    #[inline(always)]
    pub fn sample(&self, u: f32, v: f32) -> f32 {
        let (i, x) = self.locate_f32(u, self.width, self.cells[0]);
        let (j, y) = self.locate_f32(v, self.height, self.cells[1]);
        let [h00, h10, h01, h11] = self.cell(i, j);
        let top = h00 + (h10 - h00) * x;
        let bottom = h01 + (h11 - h01) * x;
        top + (bottom - top) * y
    }

    #[inline(always)]
    fn locate_f32(&self, coordinate: f32, texels: usize, cells: usize) -> (usize, f32) {
        let x = coordinate * texels as f32 - 0.5 - self.first_texel() as f32;
        let last = (cells - 1) as f32;
        if self.is_periodic() {
            let floor = x.floor();
            let n = cells as f32;
            // Half a cell keeps the quotient of whole numbers off whole numbers, so rounding is harmless.
            let tile = ((floor + 0.5) * n.recip()).floor();
            let id = (floor - tile * n).clamp(0.0, last);
            (id as i32 as usize, x - floor)
        } else {
            let id = x.floor().clamp(0.0, last);
            (id as i32 as usize, (x - id).clamp(0.0, 1.0))
        }
    }

    /// Gradient `(dh/du, dh/dv)` of the bilinear surface at `(u, v)`, height per tile.
    pub fn gradient_at(&self, u: f64, v: f64) -> [f64; 2] {
        let (i, x) = self.locate(u, self.width, self.cells[0]);
        let (j, y) = self.locate(v, self.height, self.cells[1]);
        self.cell_gradient(i, j, x, y)
    }

    /// Gradient `(dh/du, dh/dv)` inside cell `(i, j)` at local position `(x, y)` in 0..1.
    #[inline(always)]
    pub fn cell_gradient(&self, i: usize, j: usize, x: f64, y: f64) -> [f64; 2] {
        let [h00, h10, h01, h11] = self.cell(i, j).map(f64::from);
        let dx = (h10 - h00) * (1.0 - y) + (h11 - h01) * y;
        let dy = (h01 - h00) * (1.0 - x) + (h11 - h10) * x;
        [dx * self.width as f64, dy * self.height as f64]
    }

    /// The max pyramid over the cells, built when first asked for.
    pub fn pyramid(&self) -> &MaxPyramid {
        self.pyramid.get_or_init(|| MaxPyramid::build(self))
    }

    /// Max pyramids with margins of several widths, built when first asked for.
    pub fn margins(&self) -> &Margins {
        self.margins.get_or_init(|| Margins::build(self))
    }

    /// The max pyramid with a margin around its nodes, built when first asked for.
    pub fn skip_pyramid(&self) -> &SkipPyramid {
        self.skip_pyramid.get_or_init(|| SkipPyramid::build(self))
    }

    /// Whether a baked map has been attached.
    pub fn has(&self, map: BakedMap) -> bool {
        self.baked.has(map)
    }

    /// The cone map of that kind, if one was attached.
    #[inline(always)]
    pub fn cone_map(&self, kind: ConeKind) -> Option<&ConeMap> {
        self.baked.cone(kind)
    }

    /// Attaches a cone map of this field. A map of the same kind that is there already stays.
    pub fn attach_cone_map(&self, map: ConeMap) {
        self.baked.keep_cone(map);
    }

    /// The distance map, if it has been attached.
    #[inline(always)]
    pub fn distance_map(&self) -> Option<&DistanceMap> {
        self.baked.distance()
    }

    /// Attaches a distance map; one that is there already stays.
    pub fn attach_distance_map(&self, map: DistanceMap) {
        self.baked.keep_distance(map);
    }
}
