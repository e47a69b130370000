//! Arrays of rays, and which rays nothing can follow.

use num_traits::Float;
use rayon::prelude::*;

use crate::HeightFieldError;
use crate::lanes::{Kernel, Lanes, dispatch};
use crate::order::RUN;

/// Rays looked at by one task at a time.
const CHUNK: usize = 1 << 14;

/// Ray origins or directions: N * 3 numbers, `(u, v, z)` after one another.
///
/// `f64` rays are followed in `f64` by the exact search and rounded for the others.
#[derive(Debug, Clone, Copy)]
pub enum RayArray<'a> {
    /// Single precision.
    F32(&'a [f32]),
    /// Double precision.
    F64(&'a [f64]),
}

impl<'a> RayArray<'a> {
    /// Number of rays.
    #[inline(always)]
    pub fn len(&self) -> usize {
        match self {
            Self::F32(a) => a.len() / 3,
            Self::F64(a) => a.len() / 3,
        }
    }

    /// Whether there are none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Ray `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> [f64; 3] {
        match self {
            Self::F32(a) => [a[3 * i], a[3 * i + 1], a[3 * i + 2]].map(f64::from),
            Self::F64(a) => [a[3 * i], a[3 * i + 1], a[3 * i + 2]],
        }
    }

    /// Ray `i`, rounded to `f32`.
    #[inline(always)]
    pub fn get_f32(&self, i: usize) -> [f32; 3] {
        match self {
            Self::F32(a) => [a[3 * i], a[3 * i + 1], a[3 * i + 2]],
            Self::F64(a) => [a[3 * i] as f32, a[3 * i + 1] as f32, a[3 * i + 2] as f32],
        }
    }

    /// Rays `from` up to `to`.
    #[inline(always)]
    pub fn slice(&self, from: usize, to: usize) -> Self {
        match self {
            Self::F32(a) => Self::F32(&a[3 * from..3 * to]),
            Self::F64(a) => Self::F64(&a[3 * from..3 * to]),
        }
    }
}

/// Rays `at` and on, one component a vector; the last ray stands in for those behind the end.
#[inline(always)]
pub(crate) fn load<L: Lanes>(rays: RayArray<'_>, at: usize) -> [L::D; 3] {
    let last = rays.len() - 1;
    match rays {
        RayArray::F32(rays) if rays.len() >= 3 * (at + L::WIDTH) => split::<L>(&rays[3 * at..]),
        RayArray::F32(rays) => split::<L>(&collect(rays, L::WIDTH, |lane| (at + lane).min(last))),
        RayArray::F64(rays) => split_wide::<L>(&collect(rays, L::WIDTH, |lane| (at + lane).min(last))),
    }
}

/// The rays from the first of two places on, and from the other what [`RUN`] rays leave of the vector.
#[inline(always)]
pub(crate) fn load_runs<L: Lanes>(rays: RayArray<'_>, starts: [usize; 2]) -> [L::D; 3] {
    if L::WIDTH <= RUN {
        return load::<L>(rays, starts[0]);
    }
    let ray = |lane: usize| starts[lane / RUN] + lane % RUN;
    match rays {
        RayArray::F32(rays) => split::<L>(&collect(rays, L::WIDTH, ray)),
        RayArray::F64(rays) => split_wide::<L>(&collect(rays, L::WIDTH, ray)),
    }
}

/// As many rays as there are lanes after one another.
#[inline(always)]
fn collect<T: Copy + Default>(rays: &[T], lanes: usize, ray: impl Fn(usize) -> usize) -> [T; 48] {
    let mut out = [T::default(); 48];
    for (lane, out) in out.chunks_exact_mut(3).take(lanes).enumerate() {
        let from = 3 * ray(lane);
        out.copy_from_slice(&rays[from..from + 3]);
    }
    out
}

#[inline(always)]
fn split<L: Lanes>(rays: &[f32]) -> [L::D; 3] {
    let [u, v, z] = L::load_triples(rays);
    [L::widen(u), L::widen(v), L::widen(z)]
}

#[inline(always)]
fn split_wide<L: Lanes>(rays: &[f64; 48]) -> [L::D; 3] {
    let mut parts = [[0.0; 16]; 3];
    for (lane, ray) in rays.chunks_exact(3).enumerate() {
        for (part, &x) in parts.iter_mut().zip(ray) {
            part[lane] = x;
        }
    }
    let [u, v, z] = parts;
    [L::load_wide(&u), L::load_wide(&v), L::load_wide(&z)]
}

