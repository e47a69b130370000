//! What the triangles around a position or along an edge share: one displaced place, whatever their UVs and
//! normals are there.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec2, DVec3, Vec3};

use super::{Cut, EdgeSide, Relief};
use crate::Mesh;
use crate::frame::weld::first_equal;

/// Positions that are the same, and the edges between them.
pub(super) struct Seams {
    /// For each vertex the first one at the same position.
    welded: Vec<u32>,
    /// For each triangle of the range its edges, and whether it runs along them backwards.
    edges_of: Vec<[(u32, bool); 3]>,
    /// For each edge its different sides.
    sides: Vec<Vec<Side>>,
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

/// Where the points of edges and corners are displaced to.
pub(super) struct Rim {
    /// For each vertex of the mesh; those that no triangle uses stay.
    corners: Vec<Vec3>,
    /// The points inside edges, one edge after the other.
    points: Vec<Vec3>,
    /// Where each edge's points begin.
    first: Vec<usize>,
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
                if !known.iter().any(|side| same_side(mesh, side.ends, ends)) {
                    known.push(Side { ends, face, corner, backwards });
                }
                (number, backwards)
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
        self.edges_of[face].map(|(edge, _)| pieces[edge as usize])
    }

    /// Displaces corners and edges. At each place the heights of all sides are averaged, and their normals.
    pub fn displace(&self, mesh: &Mesh, cut: &Cut<'_>, pieces: &[u32], relief: &Relief<'_>) -> Rim {
        let range = cut.range;
        let mut around: HashMap<u32, Vec<u32>> = HashMap::new();
        for &vertex in mesh.indices[range.start as usize..range.end as usize].iter().flatten() {
            let vertices = around.entry(self.welded[vertex as usize]).or_default();
            if !vertices.iter().any(|&known| same_vertex(mesh, known, vertex)) {
                vertices.push(vertex);
            }
        }
        let mut corners: Vec<Vec3> =
            mesh.positions.iter().map(|p| (p.as_dvec3() - cut.origin).as_vec3()).collect();
        for (vertex, corner) in corners.iter_mut().enumerate() {
            let Some(vertices) = around.get(&self.welded[vertex]) else { continue };
            let sides = vertices.iter().map(|&at| {
                let at = at as usize;
                (mesh.uvs[at].as_dvec2(), mesh.normals[at].as_dvec3())
            });
            *corner = (relief.shared(mesh.positions[vertex].as_dvec3(), sides) - cut.origin).as_vec3();
        }
        let mut first = Vec::with_capacity(self.sides.len());
        let mut points = Vec::new();
        for (sides, &pieces) in self.sides.iter().zip(pieces) {
            first.push(points.len());
            let [a, b] = sides[0].ends.map(|end| mesh.positions[end as usize].as_dvec3());
            for k in 1..pieces {
                let share = f64::from(k) / f64::from(pieces);
                let seen = sides.iter().map(|side| side.at(mesh, share));
                points.push((relief.shared(a.lerp(b, share), seen) - cut.origin).as_vec3());
            }
        }
        Rim { corners, points, first }
    }

    /// Micro-triangles of the strips along edges whose sides differ.
    pub fn pieces_of_strips(&self, pieces: &[u32]) -> u64 {
        let parted = self.sides.iter().zip(pieces).filter(|(sides, _)| sides.len() > 1);
        parted.map(|(sides, &pieces)| 2 * sides.len() as u64 * u64::from(pieces)).sum()
    }

    /// The edges whose sides differ, with the number of their pieces, and where they are displaced to from
    /// the first end to the last.
    pub fn parted<'a>(
        &'a self,
        pieces: &'a [u32],
        rim: &'a Rim,
    ) -> impl Iterator<Item = (&'a [Side], Vec<Vec3>)> + 'a {
        self.sides.iter().enumerate().filter(|(_, sides)| sides.len() > 1).map(|(edge, sides)| {
            let [a, b] = sides[0].ends.map(|end| rim.corners[end as usize]);
            let first = rim.first[edge];
            let inside = &rim.points[first..first + pieces[edge] as usize - 1];
            let line = std::iter::once(a).chain(inside.iter().copied()).chain(std::iter::once(b)).collect();
            (sides.as_slice(), line)
        })
    }

    /// Where the points on the rim of a triangle's pattern are: corners, then the points inside its edges.
    pub fn rim_of<'a>(
        &'a self,
        face: usize,
        triangle: [u32; 3],
        pieces: &'a [u32],
        rim: &'a Rim,
    ) -> impl Iterator<Item = Vec3> + 'a {
        let inside = self.edges_of[face].into_iter().flat_map(move |(edge, backwards)| {
            let edge = edge as usize;
            let count = pieces[edge] as usize - 1;
            let run = &rim.points[rim.first[edge]..rim.first[edge] + count];
            (0..count).map(move |k| run[if backwards { count - 1 - k } else { k }])
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
    fn of(mesh: &Mesh, ends: [u32; 2]) -> Self {
        let ends = ends.map(|end| end as usize);
        Self { positions: ends.map(|end| mesh.positions[end]), uvs: ends.map(|end| mesh.uvs[end]) }
    }
}

impl Relief<'_> {
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
