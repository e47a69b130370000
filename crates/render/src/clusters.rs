//! Triangles in groups of neighbours, each with bounds: what is culled is culled by the group.
//!
//! Triangles are halved by place and by where they face, whichever differs more, until they fit. Each group has a ball
//! around it and a cone around its triangles' normals (Shirman and Abi-Ezzi, "The cone of normals technique for fast
//! processing of curved patches", Eurographics 1993).

use std::ops::Range;

use glam::{DVec3, Vec3};
use mesh::Mesh;
use rayon::prelude::*;

/// Triangles in a group at most.
pub(crate) const GROUP: usize = 64;

/// A group of triangles that stand side by side.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cluster {
    /// Its triangles, first and end, in the order of [`Clusters::triangles`].
    pub first: u32,
    pub end: u32,
    /// Middle of the ball around it, in the space of the centred mesh.
    pub centre: DVec3,
    pub radius: f64,
    /// Unit axis of the cone around the normals of its triangles.
    pub axis: DVec3,
    /// Cosine of half the cone's opening; -1 where the normals point all ways.
    pub cos_spread: f64,
    /// Least height of a triangle over its longest edge, mesh units; 0 where one has no area.
    pub least_height: f64,
}

/// A run of triangles in groups.
#[derive(Debug)]
pub(crate) struct Clusters {
    /// The triangles, put into the order of the groups.
    pub triangles: Vec<[u32; 3]>,
    pub groups: Vec<Cluster>,
}

impl Clusters {
    /// Groups a run of a mesh's triangles. `centre`: the middle of the mesh.
    pub fn new(mesh: &Mesh, run: Range<u32>, centre: DVec3) -> Self {
        let mut triangles = mesh.indices[run.start as usize..run.end as usize].to_vec();
        if triangles.len() > GROUP {
            sort_into_groups(mesh, &mut triangles);
        }
        let groups = triangles
            .par_chunks(GROUP)
            .enumerate()
            .map(|(at, group)| cluster(mesh, group, (at * GROUP) as u32, centre))
            .collect();
        Self { triangles, groups }
    }
}

fn corners(mesh: &Mesh, triangle: [u32; 3]) -> [Vec3; 3] {
    triangle.map(|at| mesh.positions[at as usize])
}

/// Where a triangle is and where it faces: middle and unit normal, as six coordinates.
type Point = [f32; 6];

/// Share of the mesh's size that counts as much as turning a normal by 57 degrees.
const TURN: f32 = 0.3;

/// Puts triangles that stand side by side and face alike next to one another: halves them along the widest of their
/// six coordinates until they fit into groups.
fn sort_into_groups(mesh: &Mesh, triangles: &mut Vec<[u32; 3]>) {
    let mut points: Vec<Point> = triangles
        .par_iter()
        .map(|&triangle| {
            let [a, b, c] = corners(mesh, triangle);
            let (middle, normal) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero());
            [middle.x, middle.y, middle.z, normal.x, normal.y, normal.z]
        })
        .collect();
    let (low, high) = span(points.iter());
    let size = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f32::max);
    points.par_iter_mut().for_each(|point| point[3..].iter_mut().for_each(|part| *part *= TURN * size));
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    halve(&points, &mut order);
    *triangles = order.iter().map(|&at| triangles[at as usize]).collect();
}

fn span<'a>(points: impl Iterator<Item = &'a Point>) -> (Point, Point) {
    points.fold(([f32::INFINITY; 6], [f32::NEG_INFINITY; 6]), |(mut low, mut high), point| {
        for axis in 0..6 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
        (low, high)
    })
}

