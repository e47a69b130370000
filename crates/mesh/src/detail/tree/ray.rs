//! A ray, ready to be asked about.

use glam::Vec3;

/// Directions flatter than this along an axis count as this flat there: the inverse stays finite.
const FLATTEST: f32 = 1e-30;

/// Which sides of a triangle a ray can hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sides {
    /// Those whose corners run counter-clockwise seen from the ray's start.
    Front,
    /// Either.
    Both,
}

/// What a ray met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Which triangle.
    pub triangle: u32,
    /// How far along the ray, in lengths of its direction.
    pub t: f32,
    /// Weights of the triangle's corners; their sum is 1.
    pub weights: [f32; 3],
}

/// A ray from `start` to `end`, in lengths of its direction, with what its tests need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
    pub start: f32,
    pub end: f32,
    /// Inverse direction, finite.
    pub(super) inverse: [f32; 3],
    /// See [`Ray::axes`].
    axes: [u8; 3],
    /// Takes the ray onto the last axis.
    pub(super) shear: [f32; 3],
}

impl Ray {
    /// The ray from `origin` along a direction of some length.
    #[inline(always)]
    pub(crate) fn new(origin: Vec3, direction: Vec3, start: f32, end: f32) -> Self {
        let d = direction.to_array();
        let [x, y, z] = d.map(f32::abs);
        let axes = if x > y && x > z {
            [1, 2, 0]
        } else if y > z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        // The axes keep their cyclic order, so only the sign of the last one turns front to back.
        let depth = 1.0 / d[axes[2]];
        let shear = [d[axes[0]] * depth, d[axes[1]] * depth, depth];
        let inverse = d.map(|d| if d.abs() < FLATTEST { (1.0 / FLATTEST).copysign(d) } else { 1.0 / d });
        Self {
            origin: origin.to_array(),
            direction: d,
            start,
            end,
            inverse,
            axes: axes.map(|axis| axis as u8),
            shear,
        }
    }

    /// The axes with the longest part of the direction last.
    #[inline(always)]
    pub(super) fn axes(&self) -> [usize; 3] {
        self.axes.map(usize::from)
    }

    /// Whether front faces, sheared, have negative edge functions.
    #[inline(always)]
    pub(super) fn is_mirrored(&self) -> bool {
        self.shear[2] < 0.0
    }
}
