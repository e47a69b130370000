//! One frame a vertex: the direction in which `u` grows fastest, by least squares over the edges there.
//!
//! With unit edge directions `e` in the plane of the normal and the growth `du` along each per mesh
//! unit, the gradient `g` of `u` minimises the sum of `(du - g . e)^2`: two equations with a closed
//! solution. Its direction maximises the weighted average of the directional change. As it is
//! perpendicular to `dP/dv`, it differs from `dP/du` by the shear of the map.
//!
//! Source: the normal equations of the UV change along edges; cf. Taubin, "Estimating the Tensor of
//! Curvature of a Surface from a Polyhedral Approximation", 1995, for directional estimates of this kind.

use glam::{DMat2, DVec2, Vec4};

use super::{FrameInfo, Surface, convention};

pub(super) const INFO: FrameInfo = FrameInfo {
    name: "uv_gradient",
    summary: "one frame a vertex: the direction in which u grows fastest, by least squares over its edges",
    guarantee: "second order in the edge length inside a regular mesh; perpendicular to dP/dv, so off by \
                the shear of the map; mirrored charts are never mixed",
    source: "least squares over directional UV changes along edges; cf. Taubin 1995",
    shares: true,
    corners,
};

/// Determinant of the edges' normal equations, as a share of its largest value, below which all edges
/// count as parallel.
const PARALLEL: f64 = 1e-12;

/// Normal equations at a vertex, one side of a mirror.
#[derive(Clone, Copy, Default)]
struct Edges {
    xx: f64,
    xy: f64,
    yy: f64,
    growth: DVec2,
}

impl Edges {
    /// Direction of growth, plane coordinates.
    fn direction(&self) -> Option<DVec2> {
        let matrix = DMat2::from_cols(DVec2::new(self.xx, self.xy), DVec2::new(self.xy, self.yy));
        let trace = self.xx + self.yy;
        if matrix.determinant() <= PARALLEL * trace * trace {
            return None;
        }
        (matrix.inverse() * self.growth).try_normalize()
    }
}

fn corners(surface: Surface<'_>) -> Vec<Option<Vec4>> {
    let side = |face: usize, vertex: usize| {
        let frame = surface.face_frame(face)?;
        let normal = surface.normals[vertex].as_dvec3();
        Some(convention::handedness(normal, frame.dpdu, frame.dpdv))
    };
    let mut sums = vec![[Edges::default(); 2]; surface.positions.len()];
    for (face, triangle) in surface.indices.iter().enumerate() {
        for corner in 0..3 {
            let vertex = triangle[corner] as usize;
            let Some(w) = side(face, vertex) else { break };
            let normal = surface.normals[vertex].as_dvec3();
            let (x, y) = normal.any_orthonormal_pair();
            let sum = &mut sums[vertex][usize::from(w < 0.0)];
            for other in [triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]] {
                let edge = (surface.positions[other as usize] - surface.positions[vertex]).as_dvec3();
                let Some(direction) = convention::in_surface(normal, edge) else { continue };
                let e = DVec2::new(direction.dot(x), direction.dot(y));
                let grown = f64::from(surface.uvs[other as usize].x) - f64::from(surface.uvs[vertex].x);
                sum.xx += e.x * e.x;
                sum.xy += e.x * e.y;
                sum.yy += e.y * e.y;
                sum.growth += e * (grown / edge.length());
            }
        }
    }
    surface.each_corner(|face| {
        let sums = &sums;
        move |vertex, normal| {
            let w = side(face, vertex)?;
            let direction = sums[vertex][usize::from(w < 0.0)].direction()?;
            let (x, y) = normal.any_orthonormal_pair();
            Some((direction.x * x + direction.y * y).as_vec3().extend(w))
        }
    })
}
