//! Eight triangles against one ray, without gaps between neighbours.
//!
//! The ray is sheared onto an axis, where the test is three edge functions in the plane. Two
//! triangles with a common edge compute the same number for it but for the sign, so no ray slips
//! between them. Source: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2013.

use glam::Vec3;

use super::ray::{Hit, Ray, Sides};
use super::{Bounds, EMPTY, LANES};

/// Up to eight triangles, coordinates side by side.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
pub(super) struct Leaf {
    /// `corners[corner][axis][lane]`; lanes without a triangle are NaN, which no ray hits.
    corners: [[[f32; LANES]; 3]; 3],
    /// Which triangles; `u32::MAX` for none.
    triangles: [u32; LANES],
}

/// The smaller number; the second one when they cannot be compared.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

impl Leaf {
    /// The leaf of some triangles, and the box around it.
    pub(super) fn new(
        triangles: impl Iterator<Item = u32>,
        corners_of: impl Fn(u32) -> [Vec3; 3],
    ) -> (Self, Bounds) {
        let mut leaf = Self { corners: [[[f32::NAN; LANES]; 3]; 3], triangles: [u32::MAX; LANES] };
        let mut bounds = EMPTY;
        for (lane, triangle) in triangles.take(LANES).enumerate() {
            let corners = corners_of(triangle);
            leaf.triangles[lane] = triangle;
            for (corner, place) in corners.iter().enumerate() {
                for (axis, x) in place.to_array().into_iter().enumerate() {
                    leaf.corners[corner][axis][lane] = x;
                }
                bounds = bounds.with((*place).into());
            }
        }
        (leaf, bounds)
    }

    /// The triangles with their corners.
    pub(super) fn triangles(&self) -> impl Iterator<Item = (u32, [Vec3; 3])> {
        let corner = |lane: usize, c: usize| Vec3::from([0, 1, 2].map(|axis| self.corners[c][axis][lane]));
        let lanes = self.triangles.iter().enumerate().filter(|(_, t)| **t != u32::MAX);
        lanes.map(move |(lane, &t)| (t, [0, 1, 2].map(|c| corner(lane, c))))
    }

    /// The nearest triangle that the ray meets before `ray.end`; shortens the ray.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &mut Ray, sides: Sides) -> Option<Hit> {
        let [kx, ky, kz] = ray.axes();
        let [sx, sy, sz] = ray.shear;
        let (ox, oy, oz) = (ray.origin[kx], ray.origin[ky], ray.origin[kz]);
        let mut x = [[0.0; LANES]; 3];
        let mut y = [[0.0; LANES]; 3];
        let mut z = [[0.0; LANES]; 3];
        for c in 0..3 {
            let corner = &self.corners[c];
            for i in 0..LANES {
                let depth = corner[kz][i] - oz;
                x[c][i] = (corner[kx][i] - ox) - sx * depth;
                y[c][i] = (corner[ky][i] - oy) - sy * depth;
                z[c][i] = sz * depth;
            }
        }
        let mut weights = [[0.0; LANES]; 3];
        for c in 0..3 {
            let (a, b) = ((c + 1) % 3, (c + 2) % 3);
            for i in 0..LANES {
                weights[c][i] = x[b][i] * y[a][i] - y[b][i] * x[a][i];
            }
        }
        let mut t = [0.0; LANES];
        // Every step is one comparison and one choice a lane, which is what registers can do.
        for i in 0..LANES {
            let [u, v, w] = [weights[0][i], weights[1][i], weights[2][i]];
            let depth = (u * z[0][i] + v * z[1][i] + w * z[2][i]) / (u + v + w);
            let (low, high) = (least(least(u, v), w), -least(least(-u, -v), -w));
            let inside = match sides {
                Sides::Both => -least(-low, high),
                Sides::Front if ray.is_mirrored() => -high,
                Sides::Front => low,
            };
            // A triangle without area has a depth of NaN, which is between no bounds.
            let met = if inside >= 0.0 { depth } else { f32::INFINITY };
            let met = if met >= ray.start { met } else { f32::INFINITY };
            t[i] = if met <= ray.end { met } else { f32::INFINITY };
        }
        let mut nearest = t;
        for half in [LANES / 2, LANES / 4, LANES / 8] {
            for i in 0..half {
                nearest[i] = least(nearest[i], nearest[i + half]);
            }
        }
        if nearest[0] == f32::INFINITY {
            return None;
        }
        let best = t.iter().position(|&t| t == nearest[0]).unwrap_or(0);
        ray.end = t[best];
        let w = [0, 1, 2].map(|c| weights[c][best]);
        let sum = w[0] + w[1] + w[2];
        Some(Hit { triangle: self.triangles[best], t: t[best], weights: w.map(|w| w / sum) })
    }
}
