//! Triangles around a vertex that share one tangent, before opposite directions part them.

use super::NONE;
use super::halves::Half;

/// Corners by group.
pub(super) struct Groups {
    /// For each group where its members start, and the end of the last.
    starts: Vec<u32>,
    /// Members: `3 * triangle + corner`, in the order of the triangles.
    members: Vec<u32>,
}

impl Groups {
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    pub fn members(&self, group: usize) -> &[u32] {
        &self.members[self.starts[group] as usize..self.starts[group + 1] as usize]
    }
}

/// Collects, for each corner not yet in a group, the triangles of its orientation that are reached from
/// it over edges at its vertex. Triangles without a direction join the first group that finds them and
/// take its orientation.
pub(super) fn groups(halves: &mut [Half], neighbours: &[[u32; 3]]) -> Groups {
    let mut group_of = vec![[NONE; 3]; halves.len()];
    let mut starts: Vec<u32> = vec![0];
    let mut waiting: Vec<u32> = Vec::new();
    for first in 0..halves.len() {
        for start in 0..3 {
            if halves[first].any || group_of[first][start] != NONE {
                continue;
            }
            let group = starts.len() as u32 - 1;
            let (vertex, upright) = (halves[first].vertices[start], halves[first].upright);
            let mut size = 0;
            waiting.push(first as u32);
            while let Some(at) = waiting.pop() {
                let (half, own) = (&mut halves[at as usize], &mut group_of[at as usize]);
                let Some(corner) = half.vertices.iter().position(|&v| v == vertex) else { continue };
                if own[corner] != NONE {
                    continue;
                }
                if half.any && *own == [NONE; 3] {
                    half.upright = upright;
                }
                if half.upright != upright {
                    continue;
                }
                own[corner] = group;
                size += 1;
                // The edges at the vertex; the one that arrives there is followed first.
                let beyond = [corner, (corner + 2) % 3].map(|edge| neighbours[at as usize][edge]);
                waiting.extend(beyond.into_iter().filter(|&next| next != NONE));
            }
            starts.push(starts[group as usize] + size);
        }
    }
    let mut next = starts.clone();
    let mut members = vec![0; starts.last().map_or(0, |&end| end as usize)];
    for (corner, &group) in group_of.as_flattened().iter().enumerate().filter(|(_, group)| **group != NONE) {
        let slot = &mut next[group as usize];
        members[*slot as usize] = corner as u32;
        *slot += 1;
    }
    Groups { starts, members }
}
