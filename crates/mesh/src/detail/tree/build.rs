//! From triangles to a tree.

use super::leaf::Leaf;
use super::sah::{Item, around, cut};
use super::{Bounds, EMPTY, LANES, LEAF, Node, Tree, morton};
use rayon::prelude::*;

/// Cuts along a path from the root after which halves are taken, so that no path grows long.
const DEEPEST: u32 = 48;
/// Leaves below which a branch is built by one thread.
const BRANCH: usize = 2048;
/// Share of the coordinates by which boxes are widened, so that rounding in the tests of boxes never
/// hides a triangle.
const WIDER: f32 = 4.0 * f32::EPSILON;

impl Tree {
    /// A tree over triangles with finite corners; at most 2^31 of them.
    ///
    /// `go_on` is asked between the phases; `None` when it says no.
    pub(crate) fn new(
        triangles: usize,
        corners_of: impl Fn(u32) -> [[f32; 3]; 3] + Sync,
        mut go_on: impl FnMut() -> bool,
    ) -> Option<Self> {
        let order = morton::order(triangles, |i| {
            corners_of(i as u32).iter().fold(EMPTY, |b, &corner| b.with(corner))
        });
        if !go_on() {
            return None;
        }
        let runs = super::split::runs(&order);
        let (leaves, mut items): (Vec<Leaf>, Vec<Item>) = runs
            .par_iter()
            .with_min_len(256)
            .enumerate()
            .map(|(at, run)| {
                let triangles = order[run.clone()].iter().map(|&key| key as u32);
                let (leaf, bounds) = Leaf::new(triangles, &corners_of);
                (leaf, Item { bounds: widened(bounds), leaf: at as u32 })
            })
            .unzip();
        drop(order);
        if !go_on() {
            return None;
        }
        let bounds = around(&items);
        let mut nodes = Vec::new();
        branch(&mut items, 0, &mut nodes);
        go_on().then_some(Self { nodes, leaves, bounds })
    }
}

fn widened(bounds: Bounds) -> Bounds {
    let by = |x: f32| x.abs() * WIDER + f32::MIN_POSITIVE;
    Bounds { low: bounds.low.map(|x| x - by(x)), high: bounds.high.map(|x| x + by(x)) }
}

/// A child of a node that is being made: a run of items, and how many cuts led to it.
struct Part {
    start: usize,
    end: usize,
    bounds: Bounds,
    depth: u32,
}

/// Appends the nodes over some items, the topmost first.
fn branch(items: &mut [Item], depth: u32, nodes: &mut Vec<Node>) {
    let mut parts = vec![Part { start: 0, end: items.len(), bounds: around(items), depth }];
    while parts.len() < LANES {
        // The largest part is cut next; one leaf cannot be.
        let widest = parts
            .iter()
            .enumerate()
            .filter(|(_, part)| part.end - part.start > 1)
            .max_by(|(_, a), (_, b)| a.bounds.half_area().total_cmp(&b.bounds.half_area()));
        let Some((at, _)) = widest else { break };
        let Part { start, end, depth, .. } = parts.swap_remove(at);
        let middle = start + cut(&mut items[start..end], depth >= DEEPEST);
        for (start, end) in [(start, middle), (middle, end)] {
            parts.push(Part { start, end, bounds: around(&items[start..end]), depth: depth + 1 });
        }
    }
    parts.sort_unstable_by_key(|part| part.start);
    let top = nodes.len();
    nodes.push(Node::new());
    let mut rest = items;
    let mut taken = 0;
    let mut jobs: Vec<(usize, Part, &mut [Item])> = Vec::with_capacity(LANES);
    for (lane, part) in parts.into_iter().enumerate() {
        let (own, after) = std::mem::take(&mut rest).split_at_mut(part.end - taken);
        (rest, taken) = (after, part.end);
        match own {
            [] => {}
            [item] => nodes[top].set(lane, part.bounds, item.leaf | LEAF),
            _ => jobs.push((lane, part, own)),
        }
    }
    let large = jobs.iter().map(|job| job.2.len()).sum::<usize>() >= BRANCH;
    if large {
        let made: Vec<(usize, Bounds, Vec<Node>)> = jobs
            .into_par_iter()
            .map(|(lane, part, own)| {
                let mut nodes = Vec::new();
                branch(own, part.depth, &mut nodes);
                (lane, part.bounds, nodes)
            })
            .collect();
        for (lane, bounds, mut own) in made {
            let first = nodes.len() as u32;
            nodes[top].set(lane, bounds, first);
            for child in own.iter_mut().flat_map(|node| &mut node.child) {
                if *child & LEAF == 0 {
                    *child += first;
                }
            }
            nodes.append(&mut own);
        }
    } else {
        for (lane, part, own) in jobs {
            let first = nodes.len() as u32;
            nodes[top].set(lane, part.bounds, first);
            branch(own, part.depth, nodes);
        }
    }
}
