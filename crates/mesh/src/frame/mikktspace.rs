//! MikkTSpace on unindexed corners of triangles and quads, linear in time and safe from deep recursion.
//!
//! Source: M. S. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008, and his MikkTSpace.
//! The algorithm compares every pair of faces around a vertex, recurses around it, and searches all
//! faces for each degenerate one. Harmless on usual meshes, endless on a fan of a million triangles:
//! so degenerate faces are set aside and given their neighbours' tangents here, large fans get a
//! larger stack, and absurd ones fall back to per-face frames with a warning.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec3, Vec4};

use super::{Surface, convention, dietrich};

/// Pairs of faces that meet at a position: a fixed allowance, and one for each triangle. A closed
/// mesh of triangles needs about 18 each.
const PAIRS: u64 = 100_000_000;
const PAIRS_PER_TRIANGLE: u64 = 100;

/// Faces around one vertex that the caller's stack is trusted with.
const SHALLOW: u64 = 256;
/// Stack for each face around a vertex. An optimised build was seen to need under 170 bytes.
const STACK_PER_FACE: u64 = 1024;

const NONE: u32 = u32::MAX;

/// Corners of a quad among those of its halves, `abc` and `acd`: the diagonal's stand in both.
const QUAD: [[usize; 2]; 4] = [[0, 3], [1, 1], [2, 4], [5, 5]];

/// A triangle, or the quad it makes with the next one.
#[derive(Clone, Copy)]
struct Face {
    triangle: usize,
    quad: bool,
}

impl Face {
    fn triangles(self) -> usize {
        1 + usize::from(self.quad)
    }

    fn corners(self) -> usize {
        2 + self.triangles()
    }

    /// Where a corner stands among the corners of all triangles, once or twice.
    fn places(self, corner: usize) -> [usize; 2] {
        let within = if self.quad { QUAD[corner] } else { [corner; 2] };
        within.map(|place| self.triangle * 3 + place)
    }

    fn vertex(self, surface: Surface<'_>, corner: usize) -> usize {
        let [place, _] = self.places(corner);
        surface.indices[place / 3][place % 3] as usize
    }
}

/// A tangent for each corner of each triangle; `None` where UVs give none.
pub(super) fn corners(surface: Surface<'_>, warnings: &mut Vec<String>) -> Vec<Option<Vec4>> {
    let welded = weld(surface);
    let faces = sound_faces(surface);
    let most = triangles_at(surface, &faces, &welded).into_iter().max().unwrap_or(0);
    // Bounds every step that compares pairs: welding looks at all corners of a position, grouping at
    // the faces of a welded vertex.
    let pairs: u64 = triangles_at(surface, &faces, &places(surface)).into_iter().map(|k| k * k).sum();
    let triangles: usize = faces.iter().map(|face| face.triangles()).sum();
    if pairs > PAIRS + PAIRS_PER_TRIANGLE * triangles as u64 {
        let why = "too many triangles meet at one position for MikkTSpace; per-face tangents used";
        warnings.push(why.to_owned());
        return dietrich::corners(surface);
    }

    let mut job = Job { surface, faces: &faces, out: vec![None; surface.indices.len() * 3] };
    if !job.run(most) {
        warnings.push("MikkTSpace could not start its thread; per-face tangents used".to_owned());
        return dietrich::corners(surface);
    }
    let mut out = job.out;
    inherit(surface, &welded, &faces, &mut out);
    out
}

/// The quads and triangles that the generator need not search the others for.
fn sound_faces(surface: Surface<'_>) -> Vec<Face> {
    let position = |i: u32| surface.positions[i as usize];
    let is_triangle = |triangle: usize| {
        let [a, b, c] = surface.indices[triangle].map(position);
        a != b && b != c && c != a
    };
    // Whichever diagonal the generator takes, at least one half has no equal corners. Halves with
    // different normals along the diagonal do not share both vertices.
    let is_quad = |triangle: usize| {
        let [i, j, k] = surface.indices[triangle];
        let Some(&[_, _, l]) = surface.indices.get(triangle + 1).filter(|next| next[..2] == [i, k]) else {
            return false;
        };
        let [a, b, c, d] = [i, j, k, l].map(position);
        a != c && b != d && (a != b || c != d) && (b != c || d != a)
    };
    let mut faces = Vec::with_capacity(surface.indices.len());
    let mut triangle = 0;
    while triangle < surface.indices.len() {
        let quad = surface.quads.binary_search(&(triangle as u32)).is_ok() && is_quad(triangle);
        let face = Face { triangle, quad };
        if quad || is_triangle(triangle) {
            faces.push(face);
        }
        triangle += face.triangles();
    }
    faces
}

