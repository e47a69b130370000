//! A sphere by longitude and latitude.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::parametric::SurfacePoint;
use super::{check_length, check_segments};
use crate::error::MeshError;
use crate::mesh::Mesh;

/// The sphere of [`Mesh::sphere`] in closed form. `u` is longitude, `v` colatitude over half a turn.
pub fn sphere_point(radius: f64, u: f64, v: f64) -> SurfacePoint {
    let ((sin_lon, cos_lon), (sin_lat, cos_lat)) = ((TAU * (u - 0.5)).sin_cos(), (PI * v).sin_cos());
    // The south pole is one point, to the last bit.
    let sin_lat = if v == 1.0 { 0.0 } else { sin_lat };
    let along = DVec3::new(cos_lon, 0.0, -sin_lon);
    let normal = DVec3::new(sin_lat * sin_lon, cos_lat, sin_lat * cos_lon);
    let dndu = TAU * sin_lat * along;
    let dndv = PI * DVec3::new(cos_lat * sin_lon, -sin_lat, cos_lat * cos_lon);
    SurfacePoint {
        position: radius * normal,
        dpdu: radius * dndu,
        dpdv: radius * dndv,
        dndu,
        dndv,
        along,
        normal,
    }
}

impl Mesh {
    /// A sphere around the origin, `segments` around and half as many from pole to pole.
    ///
    /// An equirectangular map: north (`v = 0`) is +Y, the middle of the map faces +Z, `u` grows to
    /// the right seen from outside; the seam is at -Z. Each triangle at a pole has a pole vertex of
    /// its own in the middle of its `u` range. There the tangent is the limit along the meridian, and
    /// `dP/du`, which vanishes on the true sphere, is that of the triangle: the map is drawn on the
    /// triangle with that scale throughout, and a frame that shrinks towards the pole would have rays
    /// run around it without end.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] for a radius that is not positive or segments outside 3..=2048.
    pub fn sphere(radius: f32, segments: u32) -> Result<Self, MeshError> {
        let radius = check_length("radius", radius)?;
        let columns = check_segments("segments", segments)?;
        let rows = (columns / 2).max(2);
        let mut mesh = Self::default();
        // The last column is the first one again, to the last bit, so that the seam is closed.
        let mut push = |u: f64, v: f64| mesh.push_exact([u, v], &sphere_point(radius, u % 1.0, v));
        let (du, dv) = (1.0 / f64::from(columns), 1.0 / f64::from(rows));
        for row in 1..rows {
            for column in 0..=columns {
                push(f64::from(column) * du, f64::from(row) * dv);
            }
        }
        let first_pole = (rows - 1) * (columns + 1);
        for v in [0.0, 1.0] {
            for column in 0..columns {
                push((f64::from(column) + 0.5) * du, v);
            }
        }
        for column in 0..columns {
            mesh.indices.push([first_pole + column, column, column + 1]);
        }
        for upper in 0..rows - 2 {
            for column in 0..columns {
                let a = upper * (columns + 1) + column;
                let d = a + columns + 1;
                mesh.indices.extend([[d, d + 1, a + 1], [d, a + 1, a]]);
            }
        }
        let last = (rows - 2) * (columns + 1);
        for column in 0..columns {
            mesh.indices.push([last + column, first_pole + columns + column, last + column + 1]);
        }
        let ring = sphere_point(radius, 0.5, dv).dpdu.length();
        // The chord over the arc.
        let length = ring * (PI * du).sin() / (PI * du);
        for vertex in first_pole as usize..mesh.dpdu.len() {
            mesh.dpdu[vertex] = mesh.tangents[vertex].truncate() * length as f32;
        }
        Ok(mesh.named("sphere"))
    }
}
