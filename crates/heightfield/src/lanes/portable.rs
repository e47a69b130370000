//! Lanes as plain arrays: for one ray, for processors without the wide instruction sets, and for NEON,
//! which the compiler makes of four lanes by itself.

use std::array::from_fn;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

use super::Lanes;

/// `N` lanes in an array.
#[derive(Debug, Clone, Copy)]
pub struct Portable<const N: usize>;

/// The numbers of [`Portable`].
#[derive(Debug, Clone, Copy)]
pub struct Array<T, const N: usize>([T; N]);

macro_rules! operator {
    ($trait:ident $function:ident $operation:expr, $($type:ty),*) => { $(
        impl<const N: usize> $trait for Array<$type, N> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(from_fn(|i| $operation(self.0[i], other.0[i])))
            }
        }
    )* };
}

operator!(Add add |a, b| a + b, f32, f64);
operator!(Sub sub |a, b| a - b, f32, f64);
operator!(Mul mul |a, b| a * b, f32, f64);
operator!(Div div |a, b| a / b, f32, f64);
operator!(Add add i32::wrapping_add, i32);
operator!(Sub sub i32::wrapping_sub, i32);
operator!(Mul mul i32::wrapping_mul, i32);
operator!(BitAnd bitand |a, b| a & b, i32, bool);
operator!(BitOr bitor |a, b| a | b, bool);

impl<const N: usize> Not for Array<bool, N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(self.0.map(|x| !x))
    }
}

#[inline(always)]
fn map<T: Copy, U, const N: usize>(a: Array<T, N>, f: impl Fn(T) -> U) -> Array<U, N> {
    Array(from_fn(|i| f(a.0[i])))
}

#[inline(always)]
fn zip<T: Copy, U, const N: usize>(a: Array<T, N>, b: Array<T, N>, f: impl Fn(T, T) -> U) -> Array<U, N> {
    Array(from_fn(|i| f(a.0[i], b.0[i])))
}

#[inline(always)]
fn choose<T: Copy, const N: usize>(m: Array<bool, N>, a: Array<T, N>, b: Array<T, N>) -> Array<T, N> {
    Array(from_fn(|i| if m.0[i] { a.0[i] } else { b.0[i] }))
}

#[inline(always)]
fn pack<T: Copy, const N: usize>(m: Array<bool, N>, x: Array<T, N>, to: &mut [T]) -> usize {
    let to = &mut to[..N];
    let mut count = 0;
    for i in 0..N {
        to[count] = x.0[i];
        count += usize::from(m.0[i]);
        if count == N {
            break;
        }
    }
    count
}

impl<const N: usize> Lanes for Portable<N> {
    const WIDTH: usize = N;
    type F = Array<f32, N>;
    type I = Array<i32, N>;
    type D = Array<f64, N>;
    type M = Array<bool, N>;

