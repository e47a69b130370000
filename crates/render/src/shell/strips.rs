//! Strips that close the gaps between charts, cut once for all views.

use std::ops::Range;

use glam::{DVec3, Vec2, Vec3};
use heightfield::HeightField;
use mesh::{EdgeSide, Mesh, Relief};

use crate::RenderError;

/// Cells that an edge may cross before it is cut evenly.
const MOST_CELLS: f64 = 65536.0;
/// Strips narrower than this share of the mesh's size close nothing.
const NARROWEST: f32 = 1e-7;

/// A triangle of a strip.
pub(super) struct Strip {
    pub face: u32,
    pub places: [Vec3; 3],
    /// Of the second and third corner of the face.
    weights: [Vec2; 3],
}

impl Strip {
    /// As shaders read it.
    pub fn packed(&self) -> [[u32; 4]; 3] {
        let bits = |share: f32| (share.clamp(0.0, 1.0) * 65535.0).round() as u32;
        [0, 1, 2].map(|at| {
            let [x, y, z] = self.places[at].to_array().map(f32::to_bits);
            [x, y, z, bits(self.weights[at].x) | bits(self.weights[at].y) << 16]
        })
    }
}

/// Where an edge crosses cells, and halfway between: the surface is bilinear, and along the edge a parabola in each.
fn cuts(side: &EdgeSide, field: &HeightField) -> Vec<f64> {
    let texels = [field.width() as f64, field.height() as f64];
    let [from, to] = side.uvs.map(|uv| uv.as_dvec2().to_array());
    let mut crossings = vec![0.0, 1.0];
    for axis in 0..2 {
        let [a, b] = [from[axis], to[axis]].map(|uv| uv * texels[axis] - 0.5);
        let (low, high) = (a.min(b).ceil(), a.max(b).floor());
        let crossed = high - low;
        if !crossed.is_finite() || crossed >= MOST_CELLS {
            return (1..1024).map(|k| f64::from(k) / 1024.0).collect();
        }
        let count = (crossed + 1.0).max(0.0) as u32;
        crossings.extend((0..count).map(|k| (low + f64::from(k) - a) / (b - a)).filter(|s| s.is_finite()));
    }
    crossings.sort_by(f64::total_cmp);
    let halfway: Vec<f64> = crossings.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    crossings.extend(halfway);
    crossings
}

/// All strips of some triangles; positions are relative to `centre`.
pub(super) fn strips(
    mesh: &Mesh,
    triangles: &Range<u32>,
    field: &HeightField,
    centre: DVec3,
) -> Result<Vec<Strip>, RenderError> {
    let extent = field.extent();
    let relief = Relief {
        height: &|u, v| field.height_at(u, v),
        scale: f64::from(extent.scale),
        base: f64::from(extent.base),
    };
    let bridges = mesh::bridges(mesh, triangles, &|side| cuts(side, field), centre, &relief)
        .map_err(RenderError::Displacement)?;
    let size = bridges.positions.iter().map(|place| place.abs().max_element()).fold(0.0, f32::max);
    let strip = |corners: &[u32; 3]| {
        let at = corners.map(|corner| corner as usize);
        let places = at.map(|at| bridges.positions[at]);
        let edges = [places[1] - places[0], places[2] - places[1], places[0] - places[2]];
        let longest = edges.iter().map(|edge| edge.length()).fold(0.0, f32::max);
        (edges[0].cross(edges[1]).length() > NARROWEST * size * longest).then(|| Strip {
            face: bridges.faces[at[0]],
            places,
            weights: at.map(|at| bridges.weights[at]),
        })
    };
    Ok(bridges.indices.iter().filter_map(strip).collect())
}
