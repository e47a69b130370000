//! Which triangles share an edge.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::NONE;
use super::halves::Half;

/// Vertices whose edges are paired in one go.
const BLOCK: usize = 4096;

/// For each edge of each triangle, the triangle beyond it. Edge `i` runs from corner `i` to the next.
///
/// Edges that run between the same vertices are paired in the order of their triangles: the first that
/// runs one way with the first that runs the other way, and so on.
pub(super) fn neighbours(halves: &[Half], vertices: usize) -> Vec<[u32; 3]> {
    let ends = |edge: u32| {
        let corners = &halves[edge as usize / 3].vertices;
        (corners[edge as usize % 3], corners[(edge as usize + 1) % 3])
    };
    // Edges by their lower vertex.
    let count = 3 * halves.len() as u32;
    let mut starts = vec![0u32; vertices + 1];
    for edge in 0..count {
        let (a, b) = ends(edge);
        starts[a.min(b) as usize + 1] += 1;
    }
    for vertex in 0..vertices {
        starts[vertex + 1] += starts[vertex];
    }
    let mut next = starts.clone();
    let mut edges = vec![0u64; count as usize];
    for edge in 0..count {
        let (a, b) = ends(edge);
        let slot = &mut next[a.min(b) as usize];
        edges[*slot as usize] = u64::from(a.max(b)) << 32 | u64::from(edge);
        *slot += 1;
    }
    drop(next);

    let found: Vec<AtomicU32> = (0..count).into_par_iter().map(|_| AtomicU32::new(NONE)).collect();
    let mut blocks = Vec::with_capacity(vertices / BLOCK + 1);
    let mut rest = &mut edges[..];
    for first in (0..vertices).step_by(BLOCK) {
        let bounds = &starts[first..=(first + BLOCK).min(vertices)];
        let (block, tail) = rest.split_at_mut((bounds[bounds.len() - 1] - bounds[0]) as usize);
        rest = tail;
        blocks.push((bounds, block));
    }
    blocks.into_par_iter().for_each(|(bounds, block)| {
        for range in bounds.windows(2) {
            let at_vertex = &mut block[(range[0] - bounds[0]) as usize..(range[1] - bounds[0]) as usize];
            at_vertex.sort_unstable();
            for run in at_vertex.chunk_by(|a, b| a >> 32 == b >> 32) {
                let rising = |edge: &u32| {
                    let (a, b) = ends(*edge);
                    a < b
                };
                let up = run.iter().map(|&edge| edge as u32).filter(rising);
                let down = run.iter().map(|&edge| edge as u32).filter(|edge| !rising(edge));
                for (a, b) in up.zip(down) {
                    found[a as usize].store(b / 3, Ordering::Relaxed);
                    found[b as usize].store(a / 3, Ordering::Relaxed);
                }
            }
        }
    });
    found
        .par_chunks_exact(3)
        .map(|edges| [0, 1, 2].map(|i: usize| edges[i].load(Ordering::Relaxed)))
        .collect()
}
