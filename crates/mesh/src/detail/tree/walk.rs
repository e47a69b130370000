//! One ray at a time, for directions that have nothing in common.

use super::ray::{Ray, Sides};
use super::{LANES, LEAF, Node, Tree};

/// Factor on distances to the far side of a box against rounding: Ize, "Robust BVH Ray Traversal",
/// JCGT 2013.
const FAR: f32 = 1.0 + 4.0 * f32::EPSILON;

impl Node {
    /// Which children the ray meets.
    #[inline(always)]
    fn meet(&self, ray: &Ray) -> [bool; LANES] {
        let mut near = [ray.start; LANES];
        let mut far = [ray.end; LANES];
        for k in 0..3 {
            let (o, inverse) = (ray.origin[k], ray.inverse[k]);
            let (first, second) =
                if inverse < 0.0 { (&self.high[k], &self.low[k]) } else { (&self.low[k], &self.high[k]) };
            for i in 0..LANES {
                let (a, b) = ((first[i] - o) * inverse, (second[i] - o) * inverse * FAR);
                near[i] = if a > near[i] { a } else { near[i] };
                far[i] = if b < far[i] { b } else { far[i] };
            }
        }
        std::array::from_fn(|i| near[i] <= far[i])
    }
}

impl Tree {
    /// Whether the ray meets any triangle, from either side. `stack` is scratch space.
    #[inline(always)]
    pub(crate) fn blocked(&self, mut ray: Ray, stack: &mut Vec<u32>) -> bool {
        stack.clear();
        stack.push(0);
        while let Some(at) = stack.pop() {
            if at & LEAF != 0 {
                if self.leaves[(at & !LEAF) as usize].hit(&mut ray, Sides::Both).is_some() {
                    return true;
                }
                continue;
            }
            let node = &self.nodes[at as usize];
            let meet = node.meet(&ray);
            for lane in 0..LANES {
                if meet[lane] {
                    stack.push(node.child[lane]);
                }
            }
        }
        false
    }
}
