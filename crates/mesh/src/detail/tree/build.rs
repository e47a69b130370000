//! From triangles to a tree.

use glam::Vec3;
use rayon::prelude::*;

use super::leaf::Leaf;
use super::sah::{Item, around, cut};
use super::split::{middle, runs};
use super::{Bounds, EMPTY, LANES, LEAF, Node, Tree, morton};

/// Cuts along a path of a branch after which halves are taken, so that no path grows long.
const DEEPEST: u32 = 48;
/// Leaves from which on items are cut along the Morton curve: enough branches for many threads.
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
        corners_of: impl Fn(u32) -> [Vec3; 3] + Sync,
        mut go_on: impl FnMut() -> bool,
    ) -> Option<Self> {
        let order = morton::order(triangles, |i| {
            let around = corners_of(i as u32).iter().fold(EMPTY, |b, &corner| b.with(corner.into()));
            around.low * 0.5 + around.high * 0.5
        });
        if !go_on() {
            return None;
        }
        let runs = runs(&order);
        let (mut leaves, mut items) = (Vec::new(), Vec::new());
        let made = runs.par_iter().with_min_len(256).enumerate().map(|(at, run)| {
            let triangles = order[run.clone()].iter().map(|&key| key as u32);
            let (leaf, bounds) = Leaf::new(triangles, &corners_of);
            (leaf, Item { bounds: widened(bounds), leaf: at as u32 })
        });
        made.unzip_into_vecs(&mut leaves, &mut items);
        if !go_on() {
            return None;
        }
        let mut nodes = Vec::new();
        let bounds = if items.len() < BRANCH {
            let bounds = around(&items);
            branch(&mut items, bounds, 0, &mut nodes);
            bounds
        } else {
            Crown::new(&mut items, |leaf| (order[runs[leaf as usize].start] >> 32) as u32).grow(&mut nodes)
        };
        go_on().then_some(Self { nodes, leaves, bounds })
    }
}

fn widened(bounds: Bounds) -> Bounds {
    let by = |p: glam::Vec3A| p.abs() * WIDER + f32::MIN_POSITIVE;
    Bounds { low: bounds.low - by(bounds.low), high: bounds.high + by(bounds.high) }
}

/// A child of a node of the crown.
#[derive(Clone, Copy)]
struct Place {
    node: usize,
    lane: usize,
}

/// The topmost nodes, cut along the Morton curve, which takes no time; what hangs below is built side by
/// side and by areas.
struct Crown<'a> {
    /// Parents first.
    nodes: Vec<Node>,
    /// Where each node hangs; the root nowhere.
    parents: Vec<Option<Place>>,
    branches: Vec<(Place, &'a mut [Item])>,
}

impl<'a> Crown<'a> {
    /// Over items that still lie along the curve; `code` of a leaf is where on it.
    fn new(items: &'a mut [Item], code: impl Fn(u32) -> u32) -> Self {
        let mut crown = Self { nodes: Vec::new(), parents: Vec::new(), branches: Vec::new() };
        let mut open = vec![(None, items)];
        while let Some((parent, items)) = open.pop() {
            let node = crown.nodes.len();
            crown.nodes.push(Node::new());
            crown.parents.push(parent);
            if let Some(Place { node: above, lane }) = parent {
                crown.nodes[above].child[lane] = node as u32;
            }
            for (lane, part) in eighths(items, &code).into_iter().enumerate() {
                let place = Place { node, lane };
                match part {
                    [] => {}
                    [item] => crown.nodes[node].set(lane, item.bounds, item.leaf | LEAF),
                    _ if part.len() < BRANCH => crown.branches.push((place, part)),
                    _ => open.push((Some(place), part)),
                }
            }
        }
        crown
    }

    /// Builds the branches; `nodes`, empty before, gets everything. Returns the box around it.
    fn grow(self, nodes: &mut Vec<Node>) -> Bounds {
        *nodes = self.nodes;
        let made: Vec<(Place, Bounds, Vec<Node>)> = self
            .branches
            .into_par_iter()
            .map(|(place, items)| {
                let (bounds, mut own) = (around(items), Vec::with_capacity(items.len() / 2));
                branch(items, bounds, 0, &mut own);
                (place, bounds, own)
            })
            .collect();
        for (Place { node, lane }, bounds, mut own) in made {
            let first = nodes.len() as u32;
            nodes[node].set(lane, bounds, first);
            for child in own.iter_mut().flat_map(|node| &mut node.child) {
                if *child & LEAF == 0 {
                    *child += first;
                }
            }
            nodes.append(&mut own);
        }
        let mut bounds = EMPTY;
        for (at, parent) in self.parents.iter().enumerate().rev() {
            bounds = (0..LANES).fold(EMPTY, |b, lane| b.union(nodes[at].bounds(lane)));
            if let &Some(Place { node, lane }) = parent {
                nodes[node].set(lane, bounds, at as u32);
            }
        }
        bounds
    }
}

/// Eight parts of some items along the curve, the largest cut first.
fn eighths<'a>(items: &'a mut [Item], code: &impl Fn(u32) -> u32) -> Vec<&'a mut [Item]> {
    let mut parts = vec![items];
    while parts.len() < LANES {
        let Some(at) = (0..parts.len()).max_by_key(|&at| parts[at].len()).filter(|&at| parts[at].len() > 1)
        else {
            break;
        };
        let part = std::mem::take(&mut parts[at]);
        let cut = middle(part.len(), |at| code(part[at].leaf)).unwrap_or(part.len() / 2);
        let (first, second) = part.split_at_mut(cut);
        parts[at] = first;
        parts.push(second);
    }
    parts
}

/// A child of a node that is being made: a run of items, and how many cuts led to it.
struct Part {
    start: usize,
    end: usize,
    bounds: Bounds,
    depth: u32,
}

/// Appends the nodes over some items, whose boxes `bounds` holds, the topmost first.
fn branch(items: &mut [Item], bounds: Bounds, depth: u32, nodes: &mut Vec<Node>) {
    let top = nodes.len();
    nodes.push(Node::new());
    if items.len() <= LANES {
        for (lane, item) in items.iter().enumerate() {
            nodes[top].set(lane, item.bounds, item.leaf | LEAF);
        }
        return;
    }
    let mut parts = Vec::with_capacity(LANES);
    parts.push(Part { start: 0, end: items.len(), bounds, depth });
    while parts.len() < LANES {
        // The largest part is cut next; one leaf cannot be.
        let widest = parts
            .iter()
            .enumerate()
            .filter(|(_, part)| part.end - part.start > 1)
            .max_by(|(_, a), (_, b)| a.bounds.half_area().total_cmp(&b.bounds.half_area()));
        let Some((at, _)) = widest else { break };
        let Part { start, end, depth, .. } = parts.swap_remove(at);
        let (first, bounds) = cut(&mut items[start..end], depth >= DEEPEST);
        let ends = [(start, start + first), (start + first, end)];
        for ((start, end), bounds) in ends.into_iter().zip(bounds) {
            parts.push(Part { start, end, bounds, depth: depth + 1 });
        }
    }
    for (lane, Part { start, end, bounds, depth }) in parts.into_iter().enumerate() {
        match &mut items[start..end] {
            [] => {}
            [item] => nodes[top].set(lane, bounds, item.leaf | LEAF),
            own => {
                let first = nodes.len() as u32;
                nodes[top].set(lane, bounds, first);
                branch(own, bounds, depth, nodes);
            }
        }
    }
}
