//! The shell around a mesh in which relief may lie: a prism on each triangle, and a tree of boxes over them.
//!
//! A prism holds the points `P(b) + rise N(b)` with positions and normals interpolated over the triangle, not
//! normalised: its corners are straight lines, and the six of them bound it. Where the interpolated normal is
//! shorter than 1 the prism reaches farther along it, so that unit normals stay inside.

mod common;
mod heights;
mod scene;
mod store;
mod strips;
mod tree;

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use heightfield::HeightField;
use mesh::Mesh;
use rayon::prelude::*;

use self::heights::HeightBounds;
use self::tree::{Bounds, tree};
use crate::RenderError;
use crate::triangles::MeshArrays;
use crate::uniforms::{PLAIN, PRISM, ShellNode, ShellPrism};

pub(crate) use self::scene::SceneSolids;
pub(crate) use self::store::Store;

/// Shortest interpolated normal that is made up for: corners whose normals are 178 degrees apart.
const SHORTEST_NORMAL: f32 = 0.02;
/// Share of the relief by which prisms are higher and deeper than the heights in them.
const MARGIN: f32 = 1e-3;
/// Share of the mesh's size by which boxes are wider, so that rounding hides nothing.
const WIDER: f32 = 4e-6;

/// Some triangles of a mesh in their relief, as rays meet them: prisms, strips between them, and a tree over both.
/// Numbers count from its own first. Without nodes it cannot be traced.
pub(crate) struct Solid {
    /// The mesh, all of it.
    pub arrays: Arc<MeshArrays>,
    pub nodes: Vec<ShellNode>,
    pub prisms: Vec<ShellPrism>,
    /// Three corners a triangle: bits of the place, and packed weights.
    pub strips: Vec<[u32; 4]>,
    /// Corners of the box around everything, object space.
    pub bounds: [Vec3; 2],
}

impl Solid {
    /// Only what is needed to shade what is seen of it otherwise.
    pub fn untraced(arrays: Arc<MeshArrays>) -> Self {
        let (nodes, prisms, strips) = Default::default();
        Self { arrays, nodes, prisms, strips, bounds: [Vec3::ZERO; 2] }
    }

    /// Builds the shell. `centre`: the middle of the mesh.
    ///
    /// # Errors
    /// [`RenderError::Displacement`] for more strips along seams than memory is meant to hold.
    pub fn new(
        arrays: Arc<MeshArrays>,
        mesh: &Mesh,
        triangles: &Range<u32>,
        field: &HeightField,
        centre: DVec3,
    ) -> Result<Self, RenderError> {
        let mut made = if field.extent().scale > 0.0 {
            prisms(&arrays, triangles, field)
        } else {
            bare(mesh, triangles, centre)
        };
        let strips = if field.extent().scale > 0.0 {
            strips::strips(mesh, triangles, field, centre)?
        } else {
            Vec::new()
        };
        made.extend(strips.iter().enumerate().map(|(at, strip)| {
            let prism = ShellPrism { face: strip.face, low: 0.0, high: 0.0, strip: at as u32 };
            (prism, strip.places.iter().fold(Bounds::NONE, |around, &place| around.with(place)))
        }));
        let size = made.iter().map(|(_, b)| b.low.abs().max(b.high.abs()).max_element()).fold(0.0, f32::max);
        let wider = Vec3::splat(size * WIDER + f32::MIN_POSITIVE);
        let bounds: Vec<Bounds> =
            made.iter().map(|(_, b)| Bounds { low: b.low - wider, high: b.high + wider }).collect();
        let (nodes, order) = tree(&bounds);
        Ok(Self {
            arrays,
            bounds: nodes.first().map_or([Vec3::ZERO; 2], |root| [root.low.into(), root.high.into()]),
            nodes,
            prisms: order.iter().map(|&at| made[at as usize].0).collect(),
            strips: strips.iter().flat_map(strips::Strip::packed).collect(),
        })
    }
}

/// The bare triangles.
fn bare(mesh: &Mesh, triangles: &Range<u32>, centre: DVec3) -> Vec<(ShellPrism, Bounds)> {
    let one = |face: u32| {
        let around = mesh.indices[face as usize].iter().fold(Bounds::NONE, |around, &at| {
            around.with((mesh.positions[at as usize].as_dvec3() - centre).as_vec3())
        });
        (ShellPrism { face, low: 0.0, high: 0.0, strip: PLAIN }, around)
    };
    triangles.clone().into_par_iter().map(one).collect()
}

/// A prism on each triangle, or on its pieces.
fn prisms(arrays: &MeshArrays, triangles: &Range<u32>, field: &HeightField) -> Vec<(ShellPrism, Bounds)> {
    let extent = field.extent();
    let heights = HeightBounds::new(field);
    let one = |face: u32| {
        let [a, b, c, _] = arrays.triangles[face as usize];
        let corners = [a, b, c].map(|at| &arrays.vertices[at as usize]);
        let normals = corners.map(|corner| corner.up.truncate());
        let [low, high] = heights.over(corners.map(|corner| Vec2::new(corner.place.w, corner.up.w)));
        let longest = 1.0 / nearest_to_origin(normals).max(SHORTEST_NORMAL);
        let rise = |height: f32| {
            let rise = extent.scale * (height - extent.base);
            [rise, rise * longest]
        };
        let [a, b] = rise(low - MARGIN);
        let [c, d] = rise(high + MARGIN);
        let prism = ShellPrism { face, low: a.min(b), high: c.max(d), strip: PRISM };
        let around = corners.iter().zip(normals).fold(Bounds::NONE, |around, (corner, normal)| {
            let foot = corner.place.truncate();
            around.with(foot + prism.low * normal).with(foot + prism.high * normal)
        });
        (prism, around)
    };
    let parts = |face: u32| arrays.pieces.get(&face).cloned().unwrap_or(face..face + 1);
    triangles.clone().into_par_iter().flat_map_iter(|face| parts(face).map(one)).collect()
}

/// Distance from the origin to a triangle.
fn nearest_to_origin([a, b, c]: [Vec3; 3]) -> f32 {
    let to_segment = |a: Vec3, b: Vec3| {
        let along = b - a;
        let square = along.length_squared();
        let share = if square > 0.0 { (-a.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
        (a + share * along).length()
    };
    let edges = to_segment(a, b).min(to_segment(b, c)).min(to_segment(c, a));
    let plane = (b - a).cross(c - a);
    let square = plane.length_squared();
    if square < 1e-12 {
        return edges;
    }
    // The foot of the origin lies inside when it is on the inner side of all edges.
    let foot = plane * (a.dot(plane) / square);
    let inside = |a: Vec3, b: Vec3| (b - a).cross(foot - a).dot(plane) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) { edges.min(foot.length()) } else { edges }
}

/// Bounds of texture coordinates.
fn around(uvs: [Vec2; 3]) -> [Vec2; 2] {
    [uvs[0].min(uvs[1]).min(uvs[2]), uvs[0].max(uvs[1]).max(uvs[2])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_mean_of_normals_is_found() {
        assert_eq!(nearest_to_origin([Vec3::X; 3]), 1.0);
        let third = 1.0 / 3.0_f32.sqrt();
        assert!((nearest_to_origin([Vec3::X, Vec3::Y, Vec3::Z]) - third).abs() < 1e-6);
        assert!((nearest_to_origin([Vec3::X, Vec3::Y, Vec3::X]) - 0.5_f32.sqrt()).abs() < 1e-6);
        assert!(nearest_to_origin([Vec3::X, Vec3::NEG_X, Vec3::X]) < 1e-6);
    }
}
