//! MikkTSpace on unindexed corners, kept linear in time and safe from deep recursion.
//!
//! Source: M. S. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008, and his MikkTSpace.
//! The algorithm compares every pair of faces around a vertex, recurses around it, and searches all
//! faces for each degenerate one. Harmless on usual meshes, endless on a fan of a million triangles:
//! so degenerate triangles are set aside and given their neighbours' tangents here, large fans get a
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

/// A tangent for each corner of each triangle; `None` where UVs give none.
pub(super) fn corners(surface: Surface<'_>, warnings: &mut Vec<String>) -> Vec<Option<Vec4>> {
    let welded = weld(surface);
    let good: Vec<u32> = (0..surface.indices.len() as u32)
        .filter(|&face| {
            let [a, b, c] = surface.indices[face as usize].map(|i| surface.positions[i as usize]);
            a != b && b != c && c != a
        })
        .collect();
    let mut faces_at = vec![0u32; surface.positions.len()];
    for &face in &good {
        for vertex in surface.indices[face as usize] {
            faces_at[welded[vertex as usize] as usize] += 1;
        }
    }
    let most = u64::from(faces_at.iter().copied().max().unwrap_or(0));
    let pairs = pairs_at_positions(surface, &good);
    if pairs > PAIRS + PAIRS_PER_TRIANGLE * good.len() as u64 {
        let why = "too many triangles meet at one position for MikkTSpace; per-face tangents used";
        warnings.push(why.to_owned());
        return dietrich::corners(surface);
    }

    let mut job = Job { surface, good: &good, out: vec![None; surface.indices.len() * 3] };
    if !job.run(most) {
        warnings.push("MikkTSpace could not start its thread; per-face tangents used".to_owned());
        return dietrich::corners(surface);
    }
    let mut out = job.out;
    inherit(surface, &welded, &good, &mut out);
    out
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

/// Pairs of faces that meet at a position. Bounds every step that compares pairs: welding looks at
/// all corners of a position, grouping at the faces of a welded vertex.
fn pairs_at_positions(surface: Surface<'_>, good: &[u32]) -> u64 {
    let mut ids: HashMap<[u32; 3], u32> = HashMap::with_capacity(surface.positions.len());
    let place: Vec<u32> = surface
        .positions
        .iter()
        .map(|p| {
            let next = ids.len() as u32;
            *ids.entry((*p + 0.0).to_array().map(f32::to_bits)).or_insert(next)
        })
        .collect();
    let mut faces_at = vec![0u32; ids.len()];
    for &face in good {
        for vertex in surface.indices[face as usize] {
            faces_at[place[vertex as usize] as usize] += 1;
        }
    }
    faces_at.iter().map(|&k| u64::from(k) * u64::from(k)).sum()
}

/// Gives corners of degenerate triangles the tangent of the first sound corner at the same vertex.
fn inherit(surface: Surface<'_>, welded: &[u32], good: &[u32], out: &mut [Option<Vec4>]) {
    if good.len() == surface.indices.len() {
        return;
    }
    let mut source = vec![NONE; welded.len()];
    let mut sound = vec![false; surface.indices.len()];
    for &face in good {
        sound[face as usize] = true;
        for (corner, vertex) in surface.indices[face as usize].iter().enumerate() {
            let slot = &mut source[welded[*vertex as usize] as usize];
            if *slot == NONE {
                *slot = face * 3 + corner as u32;
            }
        }
    }
    for (face, triangle) in surface.indices.iter().enumerate().filter(|(face, _)| !sound[*face]) {
        for (corner, &vertex) in triangle.iter().enumerate() {
            let from = source[welded[vertex as usize] as usize];
            if from != NONE {
                out[face * 3 + corner] = out[from as usize];
            }
        }
    }
}

struct Job<'a> {
    surface: Surface<'a>,
    good: &'a [u32],
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
        self.surface.indices[self.good[face] as usize][corner] as usize
    }
}

impl Geometry for Job<'_> {
    fn num_faces(&self) -> usize {
        self.good.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
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
        let slot = &mut self.out[self.good[face] as usize * 3 + corner];
        *slot = found.map(|space| Vec4::from(space.tangent_encoded())).filter(|tangent| {
            // Huge or collapsed triangles leave a tangent of no length, or none at all.
            tangent.is_finite() && (Vec3::length_squared(tangent.truncate()) - 1.0).abs() < 1e-3
        });
    }
}
