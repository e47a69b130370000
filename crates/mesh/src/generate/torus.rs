//! A torus.

use std::f64::consts::TAU;

use glam::DVec3;

use super::parametric::SurfacePoint;
use super::{check_length, check_segments};
use crate::error::MeshError;
use crate::mesh::Mesh;

/// The torus of [`Mesh::torus`] in closed form. `u` runs around the ring, `v` around the tube.
pub fn torus_point(major: f64, minor: f64, u: f64, v: f64) -> SurfacePoint {
    let ((sin_u, cos_u), (sin_v, cos_v)) = ((TAU * (u - 0.5)).sin_cos(), (TAU * (0.5 - v)).sin_cos());
    let ring = major + minor * cos_v;
    let along = DVec3::new(cos_u, 0.0, -sin_u);
    let normal = DVec3::new(cos_v * sin_u, sin_v, cos_v * cos_u);
    let dndv = TAU * DVec3::new(sin_v * sin_u, -cos_v, sin_v * cos_u);
    SurfacePoint {
        position: DVec3::new(ring * sin_u, minor * sin_v, ring * cos_u),
        dpdu: TAU * ring * along,
        dpdv: minor * dndv,
        dndu: TAU * cos_v * along,
        dndv,
        along,
        normal,
    }
}

impl Mesh {
    /// A torus lying in the plane y = 0 around the origin: `major` from the centre to the middle of
    /// the tube, `minor` the tube's radius.
    ///
    /// The middle of the map is the outermost point towards +Z, upright and unmirrored there: `u`
    /// grows to the right around the ring, `v` down around the tube. Seams run at -Z and along the
    /// inner equator.
    ///
    /// # Errors
    /// [`MeshError::Parameter`] for radii that are not positive, a tube wider than the ring, or
    /// segments outside 3..=2048.
    pub fn torus(
        major: f32,
        minor: f32,
        major_segments: u32,
        minor_segments: u32,
    ) -> Result<Self, MeshError> {
        let (ring, tube) = (check_length("major radius", major)?, check_length("minor radius", minor)?);
        if minor >= major {
            return Err(MeshError::Parameter {
                name: "minor radius",
                value: minor.to_string(),
                expected: "expected less than the major radius",
            });
        }
        let columns = check_segments("major segments", major_segments)?;
        let rows = check_segments("minor segments", minor_segments)?;
        let mut mesh = Self::default();
        for row in 0..=rows {
            for column in 0..=columns {
                let (u, v) = (f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows));
                // The last row and column are the first ones again, to the last bit, so that seams are closed.
                mesh.push_exact([u, v], &torus_point(ring, tube, u % 1.0, v % 1.0));
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let d = a + columns + 1;
                mesh.indices.extend([[d, d + 1, a + 1], [d, a + 1, a]]);
            }
        }
        Ok(mesh.named("torus"))
    }
}
