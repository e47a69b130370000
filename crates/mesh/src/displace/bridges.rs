//! Strips between charts that are displaced each for itself: from where a side of an edge is displaced to where
//! all of them meet. They close UV seams and hard edges.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::seams::{Seams, Strip};
use super::{Displaced, EdgeSide, MAX_MICRO_TRIANGLES, Relief};
use crate::{Mesh, MeshError};

/// The strips along all edges of `range` whose sides differ in UVs or normals. There are none on a mesh without
/// seams.
///
/// `cuts`: shares of an edge, 0 to 1, at which a side wants it cut besides its ends; the sides share their cuts.
/// Positions are relative to `origin`.
///
/// # Errors
/// [`MeshError::TooLarge`] for more than [`MAX_MICRO_TRIANGLES`].
pub fn bridges(
    mesh: &Mesh,
    range: &Range<u32>,
    cuts: &(dyn Fn(&EdgeSide) -> Vec<f64> + Sync),
    origin: DVec3,
    relief: &Relief<'_>,
) -> Result<Displaced, MeshError> {
    let seams = Seams::new(mesh, range);
    let parted: Vec<usize> = seams.parted().collect();
    let shares: Vec<Vec<f64>> = parted
        .par_iter()
        .map(|&edge| {
            let inside = |share: &f64| *share > 0.0 && *share < 1.0;
            let sides = seams.sides(edge).iter();
            let wanted = sides.flat_map(|side| cuts(&EdgeSide::of(mesh, side.ends))).filter(inside);
            let mut shares: Vec<f64> = wanted.chain([0.0, 1.0]).collect();
            shares.sort_by(f64::total_cmp);
            shares.dedup_by(|b, a| *b - *a < 1e-9);
            // Of two that are one, the first was kept; the end is exact.
            if let Some(last) = shares.last_mut() {
                *last = 1.0;
            }
            shares
        })
        .collect();
    let count =
        |(&edge, shares): (&usize, &Vec<f64>)| (2 * seams.sides(edge).len() * (shares.len() - 1)) as u64;
    let got = parted.iter().zip(&shares).map(count).sum();
    if got > MAX_MICRO_TRIANGLES {
        let what = "micro-triangles along seams".to_owned();
        return Err(MeshError::TooLarge { what, got, limit: MAX_MICRO_TRIANGLES });
    }
    let meetings = seams.meetings(mesh, range, origin, relief);
    let mut bridges = Displaced::default();
    for (&edge, shares) in parted.iter().zip(&shares) {
        bridges.bridge(&seams, mesh, edge, shares, &meetings, origin, relief, &|_| true);
    }
    Ok(bridges)
}

impl Displaced {
    /// Adds the strips along one edge that belong to triangles that are kept.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn bridge(
        &mut self,
        seams: &Seams,
        mesh: &Mesh,
        edge: usize,
        shares: &[f64],
        meetings: &HashMap<u32, Vec3>,
        origin: DVec3,
        relief: &Relief<'_>,
        keep: &dyn Fn(u32) -> bool,
    ) {
        for strip in seams.strips(mesh, edge, shares, meetings, origin, relief) {
            if keep(strip.side.face) {
                self.add(&strip);
            }
        }
    }

    fn add(&mut self, Strip { side, shares, own, meeting }: &Strip<'_>) {
        let first = self.positions.len() as u32;
        for (k, &share) in shares.iter().enumerate() {
            self.positions.extend([own[k], meeting[k]]);
            let mut weights = [0.0; 3];
            let along = if side.backwards { 1.0 - share } else { share } as f32;
            weights[side.corner] = 1.0 - along;
            weights[(side.corner + 1) % 3] = along;
            self.weights.extend([Vec2::new(weights[1], weights[2]); 2]);
            self.faces.extend([side.face; 2]);
        }
        for k in 0..shares.len() - 1 {
            // Where the sides agree there is nothing to close.
            if own[k] == meeting[k] && own[k + 1] == meeting[k + 1] {
                continue;
            }
            let [own, meets, own_next, meets_next] = [0, 1, 2, 3].map(|at| first + 2 * k as u32 + at);
            // As a triangle across the edge would be wound.
            self.indices.extend(if side.backwards {
                [[own, own_next, meets], [own_next, meets_next, meets]]
            } else {
                [[own_next, own, meets], [own_next, meets, meets_next]]
            });
        }
    }
}
