//! What every technique is measured against: the first hit of each ray on the exact bilinear surface,
//! found in `f64`, once per set of rays.

use heightfield::{Extent, HeightField, Status, oracle};
use rayon::prelude::*;

use crate::Rays;
use crate::region::{Region, is_silhouette};

/// The exact answer for one ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Whether the ray meets the surface at all. The other fields mean nothing otherwise.
    pub hit: bool,
    /// Ray parameter of the first hit.
    pub t: f64,
    /// Where, not reduced to one tile.
    pub uv: [f64; 2],
    /// Height there, 0..1.
    pub z: f64,
    /// Unit normal in mesh units, tangent space: x right, y up the image, z out.
    pub normal: [f64; 3],
}

/// A ray from a true hit towards a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowRay {
    /// Start on the surface, texture space.
    pub origin: [f64; 3],
    /// Towards the light, texture space.
    pub direction: [f64; 3],
    /// Whether the exact surface blocks it.
    pub occluded: bool,
    /// Which ray it belongs to.
    pub ray: usize,
}

/// Exact answers for a set of rays.
#[derive(Debug, Clone, Default)]
pub struct Reference {
    /// One for each ray.
    pub truths: Vec<Truth>,
    /// Where each of them lies on the relief; nothing without a hit.
    pub regions: Vec<Region>,
    /// Shadow rays from the hits; those that face away from the light are left out.
    pub shadows: Vec<ShadowRay>,
}

impl Reference {
    /// Finds the first hit of every ray, and shadow bits towards the `lights` (texture space, going
    /// up) in turn: ray `i` looks at light `i % lights.len()`.
    pub fn new(field: &HeightField, rays: &Rays, lights: &[[f64; 3]]) -> Self {
        let truths: Vec<Truth> = (0..rays.len()).into_par_iter().map(|i| Truth::of(field, rays, i)).collect();
        let mut regions: Vec<Region> = (0..rays.len())
            .into_par_iter()
            .map(|i| match truths[i].hit && is_silhouette(field, rays, i, &truths[i]) {
                true => Region::Silhouette,
                false => Region::Interior,
            })
            .collect();
        if lights.is_empty() {
            return Self { truths, regions, shadows: Vec::new() };
        }
        let answers: Vec<Option<ShadowRay>> = truths
            .par_iter()
            .enumerate()
            .map(|(i, truth)| {
                truth.hit.then(|| ShadowRay::of(field, truth, lights[i % lights.len()], i)).flatten()
            })
            .collect();
        for (region, answer) in regions.iter_mut().zip(&answers) {
            if *region == Region::Interior && answer.is_none_or(|ray| ray.occluded) {
                *region = Region::Shadow;
            }
        }
        Self { truths, regions, shadows: answers.into_iter().flatten().collect() }
    }

    /// Number of rays.
    pub fn len(&self) -> usize {
        self.truths.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.truths.is_empty()
    }
}

/// Unit normal in mesh units for a gradient in height per tile: x right, y up the image, z out.
pub fn normal(extent: &Extent, gradient: [f64; 2]) -> [f64; 3] {
    let scale = f64::from(extent.scale);
    let x = -scale * gradient[0] / f64::from(extent.tile_size[0]);
    let y = scale * gradient[1] / f64::from(extent.tile_size[1]);
    let length = (x * x + y * y + 1.0).sqrt();
    [x / length, y / length, 1.0 / length]
}

impl Truth {
    const NONE: Self = Self { hit: false, t: f64::INFINITY, uv: [0.0; 2], z: 0.0, normal: [0.0, 0.0, 1.0] };

    fn of(field: &HeightField, rays: &Rays, i: usize) -> Self {
        let (origin, direction) = (rays.origin(i), rays.direction(i));
        let found = oracle::exact(field, origin, direction);
        if found.status != Status::Hit {
            return Self::NONE;
        }
        let [u, v, z] = rays.at(i, found.t);
        Self { hit: true, t: found.t, uv: [u, v], z, normal: normal(field.extent(), found.gradient) }
    }
}

impl ShadowRay {
    fn of(field: &HeightField, truth: &Truth, direction: [f64; 3], ray: usize) -> Option<Self> {
        let extent = field.extent();
        let towards = [
            direction[0] * f64::from(extent.tile_size[0]),
            -direction[1] * f64::from(extent.tile_size[1]),
            direction[2] * f64::from(extent.scale),
        ];
        let facing: f64 = (0..3).map(|axis| towards[axis] * truth.normal[axis]).sum();
        if facing <= 0.0 {
            return None;
        }
        let origin = [truth.uv[0], truth.uv[1], truth.z];
        Some(Self { origin, direction, occluded: oracle::occluded(field, origin, direction), ray })
    }
}
