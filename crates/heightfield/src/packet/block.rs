//! The rays of a block that still look for their hit, side by side in arrays.

use std::ops::Range;

use super::grid::Axis;
use crate::HeightField;
use crate::chunk::Chunk;
use crate::lanes::Lanes;
use crate::rays::{load, load_numbered};

/// Rays taken into a block at a time.
pub const BATCH: usize = 1024;
/// Rays that may still look when others are taken in: their state stays in the second-level cache.
pub const LEFT: usize = 256;
/// Vectors may be written whole behind the last ray.
const ROOM: usize = BATCH + LEFT + 16;
/// Farthest a ray may go along an axis from lid to floor, in cells: with more, `f32` positions are off
/// by more than the margins allow.
const FARTHEST: f64 = (1 << 20) as f64;

/// Row of [`Block::single`] that holds the drops.
pub const DROP: usize = 6;
/// Row of [`Block::single`] that holds the levels to go on at.
pub const LEVEL: usize = 7;
/// Row of [`Block::double`] that holds the drops.
pub const FINE_DROP: usize = 4;

/// Rays, or bundles of them, that step from node to node: what [`super::coarse::walk`] needs.
pub struct Queue {
    /// Start x, y and direction x, y in tiles, inverse direction x, y in cells, drop, level.
    pub single: [[f32; ROOM]; 8],
    /// Nodes and cells visited.
    pub steps: [i32; ROOM],
    /// How many there are.
    pub len: usize,
}

impl Queue {
    /// An empty queue.
    pub fn new() -> Self {
        Self { single: [[0.0; ROOM]; 8], steps: [0; ROOM], len: 0 }
    }
}

/// Rays in arrays. A ray is at a slot below `queue.len` as long as it looks for its hit.
pub struct Block {
    pub queue: Queue,
    /// Start x, y and direction x, y in cells, drop.
    pub double: [[f64; ROOM]; 5],
    /// Which ray of the chunk.
    pub ray: [i32; ROOM],
}

/// What is found out of every ray of a chunk.
pub struct Results {
    /// Drop of the hit below the highest point; NaN for rays that need the search for one.
    pub drop: Vec<f64>,
    /// Nodes and cells visited.
    pub steps: Vec<i32>,
}

impl Results {
    /// Nothing yet of so many rays. Vectors may be read whole behind the last.
    pub fn new(rays: usize) -> Self {
        Self { drop: vec![f64::NAN; rays + 16], steps: vec![0; rays + 16] }
    }
}

impl Block {
    /// An empty block.
    pub fn new() -> Self {
        Self { queue: Queue::new(), double: [[0.0; ROOM]; 5], ray: [0; ROOM] }
    }

    /// Takes in the rays at some places of the order, at most [`BATCH`].
    ///
    /// Rays that do not go down, or not steeply enough, are left out: their result stays as it is.
    #[inline(always)]
    pub fn fill<L: Lanes>(&mut self, field: &HeightField, chunk: &Chunk<'_>, places: Range<usize>) {
        let size = [L::splat_wide(field.width() as f64), L::splat_wide(field.height() as f64)];
        let cells = field.cells().map(|n| L::splat_wide(n as f64));
        let inverse = field.cells().map(|n| L::splat_wide(1.0 / n as f64));
        let shift = L::splat_wide(0.5 + field.first_texel() as f64);
        let highest = L::splat_wide(f64::from(field.pyramid().highest()));
        let zero = L::splat_wide(0.0);
        let slack = L::splat(crate::margin::SLACK);
        let lanes: [i32; 16] = std::array::from_fn(|lane| lane as i32);
        for at in places.clone().step_by(L::WIDTH) {
            let slot = self.queue.len;
            let end = places.end.min(at + L::WIDTH);
            let (o, d);
            if let Some(numbers) = chunk.order.get(at..end) {
                o = load_numbered::<L>(chunk.origins, numbers);
                d = load_numbered::<L>(chunk.directions, numbers);
                for (ray, &number) in self.ray[slot..].iter_mut().zip(numbers) {
                    *ray = number as i32;
                }
            } else {
                o = load::<L>(chunk.origins, at);
                d = load::<L>(chunk.directions, at);
                L::store_int(L::load_int(&lanes) + L::splat_int(at as i32), &mut self.ray[slot..]);
            }
            let scale = L::splat_wide(-1.0) / d[2];
            let begin = highest - o[2];
            let mut usable = L::first(places.end - at) & L::lt_wide(d[2], zero);
            let single = &mut self.queue.single;
            for k in 0..2 {
                let direction = d[k] * size[k] * scale;
                let distance = L::max_wide(direction, zero - direction);
                usable = usable & L::le_wide(distance, L::splat_wide(FARTHEST));
                let mut start = o[k] * size[k] - shift - begin * direction;
                if field.is_periodic() {
                    start = start - L::floor_wide(start * inverse[k]) * cells[k];
                }
                L::store(L::narrow(start * inverse[k]), &mut single[k][slot..]);
                L::store(L::narrow(direction * inverse[k]), &mut single[2 + k][slot..]);
                L::store(Axis::<L>::inverse_of(L::narrow(direction)), &mut single[4 + k][slot..]);
                L::store_wide(start, &mut self.double[k][slot..]);
                L::store_wide(direction, &mut self.double[2 + k][slot..]);
            }
            // A ray starts at its origin or at the highest point, whichever is lower.
            let from = L::max_wide(begin, zero);
            let rounded_down = L::narrow(from) - (slack + slack * L::narrow(from));
            L::store(rounded_down, &mut single[DROP][slot..]);
            L::store_wide(from, &mut self.double[FINE_DROP][slot..]);
            L::store_int(L::splat_int(0), &mut self.queue.steps[slot..]);
            self.keep::<L>(slot, usable);
        }
    }

    /// Moves the chosen rays of the vector at `from` to the end of those kept so far.
    #[inline(always)]
    pub fn keep<L: Lanes>(&mut self, from: usize, chosen: L::M) {
        let to = self.queue.len;
        let count = L::bits(chosen).count_ones() as usize;
        self.queue.len += count;
        if from == to && count == L::WIDTH {
            return;
        }
        for row in &mut self.queue.single {
            let x = L::load(&row[from..]);
            L::compress(chosen, x, &mut row[to..]);
        }
        for row in &mut self.double {
            let x = L::load_wide(&row[from..]);
            L::compress_wide(chosen, x, &mut row[to..]);
        }
        for row in [&mut self.ray, &mut self.queue.steps] {
            let x = L::load_int(&row[from..]);
            L::compress_int(chosen, x, &mut row[to..]);
        }
    }
}
