//! A bounding volume hierarchy of triangles, built for baking: quick to make, and asked by bundles of
//! neighbouring rays.
//!
//! Triangles are sorted along a Morton curve and cut into leaves of at most eight, stored side by
//! side so that one ray is tested against all of them at once. Cuts along the same curve, and below them a
//! surface-area split over the leaves, give nodes of eight children, whose boxes again lie side by side.
//!
//! Sources: Lauterbach et al., "Fast BVH Construction on GPUs", 2009 (Morton leaves); Wald, "On Fast
//! Construction of SAH-based Bounding Volume Hierarchies", 2007 (binned splits); Wald, Benthin and
//! Boulos, "Getting Rid of Packets", 2008 (eight children).
//!
//! Measured in one session, processor time of 524 288 triangles and 1024 x 1024 straight rays: this tree,
//! before it was made one third faster, 0.09 s to build and 0.20 s for all the rest of a bake; `obvhs` 0.4 to
//! build and to ask, without the rest of a bake, 0.31 + 0.47 s (`Bvh2`) or 0.45 + 0.33 s (`CwBvh`, both by its
//! fast build), and 0.12 + 1.1 s by its fastest build.

// Loops over lanes walk several arrays at once; written with an index they become vector code.
#![allow(clippy::needless_range_loop)]

mod beam;
mod build;
mod leaf;
mod morton;
mod nearest;
mod ray;
mod sah;
mod split;
#[cfg(test)]
mod tests;
mod walk;

use glam::Vec3A;

pub(crate) use beam::Scratch;
pub(crate) use ray::{Hit, Ray, Sides};

use leaf::Leaf;

/// Children of a node, and triangles of a leaf: the lanes of two SSE or one AVX register.
const LANES: usize = 8;

/// Marks a child as a leaf.
const LEAF: u32 = 1 << 31;

/// A box that holds nothing.
const EMPTY: Bounds = Bounds { low: Vec3A::INFINITY, high: Vec3A::NEG_INFINITY };

/// An axis-aligned box. Its corners are one register each: trees are made of little else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub low: Vec3A,
    pub high: Vec3A,
}

impl Bounds {
    /// The smallest box around both.
    #[inline(always)]
    fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// The smallest box that also holds a point.
    #[inline(always)]
    fn with(self, p: Vec3A) -> Self {
        Self { low: self.low.min(p), high: self.high.max(p) }
    }

    /// Half the surface; 0 for an empty box.
    #[inline(always)]
    fn half_area(self) -> f32 {
        let [x, y, z] = (self.high - self.low).max(Vec3A::ZERO).to_array();
        x * y + y * z + z * x
    }
}

/// Eight children: boxes side by side, then what is inside them.
#[derive(Debug, Clone)]
#[repr(C, align(32))]
struct Node {
    low: [[f32; LANES]; 3],
    high: [[f32; LANES]; 3],
    /// Index of a node, or of a leaf with [`LEAF`] set. Lanes without a child have an empty box.
    child: [u32; LANES],
}

impl Node {
    fn new() -> Self {
        Self {
            low: [[f32::INFINITY; LANES]; 3],
            high: [[f32::NEG_INFINITY; LANES]; 3],
            child: [u32::MAX; LANES],
        }
    }

    fn set(&mut self, lane: usize, bounds: Bounds, child: u32) {
        for k in 0..3 {
            self.low[k][lane] = bounds.low[k];
            self.high[k][lane] = bounds.high[k];
        }
        self.child[lane] = child;
    }

    #[inline(always)]
    fn bounds(&self, lane: usize) -> Bounds {
        let corner = |side: &[[f32; LANES]; 3]| Vec3A::new(side[0][lane], side[1][lane], side[2][lane]);
        Bounds { low: corner(&self.low), high: corner(&self.high) }
    }
}

/// The tree; see the module.
#[derive(Debug)]
pub(crate) struct Tree {
    /// The first is the root.
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    bounds: Bounds,
}

impl Tree {
    /// The box around everything.
    pub(crate) fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The largest coordinate, in either direction.
    pub(crate) fn reach(&self) -> f32 {
        self.bounds.low.abs().max(self.bounds.high.abs()).max_element()
    }
}
