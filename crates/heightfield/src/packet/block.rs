//! The rays of a block that still look for their hit, side by side in arrays.

use super::grid::Axis;
use crate::lanes::Lanes;
use crate::rays::load;
use crate::{HeightField, RayArray};

/// Rays in a block: their state stays in the second-level cache.
pub const BLOCK: usize = 512;
/// Vectors may be written whole behind the last ray.
pub const ROOM: usize = BLOCK + 16;

/// Farthest a ray may go along an axis from lid to floor, in cells: with more, `f32` positions are off
/// by more than the margins allow.
const FARTHEST: f64 = (1 << 20) as f64;

/// Row of [`Block::single`] that holds the drops.
pub const DROP: usize = 6;
/// Row of [`Block::double`] that holds the drops.
pub const FINE_DROP: usize = 4;

/// Rays in arrays. Ray `i` of the block is at a slot below `len` as long as it looks for its hit.
pub struct Block {
    /// Start x, y and direction x, y in tiles, inverse direction x, y in cells, drop.
    pub single: [[f32; ROOM]; 7],
    /// Start x, y and direction x, y in cells, drop.
    pub double: [[f64; ROOM]; 5],
    /// Which ray of the block.
    pub ray: [i32; ROOM],
    /// Nodes and cells visited.
    pub steps: [i32; ROOM],
    /// Rays that still look.
    pub len: usize,
}

/// What is kept of every ray of a block.
pub struct Results {
    /// Drop of the hit below the highest point; NaN for rays that need the search for one.
    pub drop: [f64; ROOM],
    /// Nodes and cells visited.
    pub steps: [i32; ROOM],
    /// Drop of the origin, and ray parameter for one unit of drop.
    pub begin: [f64; ROOM],
    /// See `begin`.
    pub scale: [f64; ROOM],
}

impl Results {
    /// Nothing yet.
    pub fn new() -> Self {
        Self { drop: [0.0; ROOM], steps: [0; ROOM], begin: [0.0; ROOM], scale: [0.0; ROOM] }
    }
}

impl Block {
    /// An empty block.
    pub fn new() -> Self {
        Self { single: [[0.0; ROOM]; 7], double: [[0.0; ROOM]; 5], ray: [0; ROOM], steps: [0; ROOM], len: 0 }
    }

    /// Takes in rays, at most [`BLOCK`]. `drops` says how far down each group of four is free.
    ///
    /// Rays that do not go down, or not steeply enough, are left out: their result is NaN.
    #[inline(always)]
    pub fn fill<L: Lanes>(
        &mut self,
        field: &HeightField,
        origins: RayArray<'_>,
        directions: RayArray<'_>,
        drops: &[f32],
        results: &mut Results,
    ) {
        let size = [L::splat_wide(field.width() as f64), L::splat_wide(field.height() as f64)];
        let [nx, ny] = field.cells();
        let cells = [L::splat_wide(nx as f64), L::splat_wide(ny as f64)];
        let shift = L::splat_wide(0.5 + field.first_texel() as f64);
        let highest = L::splat_wide(f64::from(field.pyramid().highest()));
        let zero = L::splat_wide(0.0);
        let slack = L::splat(crate::margin::SLACK);
        self.len = 0;
        for at in (0..origins.len()).step_by(L::WIDTH) {
            let slot = self.len;
            let o = load::<L>(origins, at);
            let d = load::<L>(directions, at);
            let scale = L::splat_wide(-1.0) / d[2];
            let begin = highest - o[2];
            L::store_wide(scale, &mut results.scale[at..]);
            L::store_wide(begin, &mut results.begin[at..]);
            L::store_wide(L::splat_wide(f64::NAN), &mut results.drop[at..]);
            let mut usable = L::first(origins.len() - at) & L::lt_wide(d[2], zero);
            for k in 0..2 {
                let direction = d[k] * size[k] * scale;
                let distance = L::max_wide(direction, zero - direction);
                usable = usable & L::le_wide(distance, L::splat_wide(FARTHEST));
                let start = o[k] * size[k] - shift - begin * direction;
                let tiles = start / cells[k];
                let tiles = if field.is_periodic() { tiles - L::floor_wide(tiles) } else { tiles };
                L::store(L::narrow(tiles), &mut self.single[k][slot..]);
                L::store(L::narrow(direction / cells[k]), &mut self.single[2 + k][slot..]);
                L::store(Axis::<L>::inverse_of(L::narrow(direction)), &mut self.single[4 + k][slot..]);
                L::store_wide(tiles * cells[k], &mut self.double[k][slot..]);
                L::store_wide(direction, &mut self.double[2 + k][slot..]);
            }
            // A ray starts at its origin or at the highest point, whichever is lower.
            let from = L::max_wide(begin, zero);
            let mut free = [0.0; 16];
            let mut ray = [0; 16];
            for i in 0..L::WIDTH {
                free[i] = drops[((at + i) / 4).min(drops.len() - 1)];
                ray[i] = (at + i) as i32;
            }
            let rounded_down = L::narrow(from) - (slack + slack * L::narrow(from));
            L::store(L::max(L::load(&free), rounded_down), &mut self.single[DROP][slot..]);
            L::store_wide(from, &mut self.double[FINE_DROP][slot..]);
            L::store_int(L::load_int(&ray), &mut self.ray[slot..]);
            L::store_int(L::splat_int(0), &mut self.steps[slot..]);
            self.keep::<L>(slot, usable);
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
