//! Triangles along a Morton curve.

use glam::{Vec3, Vec3A};
use rayon::prelude::*;

use super::{Bounds, EMPTY};

/// Bits of a digit of the radix sort.
const DIGIT: u32 = 11;
/// Runs of equal codes up to this length are left as they are: they fit one leaf.
const SHORT: usize = super::LANES;

/// Maps points of a box to codes.
struct Cells {
    low: [f64; 3],
    /// Cells of the fine grid per mesh unit, the same along every axis.
    density: f64,
}

/// Cells of the fine grid along the longest side of the box.
const FINE: f64 = (1u64 << 20) as f64;

impl Cells {
    fn new(bounds: Bounds) -> Self {
        let low = bounds.low.to_array().map(f64::from);
        let longest =
            (0..3).map(|k| f64::from(bounds.high[k]) - low[k]).fold(0.0, |a: f64, side| a.max(side));
        Self { low, density: if longest > 0.0 { FINE / longest } else { 0.0 } }
    }

    /// 60 bits, x in the highest.
    #[inline(always)]
    fn code(&self, p: Vec3) -> u64 {
        let cell = |k: usize| ((f64::from(p[k]) - self.low[k]) * self.density).clamp(0.0, FINE - 1.0) as u64;
        spread(cell(0)) << 2 | spread(cell(1)) << 1 | spread(cell(2))
    }
}

/// Moves bit `i` of a 20-bit number to bit `3 i`.
#[inline(always)]
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// The triangles in the order of their centres along the curve, each with the first half of its code
/// in the high word and its index in the low one.
pub(super) fn order(triangles: usize, centre_of: impl Fn(usize) -> Vec3A + Sync) -> Vec<u64> {
    let centres: Vec<Vec3> =
        (0..triangles).into_par_iter().with_min_len(1 << 14).map(|i| centre_of(i).into()).collect();
    let centre = |i: usize| centres[i];
    let around = centres
        .par_iter()
        .with_min_len(1 << 14)
        .fold(|| EMPTY, |b, &p| b.with(p.into()))
        .reduce(|| EMPTY, Bounds::union);
    let cells = Cells::new(around);
    let mut keys: Vec<u64> = (0..triangles)
        .into_par_iter()
        .with_min_len(1 << 14)
        .map(|i| (cells.code(centre(i)) >> 30) << 32 | i as u64)
        .collect();
    sort(&mut keys);
    refine(&mut keys, |i| cells.code(centre(i)));
    keys
}

/// Radix sort by the high word.
fn sort(keys: &mut Vec<u64>) {
    let mut other = vec![0; keys.len()];
    for shift in [32, 32 + DIGIT, 32 + 2 * DIGIT] {
        let digit = |key: u64| (key >> shift) as usize & ((1 << DIGIT) - 1);
        let mut places = [0usize; 1 << DIGIT];
        keys.iter().for_each(|&key| places[digit(key)] += 1);
        let mut sum = 0;
        for place in &mut places {
            sum += std::mem::replace(place, sum);
        }
        for &key in keys.iter() {
            let place = &mut places[digit(key)];
            other[*place] = key;
            *place += 1;
        }
        std::mem::swap(keys, &mut other);
    }
}

/// Sorts long runs of one code by the rest of it.
fn refine(keys: &mut [u64], code: impl Fn(usize) -> u64 + Sync) {
    keys.chunk_by_mut(|a, b| a >> 32 == b >> 32).filter(|run| run.len() > SHORT).for_each(|run| {
        run.par_sort_by_cached_key(|&key| code(key as u32 as usize));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_moves_every_bit() {
        for bit in 0..20 {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread((1 << 20) - 1).count_ones(), 20);
    }

    #[test]
    fn the_order_is_that_of_a_comparison_sort() {
        let point = |i: usize| {
            let x = |k: u32| (i as u32).wrapping_mul(2_654_435_761).rotate_left(k) as f32 / 4e9;
            Vec3A::new(x(0), x(9), if i.is_multiple_of(3) { 0.5 } else { x(20) })
        };
        let found = order(5000, point);
        let around = (0..5000).fold(EMPTY, |b, i| b.with(point(i)));
        let cells = Cells::new(around);
        let codes: Vec<u64> =
            found.iter().map(|&k| cells.code(point(k as u32 as usize).into()) >> 30).collect();
        assert!(codes.is_sorted());
        let mut seen: Vec<u32> = found.iter().map(|&k| k as u32).collect();
        seen.sort_unstable();
        assert!(seen.into_iter().eq(0..5000));
    }

    #[test]
    fn points_in_one_place_and_points_of_one_cell_are_sorted_too() {
        let one = order(100, |_| Vec3A::splat(2.0));
        assert_eq!(one.len(), 100);
        // One far point squeezes the rest into one cell of the first half of the code.
        let x = |i: usize| if i == 99 { 1.0 } else { ((i * 37) % 99) as f32 * 1e-6 };
        let squeezed = order(100, |i| Vec3A::new(x(i), 0.0, 0.0));
        let places: Vec<f32> = squeezed.iter().map(|&k| x(k as u32 as usize)).collect();
        assert!(places.is_sorted(), "{places:?}");
    }
}
