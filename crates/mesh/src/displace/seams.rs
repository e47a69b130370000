//! What the triangles around a position or along an edge share: one displaced place, whatever their UVs and
//! normals are there.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::{EdgeSide, Relief};
use crate::Mesh;
use crate::frame::weld::first_equal;

/// Positions that are the same, and the edges between them.
pub(super) struct Seams {
    /// For each vertex the first one at the same position.
    welded: Vec<u32>,
    /// For each triangle of the range how it sees its edges.
    edges_of: Vec<[EdgeUse; 3]>,
    /// For each edge its different sides.
    sides: Vec<Vec<Side>>,
}

/// How a triangle sees one of its edges.
#[derive(Debug, Clone, Copy)]
struct EdgeUse {
    edge: u32,
    /// Which of its sides.
    side: u32,
    /// Whether it runs along it backwards.
    backwards: bool,
}

/// One of the different ways in which the triangles along an edge see it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    /// The vertices at its ends, in the order of the edge.
    pub ends: [u32; 2],
    /// A triangle that sees it so.
    pub face: u32,
    /// The corner of the triangle at which the edge begins for it.
    pub corner: usize,
    /// Whether the triangle runs along it backwards.
    pub backwards: bool,
}

/// Where the rims of triangles are displaced to, each side of an edge for itself.
pub(super) struct Rim {
    /// For each vertex of the mesh.
    corners: Vec<Vec3>,
    /// The points inside edges, one edge after the other, one side after the other.
    points: Vec<Vec3>,
    /// Where each edge's points begin.
    first: Vec<usize>,
}

/// A strip from where one side of an edge is displaced to where all of them meet.
pub(super) struct Strip<'a> {
    pub side: &'a Side,
    /// Shares of the edge, from 0 to 1.
    pub shares: &'a [f64],
    /// At each share where the side is displaced to.
    pub own: Vec<Vec3>,
    /// And where the sides meet.
    pub meeting: Vec<Vec3>,
}

impl Seams {
    pub fn new(mesh: &Mesh, range: &Range<u32>) -> Self {
        // Adding zero turns -0 into 0.
        let welded = first_equal(mesh.positions.len(), |at| {
            (mesh.positions[at] + Vec3::ZERO).to_array().map(f32::to_bits)
        });
        let mut numbers: HashMap<[u32; 2], u32> = HashMap::new();
        let mut sides: Vec<Vec<Side>> = Vec::new();
        let mut edges_of = Vec::with_capacity(range.len());
        for face in range.clone() {
            let triangle = mesh.indices[face as usize];
            edges_of.push([0, 1, 2].map(|corner| {
                let mut ends = [triangle[corner], triangle[(corner + 1) % 3]];
                let backwards = welded[ends[0] as usize] > welded[ends[1] as usize];
                if backwards {
                    ends.reverse();
                }
                let key = ends.map(|end| welded[end as usize]);
                let number = *numbers.entry(key).or_insert_with(|| {
                    sides.push(Vec::new());
                    sides.len() as u32 - 1
                });
                let known = &mut sides[number as usize];
                let side =
                    known.iter().position(|side| same_side(mesh, side.ends, ends)).unwrap_or_else(|| {
                        known.push(Side { ends, face, corner, backwards });
                        known.len() - 1
                    });
                EdgeUse { edge: number, side: side as u32, backwards }
            }));
        }
        Self { welded, edges_of, sides }
    }

    /// Pieces of each edge: as many as the most demanding of its sides asks for.
    pub fn pieces(&self, mesh: &Mesh, segments: &(dyn Fn(&EdgeSide) -> u32 + Sync)) -> Vec<u32> {
        let of_side = |side: &Side| segments(&EdgeSide::of(mesh, side.ends)).max(1);
        self.sides.iter().map(|sides| sides.iter().map(of_side).max().unwrap_or(1)).collect()
    }

    /// Pieces of the edges of a triangle, counted within the range.
    pub fn pieces_of(&self, face: usize, pieces: &[u32]) -> [u32; 3] {
        self.edges_of[face].map(|seen| pieces[seen.edge as usize])
    }

    /// Displaces corners and edges, each side for itself.
    pub fn displace(&self, mesh: &Mesh, origin: DVec3, pieces: &[u32], relief: &Relief<'_>) -> Rim {
        let corners =
            (0..mesh.positions.len()).into_par_iter().map(|at| relief.corner(mesh, at, origin)).collect();
        let mut first = Vec::with_capacity(self.sides.len());
        let mut points = Vec::new();
        for (sides, &pieces) in self.sides.iter().zip(pieces) {
            first.push(points.len());
            for side in sides {
                let share = |k: u32| f64::from(k) / f64::from(pieces);
                points.extend((1..pieces).map(|k| relief.along(mesh, &[*side], share(k), origin)));
            }
        }
        Rim { corners, points, first }
    }

