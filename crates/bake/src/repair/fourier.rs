//! Slopes to heights and back on a periodic grid, by one complex Fourier transform.
//!
//! With real odd symbols `a`, `b` a difference along x is `i a`, one along y `i b` (for a smooth
//! function's true derivative `a` is the frequency itself). The least-squares heights of slopes `p, q` are
//!
//! `H = (-i a P - i b Q) / (a^2 + b^2)`
//!
//! Packed as `Z = FFT(p + i q)` that is the part of `(-i a - b) Z / (a^2 + b^2)` which belongs to a real
//! function; the other part is imaginary in space. So one transform there and back gives the
//! heights as real parts, and `(i a - b) H` the slopes as real and imaginary parts. Source: Frankot
//! and Chellappa 1988, "A method for enforcing integrability in shape from shading algorithms".

use std::f64::consts::TAU;
use std::sync::Arc;

use rayon::prelude::*;
use rustfft::num_complex::Complex32;
use rustfft::{Fft, FftPlanner};

/// Texels of a task that transposes.
const BLOCK: usize = 32;

/// Symbols of one axis, by frequency.
#[derive(Clone, Copy)]
pub(super) struct Symbol {
    /// `a` of the derivative, in 1 / texel.
    pub derivative: f64,
    /// The smoothing along this axis in derivatives along the other one.
    pub smoothing: f64,
    /// The frequency in radians a texel, squared.
    pub square: f64,
    /// Its sine: the derivative of slopes halfway between texels.
    pub sine: f64,
    /// `(2 sin(frequency / 2))^2`: that of the difference between neighbours, squared.
    pub chord: f64,
}

/// A two-dimensional transform of one size.
pub(super) struct Transform {
    size: [usize; 2],
    forward: [Arc<dyn Fft<f32>>; 2],
    inverse: [Arc<dyn Fft<f32>>; 2],
}

impl Transform {
    pub fn new(size: [usize; 2]) -> Self {
        let mut planner = FftPlanner::new();
        let forward = size.map(|n| planner.plan_fft_forward(n));
        let inverse = size.map(|n| planner.plan_fft_inverse(n));
        Self { size, forward, inverse }
    }

    /// The symbols along an axis, made from frequencies in radians a texel; the highest one of an even
    /// size is told apart, for an odd symbol is 0 there.
    pub fn symbols(&self, axis: usize, symbol: impl Fn(f64, bool) -> Symbol) -> Vec<Symbol> {
        let n = self.size[axis];
        (0..n)
            .map(|k| {
                let signed = if 2 * k > n { k as f64 - n as f64 } else { k as f64 };
                symbol(TAU * signed / n as f64, 2 * k == n)
            })
            .collect()
    }

    /// Multiplies the spectrum of `plane` by `multiplier(kx, ky)`.
    pub fn filter(&self, plane: &mut Vec<Complex32>, multiplier: impl Fn(usize, usize) -> Complex32 + Sync) {
        let [width, height] = self.size;
        run(plane, width, &self.forward[0]);
        let mut turned = transposed(plane, width, height);
        run(&mut turned, height, &self.forward[1]);
        let norm = 1.0 / (width * height) as f32;
        turned.par_chunks_mut(height).enumerate().for_each(|(kx, column)| {
            for (ky, value) in column.iter_mut().enumerate() {
                *value = *value * multiplier(kx, ky) * norm;
            }
        });
        run(&mut turned, height, &self.inverse[1]);
        *plane = transposed(&turned, height, width);
        drop(turned);
        run(plane, width, &self.inverse[0]);
    }
}

/// Transforms every row.
fn run(plane: &mut [Complex32], width: usize, fft: &Arc<dyn Fft<f32>>) {
    plane.par_chunks_mut(width).for_each_init(
        || vec![Complex32::default(); fft.get_inplace_scratch_len()],
        |scratch, row| fft.process_with_scratch(row, scratch),
    );
}

/// Rows of `width` as columns.
fn transposed(plane: &[Complex32], width: usize, height: usize) -> Vec<Complex32> {
    let mut turned = vec![Complex32::default(); plane.len()];
    turned.par_chunks_mut(BLOCK * height).enumerate().for_each(|(block, columns)| {
        let first = block * BLOCK;
        for (j, row) in plane.chunks_exact(width).enumerate() {
            for (k, column) in columns.chunks_exact_mut(height).enumerate() {
                column[j] = row[first + k];
            }
        }
    });
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_done_is_nothing_changed() {
        for size in [[1, 1], [1, 7], [8, 1], [12, 35], [33, 64]] {
            let plane: Vec<Complex32> = (0..size[0] * size[1])
                .map(|i| Complex32::new(((i * 7919) % 101) as f32, ((i * 31) % 17) as f32))
                .collect();
            let mut found = plane.clone();
            Transform::new(size).filter(&mut found, |_, _| Complex32::new(1.0, 0.0));
            assert!(found.iter().zip(&plane).all(|(a, b)| (a - b).norm() < 1e-4));
        }
    }
}
