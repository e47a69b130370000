//! The rays of a block that still look for their hit, side by side in arrays.

use std::ops::Range;

use super::beams::{BUNDLE, Bundles, Enclosing};
use super::grid::Axis;
use crate::HeightField;
use crate::chunk::Chunk;
use crate::lanes::Lanes;
use crate::order::RUN;
use crate::rays::{load, load_runs};

/// Rays taken into a block at a time.
pub const BATCH: usize = 1024;
/// Rays that may still look when others are taken in: their state stays in the second-level cache.
pub const LEFT: usize = 256;
/// Vectors may be written whole behind the last ray.
const ROOM: usize = BATCH + LEFT + 64;
/// Farthest a ray may go along an axis from lid to floor, in cells: with more, `f32` positions are off
/// by more than the margins allow.
const FARTHEST: f64 = (1 << 20) as f64;

/// Row of [`Block::single`] that holds the drops.
pub const DROP: usize = 6;
/// Row of [`Block::single`] that holds the levels to go on at.
pub const LEVEL: usize = 7;
/// Row of [`Block::double`] that holds the drops.
pub const FINE_DROP: usize = 4;

/// Rays in arrays. A ray is at a slot below `len` as long as it looks for its hit.
pub struct Block {
    /// Start x, y and direction x, y in tiles, inverse direction x, y in cells, drop, level.
    pub single: [[f32; ROOM]; 8],
    /// Start x, y and direction x, y in cells, drop.
    pub double: [[f64; ROOM]; 5],
    /// Nodes and cells visited.
    pub steps: [i32; ROOM],
    /// Which ray of the chunk.
    pub ray: [i32; ROOM],
    /// How many there are.
    pub len: usize,
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
        Self { single: [[0.0; ROOM]; 8], double: [[0.0; ROOM]; 5], steps: [0; ROOM], ray: [0; ROOM], len: 0 }
    }

    /// Takes in the rays at some places of the order, at most [`BATCH`], and says which lie together.
    ///
    /// Rays that do not go down, or not steeply enough, are left out: their result stays as it is.
    #[inline(always)]
    pub fn fill<L: Lanes>(
        &mut self,
        field: &HeightField,
        chunk: &Chunk<'_>,
        places: Range<usize>,
        bundles: &mut Bundles,
    ) {
        let size = [L::splat_wide(field.width() as f64), L::splat_wide(field.height() as f64)];
        let cells = field.cells().map(|n| L::splat_wide(n as f64));
        let inverse = field.cells().map(|n| L::splat_wide(1.0 / n as f64));
        let shift = L::splat_wide(0.5 + field.first_texel() as f64);
        let highest = L::splat_wide(f64::from(field.pyramid().highest()));
        let (zero, minus) = (L::splat_wide(0.0), L::splat_wide(-1.0));
        let slack = L::splat(crate::margin::SLACK);
        let lanes = L::load_int(&std::array::from_fn::<i32, 16, _>(|lane| lane as i32));
        bundles.clear();
        for bundle in places.clone().step_by(BUNDLE) {
            let first = self.len;
            let mut enclosing = Enclosing::<L>::nothing();
            let end = places.end.min(bundle + BUNDLE);
            for at in (bundle..end).step_by(L::WIDTH) {
                let slot = self.len;
                let (o, d, ray);
                if let Some(&run) = chunk.order.get(at / RUN) {
                    let next = chunk.order[(at / RUN + 1).min(chunk.order.len() - 1)];
                    let starts = [run as usize + at % RUN, next as usize];
                    o = load_runs::<L>(chunk.origins, starts);
                    d = load_runs::<L>(chunk.directions, starts);
                    let late = L::splat_int(starts[1] as i32 - RUN as i32);
                    ray = lanes + L::select_int(L::first(RUN), L::splat_int(starts[0] as i32), late);
                } else {
                    o = load::<L>(chunk.origins, at);
                    d = load::<L>(chunk.directions, at);
                    ray = lanes + L::splat_int(at as i32);
                }
                L::store_int(ray, &mut self.ray[slot..]);
                let scale = minus / d[2];
                let begin = highest - o[2];
                let mut usable = L::first(end - at) & L::lt_wide(d[2], zero);
                let (mut starts, mut ends) = ([L::splat(0.0); 2], [L::splat(0.0); 2]);
                for k in 0..2 {
                    let direction = d[k] * size[k] * scale;
                    let distance = L::max_wide(direction, zero - direction);
                    usable = usable & L::le_wide(distance, L::splat_wide(FARTHEST));
                    let mut start = o[k] * size[k] - shift - begin * direction;
                    if field.is_periodic() {
                        start = start - L::floor_wide(start * inverse[k]) * cells[k];
                    }
                    let tiles = L::narrow(start * inverse[k]);
                    let along = L::narrow(direction * inverse[k]);
                    starts[k] = tiles;
                    ends[k] = tiles + along;
                    L::store(tiles, &mut self.single[k][slot..]);
                    L::store(along, &mut self.single[2 + k][slot..]);
                    L::store(Axis::<L>::inverse_of(L::narrow(direction)), &mut self.single[4 + k][slot..]);
                    L::store_wide(start, &mut self.double[k][slot..]);
                    L::store_wide(direction, &mut self.double[2 + k][slot..]);
                }
                // A ray starts at its origin or at the highest point, whichever is lower.
                let from = L::max_wide(begin, zero);
                let rounded_down = L::narrow(from) - (slack + slack * L::narrow(from));
                L::store(rounded_down, &mut self.single[DROP][slot..]);
                L::store_wide(from, &mut self.double[FINE_DROP][slot..]);
                L::store_int(L::splat_int(0), &mut self.steps[slot..]);
                enclosing.add(usable, starts, ends);
                self.keep::<L>(slot, usable);
            }
            if first < self.len {
                bundles.push(first..self.len, &enclosing);
            }
        }
    }

    /// Moves the chosen rays of the vector at `from` to the end of those kept so far.
    #[inline(always)]
    pub fn keep<L: Lanes>(&mut self, from: usize, chosen: L::M) {
        let to = self.len;
        let count = L::bits(chosen).count_ones() as usize;
        self.len += count;
        if from == to && count == L::WIDTH {
            return;
        }
        for row in &mut self.single {
            let x = L::load(&row[from..]);
            L::compress(chosen, x, &mut row[to..]);
        }
        for row in &mut self.double {
            let x = L::load_wide(&row[from..]);
            L::compress_wide(chosen, x, &mut row[to..]);
        }
        for row in [&mut self.ray, &mut self.steps] {
            let x = L::load_int(&row[from..]);
            L::compress_int(chosen, x, &mut row[to..]);
        }
    }
}