    /// The edges whose sides differ, by their numbers.
    pub fn parted(&self) -> impl Iterator<Item = usize> + '_ {
        self.sides.iter().enumerate().filter(|(_, sides)| sides.len() > 1).map(|(edge, _)| edge)
    }

    /// The sides of an edge.
    pub fn sides(&self, edge: usize) -> &[Side] {
        &self.sides[edge]
    }

    /// For each place of the range that several vertices share where they meet: by the mean of their heights along
    /// the mean of their normals. By the first of the vertices there.
    pub fn meetings(
        &self,
        mesh: &Mesh,
        range: &Range<u32>,
        origin: DVec3,
        relief: &Relief<'_>,
    ) -> HashMap<u32, Vec3> {
        let mut around: HashMap<u32, Vec<u32>> = HashMap::new();
        for &vertex in mesh.indices[range.start as usize..range.end as usize].iter().flatten() {
            let vertices = around.entry(self.welded[vertex as usize]).or_default();
            if !vertices.iter().any(|&known| same_vertex(mesh, known, vertex)) {
                vertices.push(vertex);
            }
        }
        let meeting = |(place, vertices): (u32, Vec<u32>)| {
            let sides = vertices.iter().map(|&at| {
                let at = at as usize;
                (mesh.uvs[at].as_dvec2(), mesh.normals[at].as_dvec3())
            });
            let position = mesh.positions[place as usize].as_dvec3();
            (place, (relief.shared(position, sides) - origin).as_vec3())
        };
        around.into_iter().map(meeting).collect()
    }

    /// The strips along one edge, cut at `shares`.
    pub fn strips<'a>(
        &'a self,
        mesh: &Mesh,
        edge: usize,
        shares: &'a [f64],
        meetings: &HashMap<u32, Vec3>,
        origin: DVec3,
        relief: &Relief<'_>,
    ) -> impl Iterator<Item = Strip<'a>> {
        let sides = &self.sides[edge];
        let last = shares.len() - 1;
        let line = |side: Option<&Side>| -> Vec<Vec3> {
            let point = |(k, &share): (usize, &f64)| {
                // The ends are where whole vertices go, to the last bit.
                let end = side.unwrap_or(&sides[0]).ends[usize::from(k == last)];
                match (k == 0 || k == last, side) {
                    (true, Some(_)) => relief.corner(mesh, end as usize, origin),
                    (true, None) => meetings.get(&self.welded[end as usize]).copied().unwrap_or_default(),
                    (false, Some(side)) => relief.along(mesh, &[*side], share, origin),
                    (false, None) => relief.along(mesh, sides, share, origin),
                }
            };
            shares.iter().enumerate().map(point).collect()
        };
        let meeting = line(None);
        let strips: Vec<_> = sides
            .iter()
            .map(|side| Strip { side, shares, own: line(Some(side)), meeting: meeting.clone() })
            .collect();
        strips.into_iter()
    }

    /// Where the points on the rim of a triangle's pattern are: corners, then the points inside its edges.
    pub fn rim_of<'a>(
        &'a self,
        face: usize,
        triangle: [u32; 3],
        pieces: &'a [u32],
        rim: &'a Rim,
    ) -> impl Iterator<Item = Vec3> + 'a {
        let inside = self.edges_of[face].into_iter().flat_map(move |seen| {
            let edge = seen.edge as usize;
            let count = pieces[edge] as usize - 1;
            let first = rim.first[edge] + seen.side as usize * count;
            let run = &rim.points[first..first + count];
            (0..count).map(move |k| run[if seen.backwards { count - 1 - k } else { k }])
        });
        triangle.into_iter().map(|corner| rim.corners[corner as usize]).chain(inside)
    }
}

fn same_vertex(mesh: &Mesh, a: u32, b: u32) -> bool {
    let (a, b) = (a as usize, b as usize);
    a == b || (mesh.uvs[a] == mesh.uvs[b] && mesh.normals[a] == mesh.normals[b])
}

fn same_side(mesh: &Mesh, a: [u32; 2], b: [u32; 2]) -> bool {
    same_vertex(mesh, a[0], b[0]) && same_vertex(mesh, a[1], b[1])
}

impl Side {
    /// UV and normal, of any length, at a share of the edge.
    pub fn at(&self, mesh: &Mesh, share: f64) -> (DVec2, DVec3) {
        let [a, b] = self.ends.map(|end| end as usize);
        let uv = mesh.uvs[a].as_dvec2().lerp(mesh.uvs[b].as_dvec2(), share);
        (uv, mesh.normals[a].as_dvec3().lerp(mesh.normals[b].as_dvec3(), share))
    }
}

impl EdgeSide {
    pub(super) fn of(mesh: &Mesh, ends: [u32; 2]) -> Self {
        let ends = ends.map(|end| end as usize);
        Self { positions: ends.map(|end| mesh.positions[end]), uvs: ends.map(|end| mesh.uvs[end]) }
    }
}

impl Relief<'_> {
    /// Where a vertex is displaced to.
    fn corner(&self, mesh: &Mesh, vertex: usize, origin: DVec3) -> Vec3 {
        let side = (mesh.uvs[vertex].as_dvec2(), mesh.normals[vertex].as_dvec3());
        (self.shared(mesh.positions[vertex].as_dvec3(), std::iter::once(side)) - origin).as_vec3()
    }

    /// Where the sides of an edge meet at a share of it.
    fn along(&self, mesh: &Mesh, sides: &[Side], share: f64, origin: DVec3) -> Vec3 {
        let [a, b] = sides[0].ends.map(|end| mesh.positions[end as usize].as_dvec3());
        let seen = sides.iter().map(|side| side.at(mesh, share));
        (self.shared(a.lerp(b, share), seen) - origin).as_vec3()
    }

    /// The one place of a point that several sides share.
    pub(super) fn shared(&self, position: DVec3, sides: impl Iterator<Item = (DVec2, DVec3)>) -> DVec3 {
        let (mut height, mut normal, mut count) = (0.0, DVec3::ZERO, 0.0);
        for (uv, side_normal) in sides {
            height += (self.height)(uv.x, uv.y);
            normal += side_normal.normalize_or_zero();
            count += 1.0;
        }
        let rise = self.scale * (height / f64::max(count, 1.0) - self.base);
        position + rise * normal.normalize_or_zero()
    }
}
