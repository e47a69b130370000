//! Micro-polygons of a draw, as small as the picture asks for.

use glam::{DMat4, DVec3};
use mesh::{Cut, Displaced, EdgeSide, MeshError, Relief};

use crate::{Camera, Draw, RenderError};

/// Longest edge of a micro-polygon in the picture, pixels.
const PIXELS: f64 = 1.0;
/// Pieces along a texel's width beyond which more show nothing new: the surface is bilinear.
const PIECES_A_TEXEL: f64 = 2.0;
/// Most micro-triangles of a draw.
const MOST: u64 = 12 << 20;

/// How a draw stands in the picture.
pub(crate) struct View<'a> {
    pub camera: &'a Camera,
    /// From the centred mesh.
    pub relative_from_object: DMat4,
    /// Longest stretch of that transform, or more.
    pub stretch: f64,
    /// Middle of the mesh.
    pub centre: DVec3,
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Whether what is outside the picture may be left out.
    pub culled: bool,
}

impl View<'_> {
    fn relative(&self, position: glam::Vec3) -> DVec3 {
        self.relative_from_object.transform_point3(position.as_dvec3() - self.centre)
    }

    /// World units that a pixel covers at distance 1.
    fn pixel(&self) -> f64 {
        2.0 * (0.5 * self.camera.fov_y).tan() / f64::from(self.size[1])
    }
}

/// Cuts what of a draw may be in the picture and displaces it. Also says by how much micro-polygons had to be larger
/// than a pixel to keep their number down; 1 when they need not.
pub(crate) fn displaced(draw: &Draw<'_>, view: &View<'_>) -> Result<(Displaced, f64), RenderError> {
    let field = &draw.material.field;
    let extent = field.extent();
    let texels = [field.width() as f64, field.height() as f64];
    let reach = f64::from(extent.scale) * view.stretch;
    let frustum = view.camera.frustum(f64::from(view.size[0]) / f64::from(view.size[1]));
    let keep = |face: u32| {
        if !view.culled {
            return true;
        }
        let corners =
            draw.mesh.indices[face as usize].map(|at| view.relative(draw.mesh.positions[at as usize]));
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = corners.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max);
        !frustum.misses(centre, radius + reach)
    };
    let relief = Relief {
        height: &|u, v| field.height_at(u, v),
        scale: f64::from(extent.scale),
        base: f64::from(extent.base),
    };
    let mut coarser = 1.0;
    loop {
        let segments = |side: &EdgeSide| {
            let [a, b] = side.positions.map(|position| view.relative(position));
            let nearest = (distance_to_segment(a, b) - reach).max(view.camera.near());
            let on_screen = a.distance(b) / (nearest * view.pixel() * PIXELS);
            let [u, v] = (side.uvs[1] - side.uvs[0]).abs().as_dvec2().to_array();
            let on_map = (u * texels[0]).hypot(v * texels[1]) * PIECES_A_TEXEL;
            (on_screen.min(on_map) / coarser).ceil().clamp(1.0, 1e6) as u32
        };
        let cut = Cut {
            range: &draw.triangles,
            keep: &keep,
            segments: &segments,
            origin: view.centre,
            limit: MOST,
        };
        match mesh::displace(&draw.mesh, &cut, &relief) {
            Ok(displaced) => return Ok((displaced, coarser)),
            // Numbers of triangles go with the square; what cannot be cut any less ends the search.
            Err(MeshError::TooLarge { got, limit, .. }) if coarser < 1e6 => {
                coarser *= (got as f64 / limit as f64).sqrt().max(1.05);
            }
            Err(error) => return Err(RenderError::Displacement(error)),
        }
    }
}

/// From the origin to the segment between two points.
fn distance_to_segment(a: DVec3, b: DVec3) -> f64 {
    let along = b - a;
    let square = along.length_squared();
    let share = if square > 0.0 { (-a.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (a + share * along).length()
}
