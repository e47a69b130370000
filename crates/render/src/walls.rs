//! Flat four-sided faces: walls, floors, the sides of boxes. What stands wholly behind one is not seen, and that can be
//! told on the host without drawing anything (Coorg and Teller, "Real-time occlusion culling for models with large
//! occluders", 1997).

use glam::{DVec3, Vec3};
use mesh::Mesh;

use crate::culling::Stand;

/// Meshes of more triangles are not searched for walls.
const MOST_TRIANGLES: usize = 64;
/// How far corners may be off the plane and normals off its own, as shares.
const FLAT: f64 = 1e-4;

/// A flat convex face of two triangles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wall {
    /// Its triangles.
    pub faces: [u32; 2],
    /// Counter-clockwise from the front; the mesh's own space.
    corners: [DVec3; 4],
    normal: DVec3,
}

/// The walls of a mesh.
pub(crate) fn walls(mesh: &Mesh) -> Vec<Wall> {
    let count = mesh.indices.len();
    if count > MOST_TRIANGLES {
        return Vec::new();
    }
    (0..count)
        .flat_map(|one| (one + 1..count).map(move |other| [one, other]))
        .filter_map(|pair| wall(mesh, pair))
        .collect()
}

fn wall(mesh: &Mesh, [one, other]: [usize; 2]) -> Option<Wall> {
    let place = |at: u32| mesh.positions[at as usize];
    let [first, second] = [mesh.indices[one], mesh.indices[other]];
    let [a, b] = [first.map(place), second.map(place)];
    // The corner of each that the other does not have; the other two are shared, the other way around.
    let alone = |of: [Vec3; 3], in_other: [Vec3; 3]| {
        let mut lone = (0..3).filter(|&at| !in_other.contains(&of[at]));
        let at = lone.next()?;
        lone.next().is_none().then_some(at)
    };
    let (i, j) = (alone(a, b)?, alone(b, a)?);
    let corners = [a[i], a[(i + 1) % 3], b[j], a[(i + 2) % 3]].map(|corner| corner.as_dvec3());
    if b[(j + 1) % 3] != a[(i + 2) % 3] {
        return None;
    }
    let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).try_normalize()?;
    let size = corners[0].distance(corners[2]);
    let convex = (0..4).all(|at| {
        let [before, here, after] = [3, 0, 1].map(|step| corners[(at + step) % 4]);
        let turn = (here - before).cross(after - here).dot(normal);
        turn > FLAT * size * size && (here - corners[0]).dot(normal).abs() <= 1e-6 * size
    });
    // Rays are bent by the normals at the corners: only over a plane with its own is it known how deep they go.
    let straight = first.into_iter().chain(second).all(|at| {
        let own = mesh.normals[at as usize].as_dvec3();
        own.normalize_or_zero().dot(normal) > 1.0 - FLAT * FLAT
    });
    (convex && straight).then_some(Wall { faces: [one as u32, other as u32], corners, normal })
}

/// A wall in a view: what is behind it is hidden.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Screen {
    /// Inward normals of the planes through the eye and the edges.
    sides: [DVec3; 4],
    /// Normal away from the eye, and distance of the plane that nothing of the wall is behind.
    away: DVec3,
    distance: f64,
    /// How large it is from the eye.
    pub size: f64,
}

