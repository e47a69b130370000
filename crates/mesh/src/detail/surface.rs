//! The detailed mesh: its tree, and what it looks like where a ray meets it.

use glam::Vec3;

use super::tree::{Hit, Tree};
use crate::mesh::Mesh;

/// The detailed mesh.
#[derive(Debug)]
pub(super) struct Surface<'a> {
    pub mesh: &'a Mesh,
    pub tree: Tree,
}

/// A point of the detailed surface, seen from outside.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub place: Vec3,
    /// The interpolated normal, unit.
    pub normal: Vec3,
    /// The triangle's own normal, unit; zero when it has no area.
    pub plane: Vec3,
}

impl<'a> Surface<'a> {
    /// The surface of a mesh; `None` when `go_on` said no.
    pub(super) fn new(mesh: &'a Mesh, go_on: impl FnMut() -> bool) -> Option<Self> {
        let corners = |t: u32| mesh.indices[t as usize].map(|i| mesh.positions[i as usize]);
        Tree::new(mesh.indices.len(), corners, go_on).map(|tree| Self { mesh, tree })
    }

    /// The interpolated normal where a ray of that direction met the surface, unit. A side seen from
    /// behind is turned over.
    #[inline(always)]
    pub(super) fn normal(&self, hit: &Hit, direction: Vec3) -> Vec3 {
        let plane = self.plane(hit);
        let normal =
            self.mix(hit, &self.mesh.normals).try_normalize().unwrap_or_else(|| plane.normalize_or_zero());
        if plane.dot(direction) > 0.0 { -normal } else { normal }
    }

    /// Where a ray of that direction met the surface.
    #[inline(always)]
    pub(super) fn point(&self, hit: &Hit, direction: Vec3) -> Point {
        let plane = self.plane(hit).normalize_or_zero();
        Point {
            place: self.mix(hit, &self.mesh.positions),
            normal: self.normal(hit, direction),
            plane: if plane.dot(direction) > 0.0 { -plane } else { plane },
        }
    }

    /// The triangle's own normal, as long as twice its area.
    #[inline(always)]
    fn plane(&self, hit: &Hit) -> Vec3 {
        let [a, b, c] = self.mesh.indices[hit.triangle as usize].map(|i| self.mesh.positions[i as usize]);
        (b - a).cross(c - a)
    }

    #[inline(always)]
    fn mix(&self, hit: &Hit, values: &[Vec3]) -> Vec3 {
        let [a, b, c] = self.mesh.indices[hit.triangle as usize].map(|i| values[i as usize]);
        let [wa, wb, wc] = hit.weights;
        a * wa + b * wb + c * wc
    }
}
