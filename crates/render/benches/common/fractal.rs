//! The rough map of the benches.

use rayon::prelude::*;

/// Texels along a side.
pub const SIZE: usize = 1024;

/// Value noise in octaves of half the height, tiling, in 0..1.
pub fn fractal() -> Vec<f32> {
    let hash = |octave: usize, i: usize, j: usize| {
        let mut x = ((octave * 4099 + i) * 4099 + j) as u64;
        x = (x ^ (x >> 30)).wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 40) as f32 / (1 << 24) as f32
    };
    let height = |at: usize| {
        let ease = |f: f32| f * f * (3.0 - 2.0 * f);
        (0..8).fold(0.0, |sum, octave| {
            let n = 4 << octave;
            let [x, y] = [at % SIZE, at / SIZE].map(|i| (i * n) as f32 / SIZE as f32);
            let (i, j, fx, fy) = (x as usize, y as usize, ease(x.fract()), ease(y.fract()));
            let node = |a: usize, b: usize| hash(octave, a % n, b % n);
            let top = node(i, j) + (node(i + 1, j) - node(i, j)) * fx;
            let bottom = node(i, j + 1) + (node(i + 1, j + 1) - node(i, j + 1)) * fx;
            sum + (top + (bottom - top) * fy) * 0.5_f32.powi(octave as i32)
        })
    };
    let raw: Vec<f32> = (0..SIZE * SIZE).into_par_iter().map(height).collect();
    let low = raw.iter().copied().fold(f32::INFINITY, f32::min);
    let high = raw.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    raw.iter().map(|h| (h - low) / (high - low)).collect()
}
