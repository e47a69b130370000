//! Displacement: a mesh cut into micro-polygons that are moved along its normals by a height.
//!
//! `P* = P + scale (h - base) N` with `P`, the UVs and the normal interpolated over each triangle and the
//! normal made unit. Where vertices share a position, or triangles an edge, but differ in UVs or normals, strips
//! run from where each of them is displaced to the place where they meet: by the mean of their heights along the
//! mean of their normals. So UV seams, mirrored charts and hard edges leave no gap, and what closes them does not
//! depend on how finely the mesh is cut.
//!
//! Sources: Cook, "Shade Trees", SIGGRAPH 1984; Cook, Carpenter and Catmull, "The Reyes Image Rendering
//! Architecture", SIGGRAPH 1987 (micro-polygons below a pixel); Moule and McCool, "Efficient Bounded Adaptive
//! Tessellation of Displacement Maps", Graphics Interface 2002 (numbers of pieces that belong to edges).

mod bridges;
mod pattern;
mod seams;

use std::ops::Range;

use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;

pub use self::bridges::bridges;
use self::seams::Seams;
use crate::{Mesh, MeshError};

/// Most micro-triangles of one displaced mesh.
pub const MAX_MICRO_TRIANGLES: u64 = 1 << 25;

/// By what a mesh is displaced.
#[derive(Clone, Copy)]
pub struct Relief<'a> {
    /// Height in 0..1 at `(u, v)`.
    pub height: &'a (dyn Fn(f64, f64) -> f64 + Sync),
    /// Mesh units between height 0 and height 1.
    pub scale: f64,
    /// The height that stays on the mesh.
    pub base: f64,
}

/// An edge as one of the triangles along it sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSide {
    /// Positions of its ends, mesh units.
    pub positions: [Vec3; 2],
    /// Texture coordinates of its ends.
    pub uvs: [Vec2; 2],
}

/// Micro-polygons. Vertices carry what the undisplaced mesh has there, and where they were moved to.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Displaced {
    /// Displaced positions, mesh units. Equal where micro-triangles meet.
    pub positions: Vec<Vec3>,
    /// The triangle of the mesh that a vertex belongs to.
    pub faces: Vec<u32>,
    /// Weights of the second and third corner of that triangle.
    pub weights: Vec<Vec2>,
    /// Micro-triangles, wound as the triangles of the mesh.
    pub indices: Vec<[u32; 3]>,
    /// The first vertex of strips along seams; they come last, and share no vertices with the rest.
    pub first_strip: usize,
}

/// Which triangles are displaced, and how finely.
#[derive(Clone, Copy)]
pub struct Cut<'a> {
    /// Of which triangles; edges are those of all of them.
    pub range: &'a Range<u32>,
    /// Which of them are wanted. What is left out changes nothing about the rest.
    pub keep: &'a (dyn Fn(u32) -> bool + Sync),
    /// How many pieces an edge should have. Asked once for each side of an edge whose UVs or normals differ;
    /// the most demanding side counts.
    pub segments: &'a (dyn Fn(&EdgeSide) -> u32 + Sync),
    /// Displaced positions are relative to it, mesh units.
    pub origin: DVec3,
    /// Most micro-triangles, at most [`MAX_MICRO_TRIANGLES`].
    pub limit: u64,
}

impl Cut<'_> {
    fn check(&self, got: u64) -> Result<(), MeshError> {
        let limit = self.limit.min(MAX_MICRO_TRIANGLES);
        if got > limit {
            return Err(MeshError::TooLarge { what: "micro-triangles".to_owned(), got, limit });
        }
        Ok(())
    }
}

/// Displaces a mesh.
///
/// # Errors
/// [`MeshError::TooLarge`] for more than `cut.limit` micro-triangles.
pub fn displace(mesh: &Mesh, cut: &Cut<'_>, relief: &Relief<'_>) -> Result<Displaced, MeshError> {
    let range = cut.range;
    let seams = Seams::new(mesh, range);
    let pieces = seams.pieces(mesh, cut.segments);
    let faces: Vec<u32> = range.clone().into_par_iter().filter(|&face| (cut.keep)(face)).collect();
    let of = |face: u32| seams.pieces_of((face - range.start) as usize, &pieces);
    let of_strips = |edge: usize| 2 * seams.sides(edge).len() as u64 * u64::from(pieces[edge]);
    let total: u64 = faces.iter().map(|&face| pattern::size(of(face)).0).sum();
    cut.check(total + seams.parted().map(of_strips).sum::<u64>())?;
    let rim = seams.displace(mesh, cut.origin, &pieces, relief);
    let micro = |&face: &u32| {
        let pattern = pattern::pattern(of(face));
        let triangle = mesh.indices[face as usize];
        let frame = Corners::of(mesh, triangle);
        let mut positions: Vec<Vec3> =
            seams.rim_of((face - range.start) as usize, triangle, &pieces, &rim).collect();
        let inside = &pattern.points[positions.len()..];
        positions.extend(inside.iter().map(|&at| (frame.displaced(at, relief) - cut.origin).as_vec3()));
        (face, positions, pattern)
    };
    // Some faces at a time, so that what is in flight stays small.
    let mut displaced = Displaced::default();
    for run in faces.chunks(4096) {
        let parts: Vec<_> = run.par_iter().map(micro).collect();
        for (face, positions, pattern) in parts {
            let first = displaced.positions.len() as u32;
            displaced.faces.extend(std::iter::repeat_n(face, positions.len()));
            displaced.positions.extend(positions);
            displaced.weights.extend(pattern.points.iter().map(|b| DVec2::new(b[1], b[2]).as_vec2()));
            displaced.indices.extend(pattern.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
        }
    }
    displaced.first_strip = displaced.positions.len();
    let meetings = seams.meetings(mesh, range, cut.origin, relief);
    for edge in seams.parted() {
        let shares: Vec<f64> = (0..=pieces[edge]).map(|k| f64::from(k) / f64::from(pieces[edge])).collect();
        displaced.bridge(&seams, mesh, edge, &shares, &meetings, cut.origin, relief, cut.keep);
    }
    Ok(displaced)
}

/// The corners of one triangle, in double precision.
struct Corners {
    positions: [DVec3; 3],
    normals: [DVec3; 3],
    uvs: [DVec2; 3],
}

impl Corners {
    fn of(mesh: &Mesh, triangle: [u32; 3]) -> Self {
        let corners = triangle.map(|corner| corner as usize);
        Self {
            positions: corners.map(|at| mesh.positions[at].as_dvec3()),
            normals: corners.map(|at| mesh.normals[at].as_dvec3()),
            uvs: corners.map(|at| mesh.uvs[at].as_dvec2()),
        }
    }

    fn displaced(&self, weights: [f64; 3], relief: &Relief<'_>) -> DVec3 {
        let [a, b, c] = weights;
        let mix = |v: &[DVec3; 3]| a * v[0] + b * v[1] + c * v[2];
        let uv = a * self.uvs[0] + b * self.uvs[1] + c * self.uvs[2];
        let rise = relief.scale * ((relief.height)(uv.x, uv.y) - relief.base);
        mix(&self.positions) + rise * mix(&self.normals).normalize_or_zero()
    }
}
