//! A bundle of neighbouring rays through the tree together.
//!
//! The bundle is held in a box along the axes and in a second one along its own direction; children
//! outside either are left out for all rays at once. What remains is a short list of leaves, whose
//! boxes are tested against eight rays at a time.

use glam::Vec3;

use super::ray::{Hit, Ray, Sides};
use super::{Bounds, EMPTY, LANES, LEAF, Node, Tree};

/// Share of the largest coordinate by which the bundle is widened against rounding.
const SLACK: f32 = 16.0 * f32::EPSILON;

/// An interval along a direction.
struct Slab {
    axis: [f32; 3],
    low: f32,
    high: f32,
}

/// What bounds a bundle.
pub(crate) struct Beam {
    bounds: Bounds,
    slabs: [Slab; 3],
}

impl Beam {
    /// The bounds of some rays; `reach` is the largest coordinate of the tree.
    #[inline(always)]
    fn around(rays: &[Ray], reach: f32) -> Self {
        let mut mean = Vec3::ZERO;
        for ray in rays {
            mean += Vec3::from(ray.direction);
        }
        let along = mean.try_normalize().unwrap_or(Vec3::Z);
        let last = rays.len() - 1;
        let across = Vec3::from(rays[last].origin) - Vec3::from(rays[0].origin);
        let across = across - along * along.dot(across);
        let across = across.try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());
        let axes = [along, across, along.cross(across)];
        let mut bounds = EMPTY;
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for ray in rays {
            let (o, d) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
            for p in [o + d * ray.start, o + d * ray.end] {
                bounds = bounds.with(p.into());
                for (k, axis) in axes.iter().enumerate() {
                    let x = axis.dot(p);
                    low[k] = if x < low[k] { x } else { low[k] };
                    high[k] = if x > high[k] { x } else { high[k] };
                }
            }
        }
        let slack = reach.max(bounds.low.abs().max(bounds.high.abs()).max_element()) * SLACK;
        Self {
            bounds: Bounds { low: bounds.low - slack, high: bounds.high + slack },
            slabs: std::array::from_fn(|k| Slab {
                axis: axes[k].to_array(),
                low: low[k] - slack,
                high: high[k] + slack,
            }),
        }
    }

    /// For each child, a number above 0 when it lies outside.
    #[inline(always)]
    fn gaps(&self, node: &Node) -> [f32; LANES] {
        let mut gap = [f32::NEG_INFINITY; LANES];
        for k in 0..3 {
            for i in 0..LANES {
                let a = node.low[k][i] - self.bounds.high[k];
                let b = self.bounds.low[k] - node.high[k][i];
                let c = if a > b { a } else { b };
                gap[i] = if c > gap[i] { c } else { gap[i] };
            }
        }
        for slab in &self.slabs {
            let mut least = [0.0; LANES];
            let mut most = [0.0; LANES];
            for k in 0..3 {
                let a = slab.axis[k];
                let (near, far) =
                    if a < 0.0 { (&node.high[k], &node.low[k]) } else { (&node.low[k], &node.high[k]) };
                for i in 0..LANES {
                    least[i] += near[i] * a;
                    most[i] += far[i] * a;
                }
            }
            for i in 0..LANES {
                let (a, b) = (least[i] - slab.high, slab.low - most[i]);
                let c = if a > b { a } else { b };
                gap[i] = if c > gap[i] { c } else { gap[i] };
            }
        }
        gap
    }
}

/// Eight rays, side by side.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
struct Octet {
    origin: [[f32; LANES]; 3],
    inverse: [[f32; LANES]; 3],
    start: [f32; LANES],
    end: [f32; LANES],
}

impl Octet {
    #[inline(always)]
    fn new(rays: &[Ray]) -> Self {
        // Lanes without a ray end before they start.
        let mut octet = Self {
            origin: [[0.0; LANES]; 3],
            inverse: [[1.0; LANES]; 3],
            start: [f32::INFINITY; LANES],
            end: [f32::NEG_INFINITY; LANES],
        };
        for (i, ray) in rays.iter().enumerate() {
            for k in 0..3 {
                octet.origin[k][i] = ray.origin[k];
                octet.inverse[k][i] = ray.inverse[k];
            }
            octet.start[i] = ray.start;
            octet.end[i] = ray.end;
        }
        octet
    }

    /// Which rays meet a box.
    #[inline(always)]
    fn meet(&self, bounds: &Bounds) -> [bool; LANES] {
        let mut near = self.start;
        let mut far = self.end;
        for k in 0..3 {
            let (low, high) = (bounds.low[k], bounds.high[k]);
            for i in 0..LANES {
                let a = (low - self.origin[k][i]) * self.inverse[k][i];
                let b = (high - self.origin[k][i]) * self.inverse[k][i];
                let (a, b) = if a < b { (a, b) } else { (b, a) };
                near[i] = if a > near[i] { a } else { near[i] };
                far[i] = if b < far[i] { b } else { far[i] };
            }
        }
        // Boxes are wider than their triangles by more than these products are wrong.
        std::array::from_fn(|i| near[i] <= far[i])
    }
}

/// Memory that bundles use in turn.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    open: Vec<u32>,
    leaves: Vec<(u32, Bounds)>,
    octets: Vec<Octet>,
    /// For rays asked one by one.
    pub(crate) stack: Vec<u32>,
}

impl Tree {
    /// The nearest triangle for each ray of a bundle, which are shortened to end there.
    #[inline(always)]
    pub(crate) fn nearest_hits(
        &self,
        rays: &mut [Ray],
        hits: &mut [Option<Hit>],
        sides: Sides,
        scratch: &mut Scratch,
    ) {
        hits.fill(None);
        if rays.is_empty() || self.leaves.is_empty() {
            return;
        }
        let beam = Beam::around(rays, self.reach());
        let Scratch { open, leaves, octets, .. } = scratch;
        open.clear();
        leaves.clear();
        octets.clear();
        octets.extend(rays.chunks(LANES).map(Octet::new));
        open.push(0);
        while let Some(at) = open.pop() {
            let node = &self.nodes[at as usize];
            let gaps = beam.gaps(node);
            for lane in 0..LANES {
                if gaps[lane] <= 0.0 {
                    match node.child[lane] {
                        child if child & LEAF == 0 => open.push(child),
                        child => leaves.push((child & !LEAF, node.bounds(lane))),
                    }
                }
            }
        }
        for (leaf, bounds) in leaves.iter() {
            let leaf = &self.leaves[*leaf as usize];
            for (group, octet) in octets.iter_mut().enumerate() {
                let meet = octet.meet(bounds);
                for lane in 0..LANES {
                    if meet[lane] {
                        let at = group * LANES + lane;
                        if let Some(hit) = leaf.hit(&mut rays[at], sides) {
                            hits[at] = Some(hit);
                            octet.end[lane] = hit.t;
                        }
                    }
                }
            }
        }
    }
}
