//! 16 lanes with AVX-512.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

use super::Lanes;

/// 16 lanes with AVX-512.
#[derive(Debug, Clone, Copy)]
pub struct Avx512;

/// 16 `f32`.
#[derive(Debug, Clone, Copy)]
pub struct F(__m512);
/// 16 `i32`.
#[derive(Debug, Clone, Copy)]
pub struct I(__m512i);
/// 16 `f64`.
#[derive(Debug, Clone, Copy)]
pub struct D(__m512d, __m512d);
/// 16 truth values.
#[derive(Debug, Clone, Copy)]
pub struct M(__mmask16);

// SAFETY of every `unsafe` block in this file: code with these types is only reachable through
// `run_avx512`, which the processor was asked for, and slices are measured before they are read or
// written as a whole vector.
operators! {
    Add add F(_mm512_add_ps);
    Sub sub F(_mm512_sub_ps);
    Mul mul F(_mm512_mul_ps);
    Div div F(_mm512_div_ps);
    Add add I(_mm512_add_epi32);
    Sub sub I(_mm512_sub_epi32);
    Mul mul I(_mm512_mullo_epi32);
    BitAnd bitand I(_mm512_and_si512);
}

wide_operators! {
    Add add (_mm512_add_pd);
    Sub sub (_mm512_sub_pd);
    Mul mul (_mm512_mul_pd);
    Div div (_mm512_div_pd);
}

impl BitAnd for M {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        M(self.0 & other.0)
    }
}
impl BitOr for M {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        M(self.0 | other.0)
    }
}
impl Not for M {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        M(!self.0)
    }
}

/// Rounding towards minus infinity, without exceptions.
const DOWN: i32 = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;

/// How two permutations collect every third of 48 numbers: the first those of the first two vectors,
/// the second the rest.
static TRIPLES: [[[i32; 16]; 2]; 3] = [triples(0), triples(1), triples(2)];

const fn triples(first: usize) -> [[i32; 16]; 2] {
    let mut order = [[0; 16]; 2];
    let mut lane = 0;
    while lane < 16 {
        let at = 3 * lane + first;
        order[0][lane] = if at < 32 { at as i32 } else { 0 };
        order[1][lane] = if at < 32 { lane as i32 } else { at as i32 - 16 };
        lane += 1;
    }
    order
}

#[inline(always)]
fn third(a: __m512, b: __m512, c: __m512, order: &[[i32; 16]; 2]) -> F {
    unsafe {
        let low = _mm512_permutex2var_ps(a, _mm512_loadu_si512(order[0].as_ptr().cast()), b);
        F(_mm512_permutex2var_ps(low, _mm512_loadu_si512(order[1].as_ptr().cast()), c))
    }
}

impl Lanes for Avx512 {
    const WIDTH: usize = 16;
    type F = F;
    type I = I;
    type D = D;
    type M = M;

