//! Points of the plain mesh with what the bake needs to know there, and the rays that start above them.

use glam::Vec3;

use super::tree::Ray;
use crate::mesh::Mesh;
use crate::normals::face_normal;

/// The plain mesh and how far rays reach.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ground<'a> {
    pub mesh: &'a Mesh,
    /// A mesh of the same triangles from which rays start; without one, they start `front` above.
    pub cage: Option<&'a Mesh>,
    /// Mesh units above the plain mesh.
    pub front: f32,
    /// Mesh units below it.
    pub rear: f32,
    /// Mesh units that rays start earlier and end later; see [`Ground::slack_of`].
    pub slack: f32,
}

/// Share of the largest coordinate and of a ray's length that rounding may take.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// A point of the plain mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    /// The interpolated normal, not normalised, as MikkTSpace asks.
    pub normal: Vec3,
    /// The interpolated tangent, not normalised.
    pub tangent: Vec3,
    /// The tangent's `w`.
    pub w: f32,
    /// Where the ray starts, mesh units above the point.
    pub height: f32,
}

/// The corners of one triangle, kept while neighbouring samples lie on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    places: [Vec3; 3],
    normals: [Vec3; 3],
    tangents: [Vec3; 3],
    w: f32,
    cage: [Vec3; 3],
    plane: Vec3,
}

#[inline(always)]
fn mix(weights: [f32; 3], [a, b, c]: [Vec3; 3]) -> Vec3 {
    a * weights[0] + b * weights[1] + c * weights[2]
}

impl Facet {
    /// Twice the area, square mesh units.
    pub(super) fn area(&self) -> f64 {
        let [a, b, c] = self.places.map(|p| p.as_dvec3());
        (b - a).cross(c - a).length()
    }
}

impl Ground<'_> {
    /// A height in mesh units as a share of the way from the ends of the rays to their starts.
    #[inline(always)]
    pub(super) fn unit(&self, height: f32) -> f32 {
        ((height + self.rear) / (self.front + self.rear)).clamp(0.0, 1.0)
    }

    /// What rounding may take from rays of that length near the plain mesh, mesh units.
    pub(super) fn slack_of(&self, length: f32) -> f32 {
        let (low, high) = self.mesh.bounds();
        (low.abs().max(high.abs()).max_element() + length) * ROUNDING
    }

    /// How far the corners of the cage are from those of the plain mesh, at most.
    pub(super) fn cage_height(&self) -> f32 {
        let Some(cage) = self.cage else { return self.front };
        let pairs = self.mesh.indices.iter().flatten().zip(cage.indices.iter().flatten());
        pairs.fold(0.0, |most: f32, (&p, &c)| {
            most.max(self.mesh.positions[p as usize].distance(cage.positions[c as usize]))
        })
    }

    /// Gathers a triangle's corners.
    pub(super) fn facet(&self, triangle: u32) -> Facet {
        let mesh = self.mesh;
        let corners = mesh.indices[triangle as usize];
        let at = corners.map(|i| i as usize);
        let cage = self.cage.map_or([0; 3], |cage| cage.indices[triangle as usize]);
        Facet {
            places: at.map(|i| mesh.positions[i]),
            normals: at.map(|i| mesh.normals[i]),
            tangents: at.map(|i| mesh.tangents[i].truncate()),
            // Corners of one triangle have one handedness, unless its UVs are degenerate.
            w: mesh.tangents[at[0]].w,
            cage: self.cage.map_or([Vec3::ZERO; 3], |mesh| cage.map(|i| mesh.positions[i as usize])),
            plane: face_normal(&mesh.positions, &corners).as_vec3(),
        }
    }

    /// The point of a triangle with those weights, and its ray.
    #[inline(always)]
    pub(super) fn spot(&self, facet: &Facet, weights: [f32; 3]) -> (Spot, Ray) {
        let place = mix(weights, facet.places);
        let normal = mix(weights, facet.normals);
        let up = normal.try_normalize().unwrap_or(facet.plane);
        let mut spot = Spot { normal, tangent: mix(weights, facet.tangents), w: facet.w, height: self.front };
        let mut origin = place + up * self.front;
        let mut direction = -up;
        if self.cage.is_some() {
            let start = mix(weights, facet.cage);
            let apart = place - start;
            let length = apart.length();
            if length > 0.0 && length.is_finite() {
                (origin, direction) = (start, apart / length);
            } else {
                origin = place;
            }
            spot.height = length;
        }
        // Height 0 and height 1 are met in spite of rounding.
        let (slack, far) = (self.slack, spot.height + self.rear);
        (spot, Ray::new(origin, direction, -slack, far + slack))
    }
}

impl Spot {
    /// A direction in the tangent frame of the spot: unit, +X along the tangent, +Y up the image.
    ///
    /// This is the inverse of what a renderer does: `x T + y w (N x T) + z N` with the interpolated
    /// vectors as they are (Mikkelsen 2008), which need be neither unit nor perpendicular.
    #[inline(always)]
    pub(super) fn tangent_space(&self, direction: Vec3) -> Vec3 {
        let (t, n) = (self.tangent, self.normal);
        let b = n.cross(t) * self.w;
        // The adjoint is the inverse but for the determinant, whose sign is that of w.
        let adjoint =
            Vec3::new(direction.dot(b.cross(n)), direction.dot(n.cross(t)), direction.dot(t.cross(b)));
        (adjoint * self.w).try_normalize().unwrap_or_else(|| {
            let n = n.try_normalize().unwrap_or(Vec3::Z);
            let t = n.any_orthonormal_vector();
            Vec3::new(direction.dot(t), direction.dot(n.cross(t)), direction.dot(n))
        })
    }
}
