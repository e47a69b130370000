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
        let corners = |t: u32| mesh.indices[t as usize].map(|i| mesh.positions[i as usize].to_array());
        Tree::new(mesh.indices.len(), corners, go_on).map(|tree| Self { mesh, tree })
    }

    /// Where a ray of that direction met the surface. A side seen from behind is turned over.
    #[inline(always)]
    pub(super) fn point(&self, hit: &Hit, direction: Vec3) -> Point {
        let corners = self.mesh.indices[hit.triangle as usize].map(|i| i as usize);
        let [wa, wb, wc] = hit.weights;
        let mix = |v: &[Vec3]| v[corners[0]] * wa + v[corners[1]] * wb + v[corners[2]] * wc;
        let [a, b, c] = corners.map(|i| self.mesh.positions[i]);
        let mut plane = (b - a).cross(c - a).normalize_or_zero();
        let behind = plane.dot(direction) > 0.0;
        if behind {
            plane = -plane;
        }
        let mut normal = mix(&self.mesh.normals).try_normalize().unwrap_or(plane);
        if behind {
            normal = -normal;
        }
        Point { place: mix(&self.mesh.positions), normal, plane }
    }
}
