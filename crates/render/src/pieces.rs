//! Triangles whose normals fan out, cut into pieces over which they turn little.
//!
//! A piece has the interpolated normals of its triangle at its corners, shorter than 1, so that the points
//! `P + rise N` over it are those over the triangle. An edge is cut or not for what it is itself: triangles that share it
//! agree, and their pieces meet corner to corner.

use glam::Vec4;

use crate::triangles::{MeshArrays, beyond};
use crate::uniforms::MeshVertex;

/// Cosine of the widest angle between normals at the ends of an edge that is left whole, 30 degrees.
const NARROW: f32 = 0.866;
/// How often an edge is halved at most.
const MOST_HALVES: u32 = 6;
/// About so many pieces a mesh may have; beyond, edges are halved less often.
const MOST_PIECES: usize = 1 << 22;

fn halfway(a: &MeshVertex, b: &MeshVertex) -> MeshVertex {
    let mid = |a: Vec4, b: Vec4| (a + b) * 0.5;
    MeshVertex {
        place: mid(a.place, b.place),
        up: mid(a.up, b.up),
        dpdu: mid(a.dpdu, b.dpdu),
        dpdv: mid(a.dpdv, b.dpdv),
        dndu: mid(a.dndu, b.dndu),
        dndv: mid(a.dndv, b.dndv),
    }
}

/// A part of a triangle.
struct Piece {
    corners: [u32; 3],
    /// Beyond which of its edges the sheet goes on.
    goes_on: [bool; 3],
    /// Of each corner, of the triangle's second and third.
    weights: [[f32; 2]; 3],
}

impl Piece {
    /// Length of an edge in shares of the triangle's.
    fn length(&self, edge: usize) -> f32 {
        let [a, b] = [self.weights[edge], self.weights[(edge + 1) % 3]];
        let shares = [b[0] - a[0], b[1] - a[1], a[0] + a[1] - b[0] - b[1]];
        shares.iter().fold(0.0, |longest: f32, share| longest.max(share.abs()))
    }

    /// Both sides of a cut from the middle of an edge to the corner across.
    fn cut(&self, edge: usize, middle: u32) -> [Self; 2] {
        let [from, to, across] = [edge, (edge + 1) % 3, (edge + 2) % 3];
        let [a, b] = [self.weights[from], self.weights[to]];
        let half = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let first = Self {
            corners: [self.corners[from], middle, self.corners[across]],
            goes_on: [self.goes_on[from], true, self.goes_on[across]],
            weights: [a, half, self.weights[across]],
        };
        let second = Self {
            corners: [middle, self.corners[to], self.corners[across]],
            goes_on: [self.goes_on[from], self.goes_on[to], true],
            weights: [half, b, self.weights[across]],
        };
        [first, second]
    }
}

/// Cosine between the normals at two vertices; 1 where one of them has none.
fn cosine(a: &MeshVertex, b: &MeshVertex) -> f32 {
    let [a, b] = [a, b].map(|vertex| vertex.up.truncate().normalize_or_zero());
    if a.length_squared() > 0.0 && b.length_squared() > 0.0 { a.dot(b) } else { 1.0 }
}

