//! Which draws are sorted by the depth of their meshes alone.
//!
//! What a search finds may lie behind what stands behind the mesh, so its depth is only known after the march, and
//! hidden fragments march too. Where a plane parts a draw from all others no ray meets what they show in turns:
//! whichever mesh is nearer shows, and the device throws the others' fragments away before they march. That is so
//! where what a draw shows stays within its box, to which `shading/relief.wgsl` holds the depths that it sorts by, and
//! where no ray meets its mesh twice.

use std::collections::HashMap;

use glam::{DMat4, DVec3, Vec3};
use mesh::Mesh;

use crate::geometry::Room;
use crate::prepare::address;
use crate::{Draw, Material};

/// Draws of a scene that are compared with one another at most.
const MOST_DRAWS: usize = 256;
/// Triangles times vertices of a mesh that is looked at.
const MOST_PAIRS: usize = 1 << 26;
/// How far a vertex may be before the plane of a triangle, as a share of the mesh.
const BEFORE: f32 = 1e-5;
/// How far two boxes may reach into each other and count as side by side, as a share of both: what touches.
const TOUCH: f64 = 1e-6;

/// The box around what a draw shows, in the space of its centred mesh: the mesh moved along its normals to the lid and
/// to the floor of the relief.
fn shown(mesh: &Mesh, middle: DVec3, material: &Material) -> [Vec3; 2] {
    let extent = material.field.extent();
    let ends = [extent.scale * (1.0 - extent.base), -extent.scale * extent.base];
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let place = (position.as_dvec3() - middle).as_vec3();
        let normal = normal.normalize_or_zero();
        // Backs have their relief on their own side.
        let sides: &[f32] = if material.double_sided { &[1.0, -1.0] } else { &[1.0] };
        for point in ends.iter().flat_map(|end| sides.iter().map(move |side| place + normal * (end * side))) {
            (low, high) = (low.min(point), high.max(point));
        }
        (low, high) = (low.min(place), high.max(place));
    }
    // What f32 rounds off.
    let rounding = Vec3::splat((high - low).max_element() * 1e-6);
    [low - rounding, high + rounding]
}

/// Whether no ray meets the fronts of a mesh twice: no vertex is before the plane of a triangle.
fn is_convex(mesh: &Mesh) -> bool {
    let (low, high) = mesh
        .positions
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), place| (low.min(*place), high.max(*place)));
    let before = BEFORE * (high - low).max_element();
    mesh.indices.len().saturating_mul(mesh.positions.len()) <= MOST_PAIRS
        && mesh.indices.iter().all(|triangle| {
            let [a, b, c] = triangle.map(|at| mesh.positions[at as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let farthest = mesh.positions.iter().map(|place| normal.dot(*place - a)).fold(0.0, f32::max);
            farthest <= before
        })
}

/// A box with a place in the world.
struct Placed {
    corners: [DVec3; 8],
    /// Of its faces, and along its edges.
    normals: [DVec3; 3],
    edges: [DVec3; 3],
}

impl Placed {
    fn new([low, high]: [Vec3; 2], world_from_object: DMat4) -> Self {
        let corner = |bits: usize| {
            let of = |axis: usize| f64::from([low, high][bits >> axis & 1][axis]);
            world_from_object.transform_point3(DVec3::new(of(0), of(1), of(2)))
        };
        let edges = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| world_from_object.transform_vector3(axis));
        let [x, y, z] = edges;
        Self { corners: std::array::from_fn(corner), normals: [y.cross(z), z.cross(x), x.cross(y)], edges }
    }

    fn along(&self, axis: DVec3) -> [f64; 2] {
        let [first, others @ ..] = self.corners.map(|corner| corner.dot(axis));
        others.iter().fold([first; 2], |[low, high], &at| [low.min(at), high.max(at)])
    }

    /// Whether a plane parts the two: if one does, so does one along a face of either or along an edge of both
    /// (Gottschalk, Lin and Manocha, "OBBTree", SIGGRAPH 1996).
    fn is_apart_from(&self, other: &Self) -> bool {
        let parts = |axis: DVec3| {
            let ([low, high], [other_low, other_high]) = (self.along(axis), other.along(axis));
            let touch = TOUCH * (high - low + other_high - other_low);
            axis.length_squared() > 0.0 && (low >= other_high - touch || other_low >= high - touch)
        };
        let crossed = self.edges.iter().flat_map(|edge| other.edges.iter().map(|other| edge.cross(*other)));
        self.normals.iter().chain(&other.normals).copied().chain(crossed).any(parts)
    }
}

