//! Ambient occlusion: the cosine-weighted share of the sky that the detailed mesh leaves open.
//!
//! Directions are a Hammersley set mapped to the cosine-weighted hemisphere by Malley's method, so
//! their mean is the share itself; each sample turns the set about its normal by an angle of its own.
//! Sources: Zhukov, Iones and Kronin, "An Ambient Light Illumination Model", 1998; Wong, Luk and Heng,
//! "Sampling with Hammersley and Halton Points", 1997; Pharr and Humphreys for Malley's method.

use std::f32::consts::TAU;

use glam::Vec3;

use super::surface::{Point, Surface};
use super::tree::Ray;

/// Share of the largest coordinate by which rays start above the surface they leave.
const LIFT: f32 = 8.0 * f32::EPSILON;

/// What is asked of the sky.
#[derive(Debug)]
pub(super) struct Sky {
    /// Unit directions around +Z.
    directions: Vec<Vec3>,
    /// How far away things still shade, mesh units.
    distance: f32,
    lift: f32,
    seed: u64,
}

/// Mirrors the bits of a counter behind the point: van der Corput's sequence, in 0..1.
fn radical_inverse(i: u32) -> f32 {
    // 24 bits, so that the result is exact and below 1.
    (i.reverse_bits() >> 8) as f32 / (1 << 24) as f32
}

/// A well-mixed number out of two: Steele, Lea and Flood, "SplitMix", 2014.
fn mixed(seed: u64, at: u64) -> u64 {
    let x = seed.wrapping_add(at.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

impl Sky {
    /// `rays` directions, looking `distance` far into `surface`.
    pub(super) fn new(surface: &Surface<'_>, rays: u32, distance: Option<f32>, seed: u64) -> Self {
        let bounds = surface.tree.bounds();
        let size = Vec3::from(bounds.high - bounds.low);
        let directions = (0..rays)
            .map(|i| {
                let share = (i as f32 + 0.5) / rays as f32;
                let (sin, cos) = (TAU * radical_inverse(i)).sin_cos();
                let radius = share.sqrt();
                Vec3::new(radius * cos, radius * sin, (1.0 - share).sqrt())
            })
            .collect();
        let reach = surface.tree.reach();
        Self { directions, distance: distance.unwrap_or(size.length() * 1.01), lift: reach * LIFT, seed }
    }

    /// The open share of the sky over a point, 0..1. `sample` numbers the samples of the map.
    #[inline(always)]
    pub(super) fn open(
        &self,
        surface: &Surface<'_>,
        point: &Point,
        sample: u64,
        stack: &mut Vec<u32>,
    ) -> f32 {
        let turn = TAU * (mixed(self.seed, sample) >> 40) as f32 / (1 << 24) as f32;
        let normal = point.normal;
        let plane = if point.plane == Vec3::ZERO { normal } else { point.plane };
        let (a, b) = normal.any_orthonormal_pair();
        let (sin, cos) = turn.sin_cos();
        let (tangent, bitangent) = (a * cos + b * sin, b * cos - a * sin);
        let start = point.place + plane * self.lift;
        let (mut open, mut asked) = (0u32, 0u32);
        for local in &self.directions {
            let direction = tangent * local.x + bitangent * local.y + normal * local.z;
            // What leaves into the triangle itself would see the inside of the mesh: the smooth
            // surface that the normal stands for is not there.
            if direction.dot(plane) <= 0.0 {
                continue;
            }
            asked += 1;
            let ray = Ray::new(start, direction, 0.0, self.distance);
            open += u32::from(!surface.tree.blocked(ray, stack));
        }
        if asked == 0 { 0.0 } else { open as f32 / asked as f32 }
    }
}