fn halve(points: &[Point], order: &mut [u32]) {
    if order.len() <= GROUP {
        return;
    }
    let (low, high) = span(order.iter().map(|&at| &points[at as usize]));
    let width = |axis: &usize| high[*axis] - low[*axis];
    let axis = (0..6).max_by(|a, b| width(a).total_cmp(&width(b))).unwrap_or(0);
    // Whole groups on the left, so that all but the last are full.
    let half = (order.len().div_ceil(GROUP) / 2) * GROUP;
    let place = |at: &u32| points[*at as usize][axis];
    order.select_nth_unstable_by(half, |a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
    let (left, right) = order.split_at_mut(half);
    rayon::join(|| halve(points, left), || halve(points, right));
}

fn cluster(mesh: &Mesh, group: &[[u32; 3]], first: u32, middle: DVec3) -> Cluster {
    let points = |triangle: &[u32; 3]| corners(mesh, *triangle).map(|corner| corner.as_dvec3() - middle);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (mut sum, mut least_height) = (DVec3::ZERO, f64::INFINITY);
    for [a, b, c] in group.iter().map(points) {
        low = low.min(a).min(b).min(c);
        high = high.max(a).max(b).max(c);
        // Two corners in one place stay there when they are rounded: such triangles are never seen.
        if a == b || b == c || c == a {
            continue;
        }
        let across = (b - a).cross(c - a);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        sum += across.normalize_or_zero();
        least_height = least_height.min(across.length() / longest);
    }
    let centre = (low + high) * 0.5;
    let axis = sum.normalize_or_zero();
    let (mut radius, mut cos_spread) = (0.0_f64, 1.0_f64);
    for [a, b, c] in group.iter().map(points) {
        radius = [a, b, c].iter().map(|corner| corner.distance(centre)).fold(radius, f64::max);
        if a == b || b == c || c == a {
            continue;
        }
        cos_spread = cos_spread.min((b - a).cross(c - a).normalize_or_zero().dot(axis));
    }
    if axis == DVec3::ZERO {
        cos_spread = -1.0;
    }
    // What f32 rounds off positions when they are centred.
    radius += high.abs().max(low.abs()).max_element() * 1e-6;
    let end = first + group.len() as u32;
    Cluster { first, end, centre, radius, axis, cos_spread, least_height }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_triangle_is_in_one_group_and_within_its_bounds() {
        for mesh in [
            Mesh::sphere(0.5, 48).unwrap(),
            Mesh::torus(0.4, 0.2, 64, 32).unwrap(),
            Mesh::quad(1.0).unwrap(),
            Mesh::cube(1.0).unwrap(),
        ] {
            let count = mesh.indices.len();
            let centre = DVec3::new(0.1, -0.2, 0.3);
            let clusters = Clusters::new(&mesh, 0..count as u32, centre);
            let mut sorted = clusters.triangles.clone();
            let mut given = mesh.indices.clone();
            sorted.sort_unstable();
            given.sort_unstable();
            assert_eq!(sorted, given);
            assert_eq!(clusters.groups.len(), count.div_ceil(GROUP));
            let mut next = 0;
            for group in &clusters.groups {
                assert_eq!(group.first, next);
                next = group.end;
                for &triangle in &clusters.triangles[group.first as usize..group.end as usize] {
                    let [a, b, c] = corners(&mesh, triangle).map(|corner| corner.as_dvec3() - centre);
                    for corner in [a, b, c] {
                        assert!(corner.distance(group.centre) <= group.radius);
                    }
                    let across = (b - a).cross(c - a);
                    if a == b || b == c || c == a {
                        continue;
                    }
                    assert!(across.normalize_or_zero().dot(group.axis) >= group.cos_spread - 1e-12);
                    assert!(across.length() / a.distance(b) >= group.least_height * 0.999);
                }
            }
            assert_eq!(next as usize, count);
            // Neighbours stand together: groups are small, and face one way.
            if count > 20 * GROUP {
                let share = |size: fn(&Cluster) -> f64| {
                    clusters.groups.iter().map(size).sum::<f64>() / clusters.groups.len() as f64
                };
                assert!(share(|group| group.radius) < 0.3, "{}", share(|group| group.radius));
                assert!(share(|group| group.cos_spread) > 0.7, "{}", share(|group| group.cos_spread));
            }
        }
        assert!(Clusters::new(&Mesh::quad(1.0).unwrap(), 1..1, DVec3::ZERO).groups.is_empty());
    }
}
