//! The shell around a mesh in which relief may lie: a prism on each triangle, and a tree of boxes over them.
//!
//! A prism holds the points `P(b) + rise N(b)` with positions and normals interpolated over the triangle, not
//! normalised: its corners are straight lines, and the six of them bound it. Where the interpolated normal is
//! shorter than 1 the prism reaches farther along it, so that unit normals stay inside.

mod heights;
mod tree;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use self::heights::HeightBounds;
use self::tree::{Bounds, tree};
use crate::uniforms::{ShellNode, ShellPrism};
use crate::{Device, Draw, RenderError};

/// Shortest interpolated normal that is made up for: corners whose normals are 169 degrees apart.
const SHORTEST_NORMAL: f32 = 0.1;
/// Share of the relief by which prisms are higher and deeper than the heights in them.
const MARGIN: f32 = 1e-3;
/// Share of the mesh's size by which boxes are wider, so that rounding hides nothing.
const WIDER: f32 = 4e-6;

/// Bindings 3 and 4 of group 3, `shaders_wgsl/bindings/shell.wgsl`.
pub(crate) struct Shell {
    pub nodes: wgpu::Buffer,
    pub prisms: wgpu::Buffer,
    /// Corners of the box around everything, object space.
    pub bounds: [Vec3; 2],
}

impl Shell {
    /// Builds and uploads the shell of a draw. `centre`: the middle of its mesh.
    pub fn new(device: &Device, draw: &Draw<'_>, centre: DVec3) -> Result<Self, RenderError> {
        let (nodes, prisms) = build(draw, centre);
        let storage = wgpu::BufferUsages::STORAGE;
        let bounds = nodes.first().map_or([Vec3::ZERO; 2], |root| [root.low.into(), root.high.into()]);
        Ok(Self {
            bounds,
            nodes: device.buffer_with("shell nodes", bytemuck::cast_slice(&nodes), storage)?,
            prisms: device.buffer_with("shell prisms", bytemuck::cast_slice(&prisms), storage)?,
        })
    }
}

fn build(draw: &Draw<'_>, centre: DVec3) -> (Vec<ShellNode>, Vec<ShellPrism>) {
    let (mesh, field) = (&*draw.mesh, &draw.material.field);
    let extent = field.extent();
    let heights = HeightBounds::new(field);
    let made: Vec<(ShellPrism, Bounds)> = draw
        .triangles
        .clone()
        .into_par_iter()
        .map(|face| {
            let corners = mesh.indices[face as usize].map(|at| at as usize);
            let normals = corners.map(|at| mesh.normals[at]);
            let [low, high] = heights.over(corners.map(|at| mesh.uvs[at]));
            let longest = 1.0 / nearest_to_origin(normals).max(SHORTEST_NORMAL);
            let rise = |height: f32| {
                let rise = extent.scale * (height - extent.base);
                [rise, rise * longest]
            };
            let [a, b] = rise(low - MARGIN);
            let [c, d] = rise(high + MARGIN);
            let prism = ShellPrism { face, low: a.min(b), high: c.max(d), unused: 0 };
            let around = corners.iter().fold(Bounds::NONE, |around, &at| {
                let foot = (mesh.positions[at].as_dvec3() - centre).as_vec3();
                around.with(foot + prism.low * mesh.normals[at]).with(foot + prism.high * mesh.normals[at])
            });
            (prism, around)
        })
        .collect();
    let size = made.iter().map(|(_, b)| b.low.abs().max(b.high.abs()).max_element()).fold(0.0, f32::max);
    let wider = Vec3::splat(size * WIDER + f32::MIN_POSITIVE);
    let bounds: Vec<Bounds> =
        made.iter().map(|(_, b)| Bounds { low: b.low - wider, high: b.high + wider }).collect();
    let (nodes, order) = tree(&bounds);
    (nodes, order.iter().map(|&at| made[at as usize].0).collect())
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