/// Checks that every ray is finite and has a direction.
///
/// # Errors
/// [`HeightFieldError::RayCount`]; [`HeightFieldError::RayNotFinite`] and
/// [`HeightFieldError::RayZeroDirection`] name the first offending ray.
pub fn validate(origins: RayArray<'_>, directions: RayArray<'_>) -> Result<(), HeightFieldError> {
    same_count(origins, directions)?;
    let n = origins.len();
    let fault = (0..n.div_ceil(CHUNK)).into_par_iter().find_map_first(|k| {
        let (from, to) = (k * CHUNK, ((k + 1) * CHUNK).min(n));
        first_unsound(origins.slice(from, to), directions.slice(from, to)).map(|at| from + at)
    });
    fault.map_or(Ok(()), |index| Err(fault_of(origins, directions, index)))
}

/// Checks that there are as many origins as directions.
pub(crate) fn same_count(origins: RayArray<'_>, directions: RayArray<'_>) -> Result<(), HeightFieldError> {
    if origins.len() == directions.len() {
        return Ok(());
    }
    Err(HeightFieldError::RayCount { origins: origins.len(), directions: directions.len() })
}

/// The first ray that is not finite or has no direction.
pub(crate) fn first_unsound(origins: RayArray<'_>, directions: RayArray<'_>) -> Option<usize> {
    let sound = dispatch(Sound { origins, directions });
    if sound {
        return None;
    }
    (0..origins.len()).find(|&i| {
        let direction = directions.get(i);
        !finite(origins.get(i)) || !finite(direction) || direction == [0.0; 3]
    })
}

/// What is wrong with a ray that [`first_unsound`] found.
pub(crate) fn fault_of(origins: RayArray<'_>, directions: RayArray<'_>, index: usize) -> HeightFieldError {
    if !finite(origins.get(index)) {
        HeightFieldError::RayNotFinite { index, what: "origin" }
    } else if !finite(directions.get(index)) {
        HeightFieldError::RayNotFinite { index, what: "direction" }
    } else {
        HeightFieldError::RayZeroDirection { index }
    }
}

fn finite(ray: [f64; 3]) -> bool {
    ray.iter().all(|x| x.is_finite())
}

/// Whether all rays are finite and have a direction.
struct Sound<'a> {
    origins: RayArray<'a>,
    directions: RayArray<'a>,
}

impl Kernel for Sound<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<L: Lanes>(self) -> bool {
        let finite = match self.origins {
            RayArray::F32(a) => all_finite(a),
            RayArray::F64(a) => all_finite(a),
        };
        let directed = match self.directions {
            RayArray::F32(a) => all_directed(a),
            RayArray::F64(a) => all_directed(a),
        };
        finite && directed
    }
}

/// Without an early way out, so that it compiles to vector instructions: rays are sound as a rule.
#[inline(always)]
fn all_finite<T: Float>(values: &[T]) -> bool {
    values.iter().fold(true, |sound, x| sound & x.is_finite())
}

#[inline(always)]
fn all_directed<T: Float>(directions: &[T]) -> bool {
    let zero = T::zero();
    directions.chunks_exact(3).fold(true, |sound, d| {
        let finite = d[0].is_finite() & d[1].is_finite() & d[2].is_finite();
        sound & finite & ((d[0] != zero) | (d[1] != zero) | (d[2] != zero))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_offending_ray_is_named() {
        let n = 3 * CHUNK;
        let good = vec![0.5_f32; 3 * n];
        let at = |ray: usize, values: [f32; 3]| {
            let mut array = good.clone();
            array[3 * ray..3 * ray + 3].copy_from_slice(&values);
            array
        };
        let judge = |o: &[f32], d: &[f32]| validate(RayArray::F32(o), RayArray::F32(d));
        assert_eq!(judge(&good, &good), Ok(()));
        for ray in [0, 1, CHUNK - 1, CHUNK, n - 1] {
            let (nan, zero) = (at(ray, [0.1, 0.2, f32::NAN]), at(ray, [0.0, -0.0, 0.0]));
            let infinite = at(ray, [0.1, f32::NEG_INFINITY, 1.0]);
            let fault = |what| Err(HeightFieldError::RayNotFinite { index: ray, what });
            assert_eq!(judge(&nan, &good), fault("origin"));
            assert_eq!(judge(&good, &nan), fault("direction"));
            assert_eq!(judge(&infinite, &zero), fault("origin"));
            assert_eq!(judge(&good, &zero), Err(HeightFieldError::RayZeroDirection { index: ray }));
            assert_eq!(judge(&zero, &good), Ok(()));
        }
        let (two, three) = (&good[..6], &good[..9]);
        assert_eq!(judge(two, three), Err(HeightFieldError::RayCount { origins: 2, directions: 3 }));
    }
}
