//! What a rendering returns.

use crate::Skipped;

/// Additional outputs; `None` where not asked for. Rows from the top.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Aovs {
    /// Texture coordinates, unwrapped as on the mesh; H * W * 2, 0 where nothing is.
    pub uv: Option<Vec<f32>>,
    /// Distance along the view axis, world units; H * W, infinite where nothing is.
    pub depth: Option<Vec<f32>>,
    /// World position; H * W * 3, 0 where nothing is.
    pub position: Option<Vec<f32>>,
    /// Unit shading normal, world axes; H * W * 3, 0 where nothing is.
    pub normal: Option<Vec<f32>>,
    /// Height of what is seen, 0..1 (the base where the technique does not displace); H * W.
    pub height: Option<Vec<f32>>,
    /// Steps of the search; H * W.
    pub steps: Option<Vec<u32>>,
    /// Share of the lights facing the point that the relief hides, 0..1; H * W.
    pub shadow: Option<Vec<f32>>,
    /// 1 where there is anything; H * W.
    pub mask: Option<Vec<u8>>,
    /// Start of the searched segment in texture space (u, v, z), u and v within the map's first
    /// period; H * W * 3, 0 where nothing was searched.
    pub ray_start: Option<Vec<f32>>,
    /// End minus start of that segment; H * W * 3.
    pub ray_delta: Option<Vec<f32>>,
    /// What was left out of a pixel's work: [`Skips::bits`](crate::Skips::bits) of the kinds, 512 besides "parallax"
    /// where what is seen stays on the mesh, and from bit 16 on the number of shadow rays left out; H * W.
    pub skip: Option<Vec<u32>>,
}

/// What it took. Times are milliseconds; of several samples a pixel all are counted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stats {
    /// Checking the scene, baking maps, uploading what the device did not have.
    pub prepare_ms: f64,
    /// Composing and compiling pipelines.
    pub compile_ms: f64,
    /// Drawing: on the device's own clock where it has one, else from submission to completion. Some
    /// drivers compile a program when it is first drawn with, so the first picture may take longer.
    pub draw_ms: f64,
    /// Whether `draw_ms` is from the device's clock.
    pub device_clock: bool,
    /// Copying the picture and unpacking it.
    pub readback_ms: f64,
    /// All of it.
    pub total_ms: f64,
    /// Maps baked for this rendering; those of an earlier one are kept as long as their heights.
    pub maps_baked: u32,
    /// Pipelines compiled for it; those of an earlier rendering are kept with the device.
    pub pipelines_compiled: u32,
    /// Bytes of meshes, maps and parameters sent to the device.
    pub bytes_uploaded: u64,
    /// Triangles sent to the device.
    pub triangles_drawn: u64,
    /// Triangles not sent: outside the picture, turned away or hidden.
    pub triangles_culled: u64,
    /// Pixels that show a mesh.
    pub pixels_covered: u64,
    /// Pixels whose ray was searched.
    pub pixels_marched: u64,
    /// Pixels whose search ran out of its bound.
    pub pixels_unconverged: u64,
    /// Steps of all searches of the pixels seen.
    pub steps: u64,
    /// Shadow rays of the pixels seen.
    pub shadow_rays: u64,
    /// What was left out.
    pub skipped: Skipped,
}

impl Stats {
    /// Adds the times of another rendering that belongs to the same picture.
    pub(crate) fn add_times(&mut self, other: &Self) {
        self.prepare_ms += other.prepare_ms;
        self.compile_ms += other.compile_ms;
        self.draw_ms += other.draw_ms;
        self.readback_ms += other.readback_ms;
        self.total_ms += other.total_ms;
    }
}

/// A picture and what came with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// 8-bit sRGB with alpha, H * W * 4, rows from the top.
    pub color: Vec<u8>,
    /// Additional outputs.
    pub aovs: Aovs,
    /// What it took.
    pub stats: Stats,
    /// Settings that could not take effect.
    pub warnings: Vec<String>,
}
