//! 8 lanes with AVX2.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

use super::Lanes;

/// 8 lanes with AVX2.
#[derive(Debug, Clone, Copy)]
pub struct Avx2;

/// 8 `f32`.
#[derive(Debug, Clone, Copy)]
pub struct F(__m256);
/// 8 `i32`.
#[derive(Debug, Clone, Copy)]
pub struct I(__m256i);
/// 8 `f64`.
#[derive(Debug, Clone, Copy)]
pub struct D(__m256d, __m256d);
/// 8 truth values, all bits of a lane set or clear.
#[derive(Debug, Clone, Copy)]
pub struct M(__m256i);

// SAFETY of every `unsafe` block in this file: code with these types is only reachable through
// `run_avx2`, which the processor was asked for, and slices are measured before they are read or
// written as a whole vector.
operators! {
    Add add F(_mm256_add_ps);
    Sub sub F(_mm256_sub_ps);
    Mul mul F(_mm256_mul_ps);
    Div div F(_mm256_div_ps);
    Add add I(_mm256_add_epi32);
    Sub sub I(_mm256_sub_epi32);
    Mul mul I(_mm256_mullo_epi32);
    BitAnd bitand I(_mm256_and_si256);
    BitAnd bitand M(_mm256_and_si256);
    BitOr bitor M(_mm256_or_si256);
}

wide_operators! {
    Add add (_mm256_add_pd);
    Sub sub (_mm256_sub_pd);
    Mul mul (_mm256_mul_pd);
    Div div (_mm256_div_pd);
}

impl Not for M {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        M(unsafe { _mm256_xor_si256(self.0, _mm256_set1_epi32(-1)) })
    }
}

impl M {
    /// The mask for `f64` lanes: the lower and the upper four.
    #[inline(always)]
    fn widen(self) -> (__m256d, __m256d) {
        unsafe {
            let low = _mm256_cvtepi32_epi64(_mm256_castsi256_si128(self.0));
            let high = _mm256_cvtepi32_epi64(_mm256_extracti128_si256::<1>(self.0));
            (_mm256_castsi256_pd(low), _mm256_castsi256_pd(high))
        }
    }

    /// The mask from two of `f64` lanes.
    #[inline(always)]
    fn narrow(low: __m256d, high: __m256d) -> Self {
        unsafe {
            let packed = _mm256_shuffle_ps::<0b10_00_10_00>(_mm256_castpd_ps(low), _mm256_castpd_ps(high));
            M(_mm256_permute4x64_epi64::<0b11_01_10_00>(_mm256_castps_si256(packed)))
        }
    }
}

/// Places in a table; single loads take less than the instructions that gather.
#[inline(always)]
fn places(at: I) -> [usize; 8] {
    let mut places = [0; 8];
    Avx2::store_int(at, &mut places);
    places.map(|place| place as u32 as usize)
}