/// What decides in what order the draws of a scene are drawn and which of them shows. From wherever it is seen: it is
/// found once.
#[derive(Debug, Default)]
pub(crate) struct Sorting {
    /// The box around what each draw shows, space of its centred mesh.
    pub shown: Vec<[Vec3; 2]>,
    /// Whether each is sorted by its mesh.
    pub apart: Vec<bool>,
}

impl Sorting {
    /// Of the draws of a scene. `rooms`: of their meshes; `by_mesh`: whether any may be sorted by its mesh.
    pub fn of(draws: &[Draw<'_>], rooms: &HashMap<usize, Room>, by_mesh: bool) -> Self {
        let middle =
            |draw: &Draw<'_>| rooms.get(&address(&draw.mesh)).map_or(DVec3::ZERO, |room| room.middle);
        let mut known = HashMap::new();
        let mut box_of = |draw: &Draw<'_>| {
            let extent = draw.material.field.extent();
            let looks = (extent.scale.to_bits(), extent.base.to_bits(), draw.material.double_sided);
            let key = (address(&draw.mesh), looks);
            *known.entry(key).or_insert_with(|| shown(&draw.mesh, middle(draw), &draw.material))
        };
        let shown: Vec<_> = draws.iter().map(&mut box_of).collect();
        if !by_mesh || !(2..=MOST_DRAWS).contains(&draws.len()) {
            return Self { apart: vec![false; draws.len()], shown };
        }
        let placed: Vec<Placed> = (draws.iter().zip(&shown))
            .map(|(draw, &shown)| {
                Placed::new(shown, draw.world_from_object * DMat4::from_translation(middle(draw)))
            })
            .collect();
        let mut convex = HashMap::new();
        let mut by_mesh = |at: usize| {
            let mesh = &draws[at].mesh;
            !draws[at].material.double_sided
                && (0..placed.len()).all(|other| other == at || placed[at].is_apart_from(&placed[other]))
                && *convex.entry(address(mesh)).or_insert_with(|| is_convex(mesh))
        };
        Self { apart: (0..draws.len()).map(&mut by_mesh).collect(), shown }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_dents_is_not_convex() {
        for mesh in [Mesh::quad(1.0), Mesh::cube(1.0), Mesh::sphere(0.5, 48)] {
            assert!(is_convex(&mesh.unwrap()));
        }
        let mut dented = Mesh::sphere(0.5, 48).unwrap();
        assert!(!is_convex(&Mesh::torus(0.5, 0.2, 48, 24).unwrap()));
        dented.positions[700] *= 0.99;
        assert!(!is_convex(&dented));
    }

    #[test]
    fn boxes_are_apart_where_a_plane_parts_them() {
        let cube = [Vec3::splat(-0.5), Vec3::splat(0.5)];
        let still = Placed::new(cube, DMat4::IDENTITY);
        let moved = |x, y, z| Placed::new(cube, DMat4::from_translation(DVec3::new(x, y, z)));
        assert!(still.is_apart_from(&moved(1.2, 0.0, 0.0)) && moved(1.2, 0.0, 0.0).is_apart_from(&still));
        // Touching, overlapping, one in the other.
        assert!(still.is_apart_from(&moved(0.0, 1.0, 0.0)));
        assert!(!still.is_apart_from(&moved(0.0, 0.99, 0.9)));
        let small = Placed::new(cube, DMat4::from_scale(DVec3::splat(0.1)));
        assert!(!still.is_apart_from(&small) && !small.is_apart_from(&still));
        // Two edges across each other: only their own plane parts them, and a flat box has a direction without length.
        let turned = |place, x: f64, y: f64| {
            Placed::new(
                cube,
                DMat4::from_translation(place) * DMat4::from_rotation_x(x) * DMat4::from_rotation_y(y),
            )
        };
        let one = turned(DVec3::ZERO, 0.785, 0.0);
        let away = std::f64::consts::SQRT_2;
        let other = |distance: f64| {
            let place = DMat4::from_translation(DVec3::Z * distance) * DMat4::from_rotation_y(0.785);
            Placed::new(cube, place)
        };
        assert!(one.is_apart_from(&other(away + 0.01)));
        assert!(!one.is_apart_from(&other(away - 0.01)));
        let flat = Placed::new([Vec3::new(-0.5, -0.5, 0.0), Vec3::new(0.5, 0.5, 0.0)], DMat4::IDENTITY);
        assert!(flat.is_apart_from(&moved(0.0, 0.0, 0.6)) && !flat.is_apart_from(&moved(0.0, 0.0, 0.4)));
    }
}