impl MeshArrays {
    /// Cuts what is to be cut and appends vertices and pieces. `goes_on`: for each triangle beyond which of its edges its
    /// sheet goes on.
    pub(crate) fn cut(&mut self, goes_on: &[[bool; 3]]) {
        let widest = |arrays: &Self, [a, b, c]: [u32; 3]| {
            let at = |corner: u32| &arrays.vertices[corner as usize];
            [(a, b), (b, c), (c, a)].map(|(a, b)| cosine(at(a), at(b)))
        };
        let wide: Vec<usize> = (0..self.triangles.len())
            .filter(|&face| {
                let [a, b, c, _] = self.triangles[face];
                widest(self, [a, b, c]).iter().any(|&cosine| cosine < NARROW)
            })
            .collect();
        let most = (MOST_PIECES / wide.len().max(1)).max(1).ilog2() / 2;
        let shortest = 0.75 * 0.5_f32.powi(most.min(MOST_HALVES) as i32 - 1);
        for face in wide {
            let [a, b, c, of] = self.triangles[face];
            let first = self.triangles.len() as u32;
            let weights = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
            let mut open = vec![Piece { corners: [a, b, c], goes_on: goes_on[face], weights }];
            while let Some(piece) = open.pop() {
                let cosines = widest(self, piece.corners);
                let cut = (0..3)
                    .filter(|&edge| cosines[edge] < NARROW && piece.length(edge) > shortest)
                    .min_by(|&a, &b| cosines[a].total_cmp(&cosines[b]));
                let [a, b, c] = piece.corners;
                let Some(edge) = cut else {
                    self.triangles.push([a, b, c, beyond(of, piece.goes_on)]);
                    continue;
                };
                let ends = [piece.corners[edge], piece.corners[(edge + 1) % 3]].map(|end| end as usize);
                let middle = halfway(&self.vertices[ends[0]], &self.vertices[ends[1]]);
                self.vertices.push(middle);
                open.extend(piece.cut(edge, self.vertices.len() as u32 - 1));
            }
            self.pieces.insert(face as u32, first..self.triangles.len() as u32);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use glam::DVec3;
    use mesh::Mesh;

    use super::*;
    use crate::geometry::CUBOID;

    /// A cube with one normal a corner.
    fn smooth_cube() -> Mesh {
        let corners = [0, 1, 2, 3, 4, 5, 6, 7];
        let place = |bits: u32| [0, 1, 2].map(|axis| (bits >> axis & 1) as f32 - 0.5);
        let uvs = corners.map(|bits: u32| [(bits & 1) as f32, (bits >> 1 & 3) as f32 / 3.0]);
        Mesh::from_arrays(&corners.map(place), &CUBOID, &uvs, None, None).unwrap()
    }

    #[test]
    fn pieces_turn_little_and_meet_corner_to_corner() {
        let mesh = smooth_cube();
        let arrays = MeshArrays::new(&mesh, DVec3::ZERO);
        assert_eq!(arrays.pieces.len(), 12);
        let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
        let mut area = 0.0;
        for piece in arrays.pieces.values().cloned().flatten() {
            let [a, b, c, bits] = arrays.triangles[piece as usize];
            let places = [a, b, c].map(|at| arrays.vertices[at as usize].place.truncate());
            area += 0.5 * (places[1] - places[0]).cross(places[2] - places[0]).length();
            for edge in 0..3 {
                let ends = [[a, b, c][edge], [a, b, c][(edge + 1) % 3]];
                let [from, to] = ends.map(|at| &arrays.vertices[at as usize]);
                assert!(cosine(from, to) >= NARROW);
                let [from, to] =
                    ends.map(|at| arrays.vertices[at as usize].place.truncate().to_array().map(f32::to_bits));
                let turned = from > to;
                *edges.entry(if turned { [to, from] } else { [from, to] }).or_default() +=
                    if turned { -1 } else { 1 };
                assert!(bits >> (29 + edge) & 1 == 1, "a closed sheet goes on everywhere");
            }
        }
        assert!((area - 6.0).abs() < 1e-4, "{area}");
        // Each edge once in either direction.
        assert!(edges.values().all(|&sum| sum == 0));
    }

    #[test]
    fn what_turns_little_is_left_whole() {
        let mesh = Mesh::sphere(1.0, 24).unwrap();
        let arrays = MeshArrays::new(&mesh, DVec3::ZERO);
        assert!(arrays.pieces.is_empty());
        assert_eq!(arrays.triangles.len(), mesh.indices.len());
    }

    #[test]
    fn opposite_normals_and_many_triangles_come_to_an_end() {
        let count = 20_000;
        let positions = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].repeat(count);
        let normals = [[0.0_f32, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]].repeat(count);
        let uvs = [[0.0_f32, 0.0], [1.0, 0.0], [0.0, 1.0]].repeat(count);
        let indices: Vec<[u32; 3]> = (0..count as u32).map(|at| [0, 1, 2].map(|k| 3 * at + k)).collect();
        let mesh = Mesh::from_arrays(&positions, &indices, &uvs, Some(&normals), None).unwrap();
        let arrays = MeshArrays::new(&mesh, DVec3::ZERO);
        assert!(arrays.triangles.len() < 2 * MOST_PIECES, "{}", arrays.triangles.len());
        assert!(arrays.pieces.len() == count);
    }
}