impl Screen {
    /// A wall as it stands in a view whose near plane is at `near` along `forward`; `None` where it hides nothing.
    /// `middle`: of the mesh; `depth`: how deep the relief goes, mesh units.
    pub fn new(
        wall: &Wall,
        stand: &Stand,
        middle: DVec3,
        depth: f64,
        forward: DVec3,
        near: f64,
    ) -> Option<Self> {
        let to_relative = |corner: DVec3| stand.relative_from_object.transform_point3(corner - middle);
        let corners = wall.corners.map(to_relative);
        if corners.iter().any(|corner| corner.dot(forward) <= near * 1.01) {
            return None;
        }
        // Behind the floor of the relief; object space, where that is straight.
        let from_front = wall.normal.dot(stand.eye + middle - wall.corners[0]);
        if from_front == 0.0 || (from_front < 0.0 && !stand.double_sided) {
            return None;
        }
        let inward = -wall.normal * from_front.signum() * depth * 1.001;
        let [a, b, _, d] = wall.corners.map(|corner| to_relative(corner + inward));
        let across = (b - a).cross(d - a).try_normalize()?;
        let away = if across.dot(a) < 0.0 { -across } else { across };
        let distance = away.dot(a);
        let centre = corners.iter().sum::<DVec3>() / 4.0;
        let sides = [0, 1, 2, 3].map(|at| {
            let side = corners[at].cross(corners[(at + 1) % 4]).normalize_or_zero();
            if side.dot(centre) < 0.0 { -side } else { side }
        });
        if distance.is_nan() || distance <= 0.0 || sides.contains(&DVec3::ZERO) {
            return None;
        }
        let area = (corners[2] - corners[0]).cross(corners[3] - corners[1]).length();
        Some(Self { sides, away, distance, size: area / centre.length_squared() })
    }

    /// Whether a ball relative to the camera is wholly behind. `pixel`: that a unit at distance 1 covers, a share.
    pub fn hides(&self, centre: DVec3, radius: f64, pixel: f64) -> bool {
        let farthest = centre.length() + radius;
        let behind = self.away.dot(centre) - radius > self.distance + farthest * 1e-5;
        // A pixel inside the edges, for what they are rounded by.
        behind && self.sides.iter().all(|side| side.dot(centre) > radius + farthest * pixel)
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;

    #[test]
    fn quads_and_boxes_have_walls_and_round_meshes_none() {
        assert_eq!(walls(&Mesh::quad(1.0).unwrap()).len(), 1);
        assert_eq!(walls(&Mesh::cube(1.0).unwrap()).len(), 6);
        assert!(walls(&Mesh::sphere(0.5, 48).unwrap()).is_empty());
        let mut bent = Mesh::quad(1.0).unwrap();
        bent.positions[0].z += 0.1;
        assert!(walls(&bent).is_empty());
        let mut tilted = Mesh::quad(1.0).unwrap();
        tilted.normals[0] = Vec3::new(0.3, 0.0, 1.0).normalize();
        assert!(walls(&tilted).is_empty());
    }

    #[test]
    fn only_what_is_behind_and_inside_is_hidden() {
        let wall = walls(&Mesh::quad(2.0).unwrap())[0];
        let eye = DVec3::new(0.0, 0.0, 4.0);
        let stand = |turn: DMat4| Stand::new(DMat4::from_translation(-eye) * turn, 1.0, false);
        let screen = |turn, depth| Screen::new(&wall, &stand(turn), DVec3::ZERO, depth, DVec3::NEG_Z, 1e-4);
        let front = screen(DMat4::IDENTITY, 0.2).unwrap();
        let hides = |screen: &Screen, x: f64, z: f64, radius: f64| {
            screen.hides(DVec3::new(x, 0.0, z) - eye, radius, 0.003)
        };
        assert!(hides(&front, 0.0, -1.0, 0.5));
        // Before it, within its relief, beside it, and larger than it.
        assert!(!hides(&front, 0.0, 1.0, 0.5));
        assert!(!hides(&front, 0.0, -0.5, 0.4));
        assert!(!hides(&front, 1.2, -1.0, 0.5));
        assert!(!hides(&front, 0.0, -2.0, 1.6));
        assert!(hides(&front, 1.2, -4.0, 0.5));
        // From behind it is not there; mirrored, it faces as before.
        assert!(screen(DMat4::from_rotation_y(3.0), 0.0).is_none());
        assert!(screen(DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)), 0.0).is_some());
    }
}
