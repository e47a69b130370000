//! What a bake is asked for, and what it answers.

use crate::error::MeshError;

/// Largest width or height of a map, texels.
pub const MAX_MAP_SIDE: usize = 1 << 15;
/// Most samples along each side of a texel.
pub const MAX_GRID: usize = 8;
/// Most rays an occlusion sample sends.
pub const MAX_SKY_RAYS: u32 = 1 << 16;

/// The space that normals are stored in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum NormalSpace {
    /// The plain mesh's tangent frame: MikkTSpace's, or the file's own.
    #[default]
    Tangent,
    /// The space of the mesh: x, y, z as they are.
    Object,
}

/// Settings of the occlusion map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkyOptions {
    /// Rays a sample sends, 1 to [`MAX_SKY_RAYS`].
    pub rays: u32,
    /// How far away things still shade, mesh units; `None` for any distance.
    pub distance: Option<f32>,
    /// Picks one of many sets of directions; equal seeds give equal maps.
    pub seed: u64,
}

impl Default for SkyOptions {
    fn default() -> Self {
        Self { rays: 64, distance: None, seed: 0 }
    }
}

/// What to bake from a detailed mesh, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetailOptions {
    /// Texels across, 1 to [`MAX_MAP_SIDE`].
    pub width: usize,
    /// Texels down, 1 to [`MAX_MAP_SIDE`].
    pub height: usize,
    /// How far above the plain mesh rays start, mesh units. `None` measures how far the detailed mesh
    /// rises. A cage replaces it.
    pub front: Option<f32>,
    /// How far below the plain mesh rays end, mesh units. `None` measures how far the detailed mesh
    /// sinks.
    pub rear: Option<f32>,
    /// Samples along each side of a texel, 1 to [`MAX_GRID`]; their mean is stored.
    pub grid: usize,
    /// Texels that each chart is grown by, so that filtering finds no gaps at its edges.
    pub padding: usize,
    /// The space of the normals.
    pub space: NormalSpace,
    /// Whether green points down the image, as in DirectX; only in tangent space.
    pub green_down: bool,
    /// Whether rays stop at triangles seen from behind.
    pub back_faces: bool,
    /// Whether normals are wanted.
    pub normal: bool,
    /// Whether heights are wanted.
    pub heights: bool,
    /// Occlusion, when wanted.
    pub sky: Option<SkyOptions>,
}

impl Default for DetailOptions {
    fn default() -> Self {
        Self {
            width: 1024,
            height: 1024,
            front: None,
            rear: None,
            grid: 1,
            padding: 16,
            space: NormalSpace::Tangent,
            green_down: false,
            back_faces: false,
            normal: true,
            heights: false,
            sky: None,
        }
    }
}

impl DetailOptions {
    /// # Errors
    /// [`MeshError::Parameter`] for the first option out of its range.
    pub(super) fn validate(&self) -> Result<(), MeshError> {
        check_side("width", self.width)?;
        check_side("height", self.height)?;
        let refuse = |name, value: String, expected| Err(MeshError::Parameter { name, value, expected });
        if !(1..=MAX_GRID).contains(&self.grid) {
            return refuse("samples", self.grid.to_string(), "expected 1 to 8 along each side of a texel");
        }
        for (name, distance) in [("front", self.front), ("rear", self.rear)] {
            if let Some(d) = distance.filter(|d| !(*d >= 0.0 && *d < super::MAX_COORDINATE)) {
                return refuse(name, d.to_string(), "expected 0 to 1e15 mesh units");
            }
        }
        if let Some(sky) = self.sky {
            if !(1..=MAX_SKY_RAYS).contains(&sky.rays) {
                return refuse("rays", sky.rays.to_string(), "expected 1 to 65536");
            }
            if let Some(d) = sky.distance.filter(|d| !(*d > 0.0 && d.is_finite())) {
                return refuse("distance", d.to_string(), "expected more than 0 mesh units");
            }
        }
        Ok(())
    }
}

pub(super) fn check_side(name: &'static str, side: usize) -> Result<(), MeshError> {
    if (1..=MAX_MAP_SIDE).contains(&side) {
        return Ok(());
    }
    Err(MeshError::Parameter { name, value: side.to_string(), expected: "expected 1 to 32768 texels" })
}

/// Baked maps, row 0 on top, and how the bake went.
#[derive(Debug, Clone, PartialEq)]
pub struct DetailMaps {
    /// Unit normals, `height * width * 3` floats in -1..1.
    pub normal: Option<Vec<f32>>,
    /// Heights, `height * width` floats: 0 at `rear` below the plain mesh, 1 at `front` above it.
    pub heights: Option<Vec<f32>>,
    /// The open share of the sky, `height * width` floats in 0..1.
    pub ao: Option<Vec<f32>>,
    /// How it went.
    pub report: DetailReport,
}

/// How a bake from a detailed mesh went.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DetailReport {
    /// Mesh units above the plain mesh that height 1 stands for: with a cage, its largest distance.
    pub front: f32,
    /// Mesh units below the plain mesh that height 0 stands for.
    pub rear: f32,
    /// Lowest and highest point met, mesh units above the plain mesh; `None` when nothing was met.
    pub met: Option<(f32, f32)>,
    /// Texels that a chart covers or touches.
    pub texels: usize,
    /// Rays sent from the plain mesh.
    pub rays: u64,
    /// Rays that met nothing.
    pub missed: u64,
    /// Those among them that would have met a triangle seen from behind.
    pub averted: u64,
    /// Texels in which all rays met nothing; they hold the plain surface.
    pub empty: usize,
    /// Samples that several charts claim; the first triangle has them.
    pub overlapping: u64,
    /// What the caller should know, in sentences.
    pub warnings: Vec<String>,
}