    #[inline(always)]
    fn splat(x: f32) -> Self::F {
        Array([x; N])
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self::F {
        let from = &from[..N];
        Array(from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn load_triples(from: &[f32]) -> [Self::F; 3] {
        let from = &from[..3 * N];
        from_fn(|k| Array(from_fn(|lane| from[3 * lane + k])))
    }
    #[inline(always)]
    fn store(x: Self::F, to: &mut [f32]) {
        to[..N].copy_from_slice(&x.0);
    }
    #[inline(always)]
    fn compress(chosen: Self::M, x: Self::F, to: &mut [f32]) -> usize {
        pack(chosen, x, to)
    }
    #[inline(always)]
    fn expand(chosen: Self::M, from: &[f32], others: Self::F) -> Self::F {
        let from = &from[..N];
        let mut next = 0;
        Array(from_fn(|i| {
            if chosen.0[i] {
                next += 1;
                from[next - 1]
            } else {
                others.0[i]
            }
        }))
    }
    #[inline(always)]
    fn largest(x: Self::F) -> f32 {
        x.0.into_iter().fold(f32::NEG_INFINITY, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn neighbours(x: Self::F) -> Self::F {
        Array(from_fn(|i| x.0[(i ^ 1).min(N - 1)]))
    }
    #[inline(always)]
    fn min(a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(a: Self::F, b: Self::F) -> Self::F {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(x: Self::F) -> Self::F {
        map(x, f32::abs)
    }
    #[inline(always)]
    fn floor(x: Self::F) -> Self::F {
        map(x, f32::floor)
    }
    #[inline(always)]
    fn sqrt(x: Self::F) -> Self::F {
        map(x, f32::sqrt)
    }
    #[inline(always)]
    fn mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F {
        a * b + c
    }
    #[inline(always)]
    fn lt(a: Self::F, b: Self::F) -> Self::M {
        zip(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn le(a: Self::F, b: Self::F) -> Self::M {
        zip(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn select(mask: Self::M, yes: Self::F, no: Self::F) -> Self::F {
        choose(mask, yes, no)
    }
    #[inline(always)]
    fn times_power(x: Self::F, power: Self::I) -> Self::F {
        let scale = |x: f32, power: i32| f32::from_bits(x.to_bits().wrapping_add_signed(power << 23));
        Array(from_fn(|i| scale(x.0[i], power.0[i])))
    }
    #[inline(always)]
    fn to_int(x: Self::F) -> Self::I {
        map(x, |x| x as i32)
    }
    #[inline(always)]
    fn to_float(x: Self::I) -> Self::F {
        map(x, |x| x as f32)
    }

    #[inline(always)]
    fn splat_int(x: i32) -> Self::I {
        Array([x; N])
    }
    #[inline(always)]
    fn load_int(from: &[i32]) -> Self::I {
        let from = &from[..N];
        Array(from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn store_int(x: Self::I, to: &mut [i32]) {
        to[..N].copy_from_slice(&x.0);
    }
    #[inline(always)]
    fn compress_int(chosen: Self::M, x: Self::I, to: &mut [i32]) -> usize {
        pack(chosen, x, to)
    }
    #[inline(always)]
    fn min_unsigned(a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, |a, b| (a as u32).min(b as u32) as i32)
    }
    #[inline(always)]
    fn min_int(a: Self::I, b: Self::I) -> Self::I {
        zip(a, b, i32::min)
    }
    #[inline(always)]
    fn lt_int(a: Self::I, b: Self::I) -> Self::M {
        zip(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn eq_int(a: Self::I, b: Self::I) -> Self::M {
        zip(a, b, |a, b| a == b)
    }
    #[inline(always)]
    fn odd(a: Self::I) -> Self::M {
        map(a, |a| a & 1 == 1)
    }
    #[inline(always)]
    fn select_int(mask: Self::M, yes: Self::I, no: Self::I) -> Self::I {
        choose(mask, yes, no)
    }
    #[inline(always)]
    fn lookup(table: &[i32; 16], at: Self::I) -> Self::I {
        map(at, |at| table[(at & 15) as usize])
    }

    #[inline(always)]
    unsafe fn gather(table: &[f32], at: Self::I, chosen: Self::M) -> Self::F {
        // SAFETY: the caller keeps chosen lanes inside the table.
        Array(from_fn(|i| if chosen.0[i] { unsafe { *table.get_unchecked(at.0[i] as usize) } } else { 0.0 }))
    }
    #[inline(always)]
    unsafe fn gather_all(table: &[f32], at: Self::I) -> Self::F {
        // SAFETY: the caller keeps all lanes inside the table.
        map(at, |k| unsafe { *table.get_unchecked(k as usize) })
    }
    #[inline(always)]
    unsafe fn gather_pairs(table: &[f32], at: Self::I) -> (Self::F, Self::F) {
        // SAFETY: the caller keeps all lanes and the numbers behind them inside the table.
        let read = |k: usize| Array(from_fn(|i| unsafe { *table.get_unchecked(at.0[i] as usize + k) }));
        (read(0), read(1))
    }
    #[inline(always)]
    unsafe fn gather_squares(table: &[f32], at: Self::I, below: usize) -> [Self::F; 4] {
        // SAFETY: the caller keeps all lanes and their squares inside the table.
        let (upper, lower) = unsafe {
            (Self::gather_pairs(table, at), Self::gather_pairs(table, map(at, |k| k + below as i32)))
        };
        [upper.0, upper.1, lower.0, lower.1]
    }

    #[inline(always)]
    fn first(n: usize) -> Self::M {
        Array(from_fn(|i| i < n))
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> Self::M {
        Array(from_fn(|i| bits >> i & 1 == 1))
    }
    #[inline(always)]
    fn bits(mask: Self::M) -> u32 {
        (0..N).fold(0, |bits, i| bits | u32::from(mask.0[i]) << i)
    }

    #[inline(always)]
    fn widen(x: Self::F) -> Self::D {
        map(x, f64::from)
    }
    #[inline(always)]
    fn narrow(x: Self::D) -> Self::F {
        map(x, |x| x as f32)
    }
    #[inline(always)]
    fn splat_wide(x: f64) -> Self::D {
        Array([x; N])
    }
    #[inline(always)]
    fn load_wide(from: &[f64]) -> Self::D {
        let from = &from[..N];
        Array(from_fn(|i| from[i]))
    }
    #[inline(always)]
    fn store_wide(x: Self::D, to: &mut [f64]) {
        to[..N].copy_from_slice(&x.0);
    }
    #[inline(always)]
    fn compress_wide(chosen: Self::M, x: Self::D, to: &mut [f64]) -> usize {
        pack(chosen, x, to)
    }
    #[inline(always)]
    fn min_wide(a: Self::D, b: Self::D) -> Self::D {
        zip(a, b, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max_wide(a: Self::D, b: Self::D) -> Self::D {
        zip(a, b, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn floor_wide(x: Self::D) -> Self::D {
        map(x, f64::floor)
    }
    #[inline(always)]
    fn sqrt_wide(x: Self::D) -> Self::D {
        map(x, f64::sqrt)
    }
    #[inline(always)]
    fn lt_wide(a: Self::D, b: Self::D) -> Self::M {
        zip(a, b, |a, b| a < b)
    }
    #[inline(always)]
    fn le_wide(a: Self::D, b: Self::D) -> Self::M {
        zip(a, b, |a, b| a <= b)
    }
    #[inline(always)]
    fn select_wide(mask: Self::M, yes: Self::D, no: Self::D) -> Self::D {
        choose(mask, yes, no)
    }
    #[inline(always)]
    fn select_signed_wide(sign: Self::D, yes: Self::D, no: Self::D) -> Self::D {
        choose(map(sign, |x| x < 0.0), yes, no)
    }
}