/// For each vertex, the first one with the same position, normal and UV.
fn weld(surface: Surface<'_>) -> Vec<u32> {
    let mut first: HashMap<[u32; 8], u32> = HashMap::with_capacity(surface.positions.len());
    (0..surface.positions.len())
        .map(|i| {
            let (p, n) = (surface.positions[i] + 0.0, surface.normals[i] + 0.0);
            let [u, v] = convention::v_up(surface.uvs[i]);
            let key = [p.x, p.y, p.z, n.x, n.y, n.z, u, v].map(f32::to_bits);
            match first.entry(key) {
                Entry::Occupied(entry) => *entry.get(),
                Entry::Vacant(entry) => *entry.insert(i as u32),
            }
        })
        .collect()
}

/// For each vertex, a number for its position.
fn places(surface: Surface<'_>) -> Vec<u32> {
    let mut ids: HashMap<[u32; 3], u32> = HashMap::with_capacity(surface.positions.len());
    let number = |p: &Vec3| {
        let next = ids.len() as u32;
        *ids.entry((*p + 0.0).to_array().map(f32::to_bits)).or_insert(next)
    };
    surface.positions.iter().map(number).collect()
}

/// How many triangles can meet at each number: the diagonal of a quad may end at any corner.
fn triangles_at(surface: Surface<'_>, faces: &[Face], numbers: &[u32]) -> Vec<u64> {
    let mut count = vec![0; numbers.len()];
    for face in faces {
        for corner in 0..face.corners() {
            count[numbers[face.vertex(surface, corner)] as usize] += face.triangles() as u64;
        }
    }
    count
}

/// Gives corners of degenerate triangles the tangent of the first sound corner at the same vertex.
fn inherit(surface: Surface<'_>, welded: &[u32], faces: &[Face], out: &mut [Option<Vec4>]) {
    let mut source = vec![NONE; welded.len()];
    let mut sound = vec![false; out.len()];
    for face in faces {
        for corner in 0..face.corners() {
            let places = face.places(corner);
            places.into_iter().for_each(|place| sound[place] = true);
            let slot = &mut source[welded[face.vertex(surface, corner)] as usize];
            if *slot == NONE {
                *slot = places[0] as u32;
            }
        }
    }
    for (place, &vertex) in surface.indices.iter().flatten().enumerate().filter(|(place, _)| !sound[*place]) {
        let from = source[welded[vertex as usize] as usize];
        if from != NONE {
            out[place] = out[from as usize];
        }
    }
}

struct Job<'a> {
    surface: Surface<'a>,
    faces: &'a [Face],
    out: Vec<Option<Vec4>>,
}

impl Job<'_> {
    /// Runs the generator, on a thread with a larger stack when `most` faces share a vertex.
    fn run(&mut self, most: u64) -> bool {
        if most <= SHALLOW {
            return generate_tangents(self).is_ok();
        }
        let stack = (1 << 20) + usize::try_from(most * STACK_PER_FACE).unwrap_or(usize::MAX);
        std::thread::scope(|scope| {
            std::thread::Builder::new()
                .stack_size(stack)
                .spawn_scoped(scope, || generate_tangents(self).is_ok())
                .ok()
                .and_then(|thread| thread.join().ok())
                .unwrap_or(false)
        })
    }

    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.faces[face].vertex(self.surface, corner)
    }
}

impl Geometry for Job<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, face: usize) -> usize {
        self.faces[face].corners()
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        (self.surface.positions[self.vertex(face, corner)] + 0.0).to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        (self.surface.normals[self.vertex(face, corner)] + 0.0).to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        convention::v_up(self.surface.uvs[self.vertex(face, corner)])
    }

    fn set_tangent(&mut self, found: Option<TangentSpace>, face: usize, corner: usize) {
        let tangent = found.map(|space| Vec4::from(space.tangent_encoded())).filter(|tangent| {
            // Huge or collapsed triangles leave a tangent of no length, or none at all.
            tangent.is_finite() && (Vec3::length_squared(tangent.truncate()) - 1.0).abs() < 1e-3
        });
        for place in self.faces[face].places(corner) {
            self.out[place] = tangent;
        }
    }
}
