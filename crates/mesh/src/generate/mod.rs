//! Generated shapes whose normals, tangents and derivatives are exact, not averaged.

mod cube;
mod parametric;
mod quad;
mod sphere;
mod torus;

use glam::DVec3;

use crate::error::MeshError;
use crate::frame::convention;
use crate::mesh::{Mesh, Part};

pub use parametric::SurfacePoint;
pub use sphere::sphere_point;
pub use torus::torus_point;

/// Fails unless a length is positive and small enough for its square to be stored.
fn check_length(name: &'static str, value: f32) -> Result<f64, MeshError> {
    if !(value > 1e-15 && value < 1e15) {
        return Err(MeshError::Parameter {
            name,
            value: value.to_string(),
            expected: "expected a length between 1e-15 and 1e15 mesh units",
        });
    }
    Ok(f64::from(value))
}

fn check_segments(name: &'static str, value: u32) -> Result<u32, MeshError> {
    if !(3..=2048).contains(&value) {
        return Err(MeshError::Parameter {
            name,
            value: value.to_string(),
            expected: "expected 3 to 2048 segments",
        });
    }
    Ok(value)
}

impl Mesh {
    /// Appends a vertex with everything exact. `along` is the direction of the tangent, which at a
    /// pole outlives `dP/du`.
    fn push_exact(&mut self, uv: [f64; 2], point: &SurfacePoint) -> u32 {
        self.positions.push(point.position.as_vec3());
        self.normals.push(point.normal.as_vec3());
        self.uvs.push(glam::DVec2::from(uv).as_vec2());
        let w = convention::handedness(point.normal, point.along, point.dpdv);
        self.tangents.push(point.along.as_vec3().extend(w));
        self.dpdu.push(point.dpdu.as_vec3());
        self.dpdv.push(point.dpdv.as_vec3());
        self.positions.len() as u32 - 1
    }

    fn named(mut self, name: &str) -> Self {
        let triangles = 0..self.indices.len() as u32;
        self.parts = vec![Part { name: name.to_owned(), triangles, material: None }];
        self
    }

    /// Appends a rectangle of two triangles: `right` and `down` span it from its centre.
    fn push_rectangle(&mut self, centre: DVec3, right: DVec3, down: DVec3) {
        let normal = down.cross(right).normalize();
        let corner = |[u, v]: [f64; 2]| SurfacePoint {
            position: centre + right * (u - 0.5) + down * (v - 0.5),
            dpdu: right,
            dpdv: down,
            dndu: DVec3::ZERO,
            dndv: DVec3::ZERO,
            along: right.normalize(),
            normal,
        };
        let [a, b, c, d] =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|uv| self.push_exact(uv, &corner(uv)));
        self.indices.extend([[d, c, b], [d, b, a]]);
    }
}