/// From four vectors of two rows of four, lanes `k` and `k + 4` in vector `k`, to the columns.
#[inline(always)]
unsafe fn transpose(rows: [__m256; 4]) -> [F; 4] {
    unsafe {
        let [a, b, c, d] = rows;
        let (low, high) = (_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
        let (lower, higher) = (_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
        [
            F(_mm256_shuffle_ps::<0b01_00_01_00>(low, lower)),
            F(_mm256_shuffle_ps::<0b11_10_11_10>(low, lower)),
            F(_mm256_shuffle_ps::<0b01_00_01_00>(high, higher)),
            F(_mm256_shuffle_ps::<0b11_10_11_10>(high, higher)),
        ]
    }
}

/// For each mask of 8 bits, the chosen lanes in order.
static CHOSEN: [[i32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][count] = lane;
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// For each mask of 4 bits, the chosen pairs of lanes in order.
static CHOSEN_PAIRS: [[i32; 8]; 16] = {
    let mut table = [[0; 8]; 16];
    let mut mask = 0;
    while mask < 16 {
        let mut pair = 0;
        while pair < 4 {
            table[mask][2 * pair] = 2 * CHOSEN[mask][pair];
            table[mask][2 * pair + 1] = 2 * CHOSEN[mask][pair] + 1;
            pair += 1;
        }
        mask += 1;
    }
    table
};

/// For each mask of 8 bits, how many chosen lanes come before each lane.
static PLACES: [[i32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            table[mask][lane] = count;
            count += (mask >> lane & 1) as i32;
            lane += 1;
        }
        mask += 1;
    }
    table
};

impl Lanes for Avx2 {
    const WIDTH: usize = 8;
    type F = F;
    type I = I;
    type D = D;
    type M = M;

    #[inline(always)]
    fn splat(x: f32) -> F {
        F(unsafe { _mm256_set1_ps(x) })
    }
    #[inline(always)]
    fn load(from: &[f32]) -> F {
        F(unsafe { _mm256_loadu_ps(from[..8].as_ptr()) })
    }
    #[inline(always)]
    fn load_triples(from: &[f32]) -> [F; 3] {
        let from = from[..24].as_ptr();
        unsafe {
            // Three numbers of one ray and the first of the next are four steps of a shuffle apart.
            let halves = |k: usize| _mm256_loadu2_m128(from.add(12 + 4 * k), from.add(4 * k));
            let (a, b, c) = (halves(0), halves(1), halves(2));
            let late = _mm256_shuffle_ps::<0b10_01_11_10>(b, c);
            let early = _mm256_shuffle_ps::<0b01_00_10_01>(a, b);
            [
                F(_mm256_shuffle_ps::<0b10_00_11_00>(a, late)),
                F(_mm256_shuffle_ps::<0b11_01_10_00>(early, late)),
                F(_mm256_shuffle_ps::<0b11_00_11_01>(early, c)),
            ]
        }
    }
    #[inline(always)]
    fn store(x: F, to: &mut [f32]) {
        unsafe { _mm256_storeu_ps(to[..8].as_mut_ptr(), x.0) }
    }
    #[inline(always)]
    fn compress(chosen: M, x: F, to: &mut [f32]) -> usize {
        let bits = Self::bits(chosen);
        let order = Self::load_int(&CHOSEN[bits as usize]);
        Self::store(F(unsafe { _mm256_permutevar8x32_ps(x.0, order.0) }), to);
        bits.count_ones() as usize
    }
    #[inline(always)]
    fn expand(chosen: M, from: &[f32], others: F) -> F {
        let order = Self::load_int(&PLACES[Self::bits(chosen) as usize]);
        let spread = F(unsafe { _mm256_permutevar8x32_ps(Self::load(from).0, order.0) });
        Self::select(chosen, spread, others)
    }
    #[inline(always)]
    fn largest(x: F) -> f32 {
        unsafe {
            let four = _mm_max_ps(_mm256_castps256_ps128(x.0), _mm256_extractf128_ps::<1>(x.0));
            let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_max_ss(two, _mm_movehdup_ps(two)))
        }
    }
    #[inline(always)]
    fn neighbours(x: F) -> F {
        F(unsafe { _mm256_permute_ps::<0b10_11_00_01>(x.0) })
    }
    #[inline(always)]
    fn min(a: F, b: F) -> F {
        F(unsafe { _mm256_min_ps(a.0, b.0) })
    }
    #[inline(always)]
    fn max(a: F, b: F) -> F {
        F(unsafe { _mm256_max_ps(a.0, b.0) })
    }
    #[inline(always)]
    fn abs(x: F) -> F {
        F(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), x.0) })
    }
    #[inline(always)]
    fn floor(x: F) -> F {
        F(unsafe { _mm256_floor_ps(x.0) })
    }
    #[inline(always)]
    fn sqrt(x: F) -> F {
        F(unsafe { _mm256_sqrt_ps(x.0) })
    }
    #[inline(always)]
    fn mul_add(a: F, b: F, c: F) -> F {
        F(unsafe { _mm256_fmadd_ps(a.0, b.0, c.0) })
    }
    #[inline(always)]
    fn lt(a: F, b: F) -> M {
        M(unsafe { _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(a.0, b.0)) })
    }
    #[inline(always)]
    fn le(a: F, b: F) -> M {
        M(unsafe { _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LE_OQ>(a.0, b.0)) })
    }
    #[inline(always)]
    fn select(mask: M, yes: F, no: F) -> F {
        F(unsafe { _mm256_blendv_ps(no.0, yes.0, _mm256_castsi256_ps(mask.0)) })
    }
    #[inline(always)]
    fn times_power(x: F, power: I) -> F {
        unsafe {
            let exponent = _mm256_slli_epi32::<23>(power.0);
            F(_mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(x.0), exponent)))
        }
    }
    #[inline(always)]
    fn to_int(x: F) -> I {
        I(unsafe { _mm256_cvttps_epi32(x.0) })
    }
    #[inline(always)]
    fn to_float(x: I) -> F {
        F(unsafe { _mm256_cvtepi32_ps(x.0) })
    }

    #[inline(always)]
    fn splat_int(x: i32) -> I {
        I(unsafe { _mm256_set1_epi32(x) })
    }
    #[inline(always)]
    fn load_int(from: &[i32]) -> I {
        I(unsafe { _mm256_loadu_si256(from[..8].as_ptr().cast()) })
    }
    #[inline(always)]
    fn store_int(x: I, to: &mut [i32]) {
        unsafe { _mm256_storeu_si256(to[..8].as_mut_ptr().cast(), x.0) }
    }
    #[inline(always)]
    fn compress_int(chosen: M, x: I, to: &mut [i32]) -> usize {
        let bits = Self::bits(chosen);
        let order = Self::load_int(&CHOSEN[bits as usize]);
        Self::store_int(I(unsafe { _mm256_permutevar8x32_epi32(x.0, order.0) }), to);
        bits.count_ones() as usize
    }
    #[inline(always)]
    fn min_unsigned(a: I, b: I) -> I {
        I(unsafe { _mm256_min_epu32(a.0, b.0) })
    }
    #[inline(always)]
    fn min_int(a: I, b: I) -> I {
        I(unsafe { _mm256_min_epi32(a.0, b.0) })
    }
    #[inline(always)]
    fn lt_int(a: I, b: I) -> M {
        M(unsafe { _mm256_cmpgt_epi32(b.0, a.0) })
    }
    #[inline(always)]
    fn eq_int(a: I, b: I) -> M {
        M(unsafe { _mm256_cmpeq_epi32(a.0, b.0) })
    }
    #[inline(always)]
    fn odd(a: I) -> M {
        // The lowest bit in the place of the sign, and the sign everywhere.
        M(unsafe { _mm256_srai_epi32::<31>(_mm256_slli_epi32::<31>(a.0)) })
    }
    #[inline(always)]
    fn select_int(mask: M, yes: I, no: I) -> I {
        I(unsafe { _mm256_blendv_epi8(no.0, yes.0, mask.0) })
    }
    #[inline(always)]
    fn lookup(table: &[i32; 16], at: I) -> I {
        unsafe {
            let low = _mm256_permutevar8x32_epi32(Self::load_int(&table[..8]).0, at.0);
            let high = _mm256_permutevar8x32_epi32(Self::load_int(&table[8..]).0, at.0);
            // Bit 3 of the index becomes the sign, which chooses.
            let upper = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(at.0));
            let chosen = _mm256_blendv_ps(_mm256_castsi256_ps(low), _mm256_castsi256_ps(high), upper);
            I(_mm256_castps_si256(chosen))
        }
    }

    #[inline(always)]
    unsafe fn gather(table: &[f32], at: I, chosen: M) -> F {
        // SAFETY: the caller keeps chosen lanes inside the table.
        F(unsafe {
            let mask = _mm256_castsi256_ps(chosen.0);
            _mm256_mask_i32gather_ps::<4>(_mm256_setzero_ps(), table.as_ptr(), at.0, mask)
        })
    }
    #[inline(always)]
    unsafe fn gather_all(table: &[f32], at: I) -> F {
        let [a, b, c, d, e, f, g, h] = places(at);
        // SAFETY: the caller keeps all lanes inside the table.
        F(unsafe {
            let one = |place: usize| *table.get_unchecked(place);
            _mm256_setr_ps(one(a), one(b), one(c), one(d), one(e), one(f), one(g), one(h))
        })
    }
    #[inline(always)]
    unsafe fn gather_pairs(table: &[f32], at: I) -> (F, F) {
        // A pair is one 64-bit number, and single loads take less than the instruction that gathers.
        let places = places(at);
        // SAFETY: the caller keeps all lanes and the numbers behind them inside the table.
        unsafe {
            let pair = |lane: usize| table.as_ptr().add(places[lane]).cast::<f64>();
            let two = |a: usize, b: usize| _mm_castpd_ps(_mm_loadh_pd(_mm_load_sd(pair(a)), pair(b)));
            let (first, second) =
                (_mm256_set_m128(two(4, 5), two(0, 1)), _mm256_set_m128(two(6, 7), two(2, 3)));
            let even = _mm256_shuffle_ps::<0b10_00_10_00>(first, second);
            let odd = _mm256_shuffle_ps::<0b11_01_11_01>(first, second);
            (F(even), F(odd))
        }
    }
    #[inline(always)]
    unsafe fn gather_squares(table: &[f32], at: I, below: usize) -> [F; 4] {
        let places = places(at);
        // SAFETY: the caller keeps all lanes and their squares inside the table.
        unsafe {
            let pair = |lane: usize, from: usize| table.as_ptr().add(from).add(places[lane]).cast::<f64>();
            let square =
                |lane: usize| _mm_castpd_ps(_mm_loadh_pd(_mm_load_sd(pair(lane, 0)), pair(lane, below)));
            let squares = |lane: usize| _mm256_set_m128(square(lane + 4), square(lane));
            transpose([squares(0), squares(1), squares(2), squares(3)])
        }
    }

    #[inline(always)]
    fn first(n: usize) -> M {
        let lanes = Self::load_int(&[0, 1, 2, 3, 4, 5, 6, 7]);
        Self::lt_int(lanes, Self::splat_int(n as i32))
    }
    #[inline(always)]
    fn from_bits(bits: u32) -> M {
        let places = Self::load_int(&[1, 2, 4, 8, 16, 32, 64, 128]);
        Self::eq_int(Self::splat_int(bits as i32) & places, places)
    }
    #[inline(always)]
    fn bits(mask: M) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_castsi256_ps(mask.0)) as u32 }
    }

    #[inline(always)]
    fn widen(x: F) -> D {
        unsafe {
            let high = _mm256_extractf128_ps::<1>(x.0);
            D(_mm256_cvtps_pd(_mm256_castps256_ps128(x.0)), _mm256_cvtps_pd(high))
        }
    }
    #[inline(always)]
    fn narrow(x: D) -> F {
        unsafe { F(_mm256_set_m128(_mm256_cvtpd_ps(x.1), _mm256_cvtpd_ps(x.0))) }
    }
    #[inline(always)]
    fn splat_wide(x: f64) -> D {
        let x = unsafe { _mm256_set1_pd(x) };
        D(x, x)
    }
    #[inline(always)]
    fn load_wide(from: &[f64]) -> D {
        let from = from[..8].as_ptr();
        unsafe { D(_mm256_loadu_pd(from), _mm256_loadu_pd(from.add(4))) }
    }
    #[inline(always)]
    fn store_wide(x: D, to: &mut [f64]) {
        let to = to[..8].as_mut_ptr();
        unsafe {
            _mm256_storeu_pd(to, x.0);
            _mm256_storeu_pd(to.add(4), x.1);
        }
    }
    #[inline(always)]
    fn compress_wide(chosen: M, x: D, to: &mut [f64]) -> usize {
        let to = &mut to[..8];
        let bits = Self::bits(chosen) as usize;
        // Each half by itself, as pairs of 32 bits.
        let half = |x: __m256d, bits: usize| unsafe {
            let order = Self::load_int(&CHOSEN_PAIRS[bits & 15]);
            _mm256_castsi256_pd(_mm256_permutevar8x32_epi32(_mm256_castpd_si256(x), order.0))
        };
        let low = (bits & 15).count_ones() as usize;
        unsafe {
            _mm256_storeu_pd(to.as_mut_ptr(), half(x.0, bits));
            _mm256_storeu_pd(to[low..low + 4].as_mut_ptr(), half(x.1, bits >> 4));
        }
        bits.count_ones() as usize
    }
    #[inline(always)]
    fn min_wide(a: D, b: D) -> D {
        unsafe { D(_mm256_min_pd(a.0, b.0), _mm256_min_pd(a.1, b.1)) }
    }
    #[inline(always)]
    fn max_wide(a: D, b: D) -> D {
        unsafe { D(_mm256_max_pd(a.0, b.0), _mm256_max_pd(a.1, b.1)) }
    }
    #[inline(always)]
    fn floor_wide(x: D) -> D {
        unsafe { D(_mm256_floor_pd(x.0), _mm256_floor_pd(x.1)) }
    }
    #[inline(always)]
    fn sqrt_wide(x: D) -> D {
        unsafe { D(_mm256_sqrt_pd(x.0), _mm256_sqrt_pd(x.1)) }
    }
    #[inline(always)]
    fn lt_wide(a: D, b: D) -> M {
        unsafe { M::narrow(_mm256_cmp_pd::<_CMP_LT_OQ>(a.0, b.0), _mm256_cmp_pd::<_CMP_LT_OQ>(a.1, b.1)) }
    }
    #[inline(always)]
    fn le_wide(a: D, b: D) -> M {
        unsafe { M::narrow(_mm256_cmp_pd::<_CMP_LE_OQ>(a.0, b.0), _mm256_cmp_pd::<_CMP_LE_OQ>(a.1, b.1)) }
    }
    #[inline(always)]
    fn select_wide(mask: M, yes: D, no: D) -> D {
        unsafe {
            let (low, high) = mask.widen();
            D(_mm256_blendv_pd(no.0, yes.0, low), _mm256_blendv_pd(no.1, yes.1, high))
        }
    }
    #[inline(always)]
    fn select_signed_wide(sign: D, yes: D, no: D) -> D {
        unsafe { D(_mm256_blendv_pd(no.0, yes.0, sign.0), _mm256_blendv_pd(no.1, yes.1, sign.1)) }
    }
}
