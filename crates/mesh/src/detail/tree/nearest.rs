//! The point of the triangles nearest to a given point.

use glam::Vec3;

use super::{LANES, LEAF, Tree};

/// The nearest point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Near {
    /// Which triangle.
    pub triangle: u32,
    /// Weights of its corners; their sum is 1.
    pub weights: [f32; 3],
    /// Where.
    pub place: Vec3,
}

impl Tree {
    /// The nearest point to `p`; `None` for an empty tree or a point too far away to be measured.
    /// `stack` is scratch space.
    pub(crate) fn nearest_point(&self, p: Vec3, stack: &mut Vec<(f32, u32)>) -> Option<Near> {
        let mut best = f32::INFINITY;
        let mut found = None;
        stack.clear();
        stack.push((0.0, 0));
        while let Some((distance, at)) = stack.pop() {
            if distance >= best {
                continue;
            }
            if at & LEAF != 0 {
                for (triangle, corners) in self.leaves[(at & !LEAF) as usize].triangles() {
                    let weights = nearest_weights(p, corners);
                    let [a, b, c] = corners;
                    let place = a * weights[0] + b * weights[1] + c * weights[2];
                    let distance = place.distance_squared(p);
                    if distance < best {
                        best = distance;
                        found = Some(Near { triangle, weights, place });
                    }
                }
                continue;
            }
            let node = &self.nodes[at as usize];
            let first = stack.len();
            for lane in 0..LANES {
                let mut apart = Vec3::ZERO;
                for k in 0..3 {
                    apart[k] = (node.low[k][lane] - p[k]).max(p[k] - node.high[k][lane]).max(0.0);
                }
                let distance = apart.length_squared();
                if distance < best {
                    stack.push((distance, node.child[lane]));
                }
            }
            // The nearest child on top.
            stack[first..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        }
        found
    }
}

/// Weights of the point of a triangle nearest to `p`.
///
/// Source: Ericson, "Real-Time Collision Detection", 2005, 5.1.5: the regions beyond the corners,
/// then those beyond the edges, else the inside.
fn nearest_weights(p: Vec3, [a, b, c]: [Vec3; 3]) -> [f32; 3] {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(p - a), ac.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = if d1 > d3 { d1 / (d1 - d3) } else { 0.0 };
        return [1.0 - t, t, 0.0];
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = if d2 > d6 { d2 / (d2 - d6) } else { 0.0 };
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    let (e, f) = (d4 - d3, d5 - d6);
    if va <= 0.0 && e >= 0.0 && f >= 0.0 {
        let t = if e + f > 0.0 { e / (e + f) } else { 0.0 };
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    if sum > 0.0 { [va / sum, vb / sum, vc / sum] } else { [1.0, 0.0, 0.0] }
}
