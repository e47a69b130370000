//! A tree of boxes that shaders walk: nodes side by side, the two children of a node next to each other.
//!
//! Source: Wald, "On Fast Construction of SAH-based Bounding Volume Hierarchies", 2007 (binned splits).

use glam::Vec3;

use crate::uniforms::{INNER_NODE, ShellNode};

/// A box around something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub low: Vec3,
    pub high: Vec3,
}

/// Bins in which splits are looked for.
const BINS: usize = 12;
/// Things in a leaf at most.
const LEAF: usize = 2;
/// Depth from which on halves are taken, so that the whole stays below what shaders can put off (48).
const HALVES: u32 = 20;

impl Bounds {
    pub(crate) const NONE: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    pub(crate) fn with(self, point: Vec3) -> Self {
        Self { low: self.low.min(point), high: self.high.max(point) }
    }

    fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Half the surface; 0 for an empty box.
    fn half_area(self) -> f32 {
        let s = (self.high - self.low).max(Vec3::ZERO);
        s.x * s.y + s.y * s.z + s.z * s.x
    }

    fn centre(self) -> Vec3 {
        (self.low + self.high) * 0.5
    }
}

/// Builds a tree over boxes: its nodes, the root first, and the order in which leaves name them.
pub(crate) fn tree(bounds: &[Bounds]) -> (Vec<ShellNode>, Vec<u32>) {
    let mut order: Vec<u32> = (0..bounds.len() as u32).collect();
    let mut nodes = vec![node(Bounds::NONE, 0, 0)];
    // Runs of the order that are still to be cut: node, start, end, depth.
    let mut open = vec![(0, 0, order.len(), 0)];
    while let Some((at, start, end, depth)) = open.pop() {
        let run = &mut order[start..end];
        let around = run.iter().fold(Bounds::NONE, |sum, &item| sum.union(bounds[item as usize]));
        if run.len() <= LEAF {
            nodes[at] = node(around, start as u32, run.len() as u32);
            continue;
        }
        let middle = start + split(bounds, run, depth);
        let first = nodes.len();
        nodes[at] = node(around, first as u32, INNER_NODE);
        nodes.extend([node(Bounds::NONE, 0, 0); 2]);
        open.push((first, start, middle, depth + 1));
        open.push((first + 1, middle, end, depth + 1));
    }
    (nodes, order)
}

fn node(around: Bounds, first: u32, count: u32) -> ShellNode {
    ShellNode { low: around.low.to_array(), first, high: around.high.to_array(), count }
}

/// Reorders a run and says how many of it go to the first child; never none nor all.
fn split(bounds: &[Bounds], run: &mut [u32], depth: u32) -> usize {
    let centre = |item: u32| bounds[item as usize].centre();
    let centres = run.iter().fold(Bounds::NONE, |sum, &item| sum.with(centre(item)));
    let size = centres.high - centres.low;
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { usize::from(size.y < size.z) + 1 };
    let bin_of = |item: u32| {
        let share = (centre(item)[axis] - centres.low[axis]) / size[axis];
        ((share * BINS as f32) as usize).min(BINS - 1)
    };
    if depth < HALVES && size[axis] > 0.0 {
        let mut bins = [(Bounds::NONE, 0_usize); BINS];
        for &item in run.iter() {
            let bin = &mut bins[bin_of(item)];
            *bin = (bin.0.union(bounds[item as usize]), bin.1 + 1);
        }
        let mut best = (f32::INFINITY, 0);
        for cut in 1..BINS {
            let side = |part: &[(Bounds, usize)]| {
                let (around, count) =
                    part.iter().fold((Bounds::NONE, 0), |sum, bin| (sum.0.union(bin.0), sum.1 + bin.1));
                around.half_area() * count as f32
            };
            let cost = side(&bins[..cut]) + side(&bins[cut..]);
            if cost < best.0 {
                best = (cost, cut);
            }
        }
        let mut first = 0;
        for at in 0..run.len() {
            if bin_of(run[at]) < best.1 {
                run.swap(at, first);
                first += 1;
            }
        }
        if first > 0 && first < run.len() {
            return first;
        }
    }
    let half = run.len() / 2;
    run.select_nth_unstable_by(half, |&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    half
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_box_is_in_one_leaf_and_in_all_nodes_above() {
        for count in [1_usize, 2, 3, 100, 1000] {
            let place = |at: usize| Vec3::new((at * 7 % 13) as f32, (at * at % 101) as f32, (at / 50) as f32);
            // Many at the same place too.
            let bounds: Vec<Bounds> =
                (0..count).map(|at| Bounds::NONE.with(place(at % 60)).with(place(at % 60) + 0.5)).collect();
            let (nodes, order) = tree(&bounds);
            let mut seen = vec![0; count];
            let mut open = vec![(0_usize, Bounds { low: Vec3::NEG_INFINITY, high: Vec3::INFINITY }, 1)];
            while let Some((at, outer, depth)) = open.pop() {
                assert!(depth < 48);
                let node = nodes[at];
                let inner = Bounds { low: node.low.into(), high: node.high.into() };
                assert_eq!(outer.union(inner), outer);
                if node.count == INNER_NODE {
                    open.extend([0, 1].map(|child| (node.first as usize + child, inner, depth + 1)));
                }
                let items = if node.count == INNER_NODE { 0..0 } else { node.first..node.first + node.count };
                for &item in &order[items.start as usize..items.end as usize] {
                    seen[item as usize] += 1;
                    assert_eq!(inner.union(bounds[item as usize]), inner);
                }
            }
            assert!(seen.iter().all(|&times| times == 1), "{seen:?}");
        }
    }
}