    #[inline(always)]
    fn splat(x: f32) -> F {
        F(unsafe { _mm512_set1_ps(x) })
    }
    #[inline(always)]
    fn load(from: &[f32]) -> F {
        F(unsafe { _mm512_loadu_ps(from[..16].as_ptr()) })
    }
    #[inline(always)]
    fn load_triples(from: &[f32]) -> [F; 3] {
        let from = from[..48].as_ptr();
        unsafe {
            let a = _mm512_loadu_ps(from);
            let b = _mm512_loadu_ps(from.add(16));
            let c = _mm512_loadu_ps(from.add(32));
            [third(a, b, c, &TRIPLES[0]), third(a, b, c, &TRIPLES[1]), third(a, b, c, &TRIPLES[2])]
        }
    }
    #[inline(always)]
    fn store(x: F, to: &mut [f32]) {
        unsafe { _mm512_storeu_ps(to[..16].as_mut_ptr(), x.0) }
    }
    #[inline(always)]
    fn compress(chosen: M, x: F, to: &mut [f32]) -> usize {
        // Compressing in a register and storing all of it is far faster than a compressing store.
        Self::store(F(unsafe { _mm512_maskz_compress_ps(chosen.0, x.0) }), to);
        chosen.0.count_ones() as usize
    }
    #[inline(always)]
    fn expand(chosen: M, from: &[f32], others: F) -> F {
        F(unsafe { _mm512_mask_expand_ps(others.0, chosen.0, Self::load(from).0) })
    }
    #[inline(always)]
    fn largest(x: F) -> f32 {
        unsafe { _mm512_reduce_max_ps(x.0) }
    }
    #[inline(always)]
    fn neighbours(x: F) -> F {
        F(unsafe { _mm512_permute_ps::<0b10_11_00_01>(x.0) })
    }
    #[inline(always)]
    fn min(a: F, b: F) -> F {
        F(unsafe { _mm512_min_ps(a.0, b.0) })
    }
    #[inline(always)]
    fn max(a: F, b: F) -> F {
        F(unsafe { _mm512_max_ps(a.0, b.0) })
    }
    #[inline(always)]
    fn abs(x: F) -> F {
        F(unsafe { _mm512_abs_ps(x.0) })
    }
    #[inline(always)]
    fn floor(x: F) -> F {
        F(unsafe { _mm512_roundscale_ps::<DOWN>(x.0) })
    }
    #[inline(always)]
    fn sqrt(x: F) -> F {
        F(unsafe { _mm512_sqrt_ps(x.0) })
    }
    #[inline(always)]
    fn mul_add(a: F, b: F, c: F) -> F {
        F(unsafe { _mm512_fmadd_ps(a.0, b.0, c.0) })
    }
    #[inline(always)]
    fn lt(a: F, b: F) -> M {
        M(unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a.0, b.0) })
    }
    #[inline(always)]
    fn le(a: F, b: F) -> M {
        M(unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a.0, b.0) })
    }
    #[inline(always)]
    fn select(mask: M, yes: F, no: F) -> F {
        F(unsafe { _mm512_mask_blend_ps(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn times_power(x: F, power: I) -> F {
        unsafe {
            let exponent = _mm512_slli_epi32::<23>(power.0);
            F(_mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(x.0), exponent)))
        }
    }
    #[inline(always)]
    fn to_int(x: F) -> I {
        I(unsafe { _mm512_cvttps_epi32(x.0) })
    }
    #[inline(always)]
    fn to_float(x: I) -> F {
        F(unsafe { _mm512_cvtepi32_ps(x.0) })
    }

    #[inline(always)]
    fn splat_int(x: i32) -> I {
        I(unsafe { _mm512_set1_epi32(x) })
    }
    #[inline(always)]
    fn load_int(from: &[i32]) -> I {
        I(unsafe { _mm512_loadu_si512(from[..16].as_ptr().cast()) })
    }
    #[inline(always)]
    fn store_int(x: I, to: &mut [i32]) {
        unsafe { _mm512_storeu_si512(to[..16].as_mut_ptr().cast(), x.0) }
    }
    #[inline(always)]
    fn compress_int(chosen: M, x: I, to: &mut [i32]) -> usize {
        Self::store_int(I(unsafe { _mm512_maskz_compress_epi32(chosen.0, x.0) }), to);
        chosen.0.count_ones() as usize
    }
    #[inline(always)]
    fn min_unsigned(a: I, b: I) -> I {
        I(unsafe { _mm512_min_epu32(a.0, b.0) })
    }
    #[inline(always)]
    fn min_int(a: I, b: I) -> I {
        I(unsafe { _mm512_min_epi32(a.0, b.0) })
    }
    #[inline(always)]
    fn lt_int(a: I, b: I) -> M {
        M(unsafe { _mm512_cmplt_epi32_mask(a.0, b.0) })
    }
    #[inline(always)]
    fn eq_int(a: I, b: I) -> M {
        M(unsafe { _mm512_cmpeq_epi32_mask(a.0, b.0) })
    }
    #[inline(always)]
    fn odd(a: I) -> M {
        M(unsafe { _mm512_test_epi32_mask(a.0, _mm512_set1_epi32(1)) })
    }
    #[inline(always)]
    fn select_int(mask: M, yes: I, no: I) -> I {
        I(unsafe { _mm512_mask_blend_epi32(mask.0, no.0, yes.0) })
    }
    #[inline(always)]
    fn lookup(table: &[i32; 16], at: I) -> I {
        I(unsafe { _mm512_permutexvar_epi32(at.0, _mm512_loadu_si512(table.as_ptr().cast())) })
    }

    #[inline(always)]
    unsafe fn gather(table: &[f32], at: I, chosen: M) -> F {
        // SAFETY: the caller keeps chosen lanes inside the table.
        F(unsafe {
            _mm512_mask_i32gather_ps::<4>(_mm512_setzero_ps(), chosen.0, at.0, table.as_ptr().cast())
        })
    }
    #[inline(always)]
    unsafe fn gather_all(table: &[f32], at: I) -> F {
        // SAFETY: the caller keeps all lanes inside the table.
        unsafe { Self::gather(table, at, Self::first(Self::WIDTH)) }
    }
    #[inline(always)]
    unsafe fn gather_pairs(table: &[f32], at: I) -> (F, F) {
        // A pair is one 64-bit number; half as many reads as two gathers.
        // SAFETY: the caller keeps all lanes and the numbers behind them inside the table.
        unsafe {
            let base = table.as_ptr().cast();
            let low = _mm512_i32gather_pd::<4>(_mm512_castsi512_si256(at.0), base);
            let high = _mm512_i32gather_pd::<4>(_mm512_extracti64x4_epi64::<1>(at.0), base);
            let (low, high) = (_mm512_castpd_ps(low), _mm512_castpd_ps(high));
            let even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
            let odd = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
            (F(_mm512_permutex2var_ps(low, even, high)), F(_mm512_permutex2var_ps(low, odd, high)))
        }
    }
    #[inline(always)]
    unsafe fn gather_squares(table: &[f32], at: I, below: usize) -> [F; 4] {
        // SAFETY: the caller keeps all lanes and their squares inside the table.
        unsafe {
            let upper = Self::gather_pairs(table, at);
            let lower = Self::gather_pairs(&table[below..], at);
            [upper.0, upper.1, lower.0, lower.1]
        }
    }

    #[inline(always)]
    fn first(n: usize) -> M {
        M(((1_u32 << n.min(16)) - 1) as u16)
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> M {
        M(bits as u16)
    }
    #[inline(always)]
    fn bits(mask: M) -> u32 {
        u32::from(mask.0)
    }

    #[inline(always)]
    fn widen(x: F) -> D {
        unsafe {
            let high = _mm512_extractf32x8_ps::<1>(x.0);
            D(_mm512_cvtps_pd(_mm512_castps512_ps256(x.0)), _mm512_cvtps_pd(high))
        }
    }
    #[inline(always)]
    fn narrow(x: D) -> F {
        unsafe {
            let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(x.0));
            F(_mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(x.1)))
        }
    }
    #[inline(always)]
    fn splat_wide(x: f64) -> D {
        let x = unsafe { _mm512_set1_pd(x) };
        D(x, x)
    }
    #[inline(always)]
    fn load_wide(from: &[f64]) -> D {
        let from = from[..16].as_ptr();
        unsafe { D(_mm512_loadu_pd(from), _mm512_loadu_pd(from.add(8))) }
    }
    #[inline(always)]
    fn store_wide(x: D, to: &mut [f64]) {
        let to = to[..16].as_mut_ptr();
        unsafe {
            _mm512_storeu_pd(to, x.0);
            _mm512_storeu_pd(to.add(8), x.1);
        }
    }
    #[inline(always)]
    fn compress_wide(chosen: M, x: D, to: &mut [f64]) -> usize {
        let (low, high) = (chosen.0 as u8, (chosen.0 >> 8) as u8);
        let (first, count) = (low.count_ones() as usize, chosen.0.count_ones() as usize);
        let to = &mut to[..16];
        unsafe {
            _mm512_storeu_pd(to.as_mut_ptr(), _mm512_maskz_compress_pd(low, x.0));
            // `first` is at most 8, so the second half ends inside.
            _mm512_storeu_pd(to[first..].as_mut_ptr(), _mm512_maskz_compress_pd(high, x.1));
        }
        count
    }
    #[inline(always)]
    fn min_wide(a: D, b: D) -> D {
        unsafe { D(_mm512_min_pd(a.0, b.0), _mm512_min_pd(a.1, b.1)) }
    }
    #[inline(always)]
    fn max_wide(a: D, b: D) -> D {
        unsafe { D(_mm512_max_pd(a.0, b.0), _mm512_max_pd(a.1, b.1)) }
    }
    #[inline(always)]
    fn floor_wide(x: D) -> D {
        unsafe { D(_mm512_roundscale_pd::<DOWN>(x.0), _mm512_roundscale_pd::<DOWN>(x.1)) }
    }
    #[inline(always)]
    fn sqrt_wide(x: D) -> D {
        unsafe { D(_mm512_sqrt_pd(x.0), _mm512_sqrt_pd(x.1)) }
    }
    #[inline(always)]
    fn lt_wide(a: D, b: D) -> M {
        unsafe {
            let low = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a.0, b.0);
            M(u16::from(low) | u16::from(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a.1, b.1)) << 8)
        }
    }
    #[inline(always)]
    fn le_wide(a: D, b: D) -> M {
        unsafe {
            let low = _mm512_cmp_pd_mask::<_CMP_LE_OQ>(a.0, b.0);
            M(u16::from(low) | u16::from(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(a.1, b.1)) << 8)
        }
    }
    #[inline(always)]
    fn select_wide(mask: M, yes: D, no: D) -> D {
        unsafe {
            D(
                _mm512_mask_blend_pd(mask.0 as u8, no.0, yes.0),
                _mm512_mask_blend_pd((mask.0 >> 8) as u8, no.1, yes.1),
            )
        }
    }
    #[inline(always)]
    fn select_signed_wide(sign: D, yes: D, no: D) -> D {
        unsafe {
            D(
                _mm512_mask_blend_pd(_mm512_movepi64_mask(_mm512_castpd_si512(sign.0)), no.0, yes.0),
                _mm512_mask_blend_pd(_mm512_movepi64_mask(_mm512_castpd_si512(sign.1)), no.1, yes.1),
            )
        }
    }
}
