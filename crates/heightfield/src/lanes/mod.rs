//! Numbers side by side: one source for every instruction set.
//!
//! A search is written once over [`Lanes`], a set of types that hold as many rays as the processor
//! works on at a time: 16 with AVX-512, 8 with AVX2, 4 elsewhere, and 1 for a single ray. [`dispatch`]
//! compiles it for each and chooses when the program runs, so one binary serves every processor.
//!
//! Plain operators round each operation by itself on every instruction set, so results do not depend
//! on the machine. Only [`Lanes::mul_add`] may or may not round in between: it serves bounds.

// Vector instructions and unchecked table reads. Types of an instruction set are private to this
// module, and the only way to them is `dispatch`, which asks the processor first.
#![allow(unsafe_code)]

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};
use std::sync::OnceLock;

// SAFETY of the operators: code with these types is only reachable through `run_avx2` and `run_avx512`,
// whose instructions the processor was asked for.

/// Operators of vector types that hold one register, by the instruction of each.
#[cfg(target_arch = "x86_64")]
macro_rules! operators {
    ($($trait:ident $function:ident $type:ident ($intrinsic:ident);)*) => { $(
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )* };
}

/// Operators of the type that holds two registers, `D`.
#[cfg(target_arch = "x86_64")]
macro_rules! wide_operators {
    ($($trait:ident $function:ident ($intrinsic:ident);)*) => { $(
        impl $trait for D {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                unsafe { D($intrinsic(self.0, other.0), $intrinsic(self.1, other.1)) }
            }
        }
    )* };
}

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod portable;

pub use portable::Portable;

/// Arithmetic that rounds as IEEE 754 says, lane by lane.
pub trait Arithmetic: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}
impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>> Arithmetic for T {}

/// Vector types of one instruction set. All functions work lane by lane.
///
/// Comparisons with NaN are false; `min` and `max` of a NaN may give either side.
pub trait Lanes: Copy + Send + Sync + 'static {
    /// Lanes side by side, at most 16.
    const WIDTH: usize;
    /// `f32` numbers.
    type F: Arithmetic + Div<Output = Self::F>;
    /// `i32` numbers; overflow wraps.
    type I: Arithmetic + BitAnd<Output = Self::I>;
    /// `f64` numbers.
    type D: Arithmetic + Div<Output = Self::D>;
    /// Truth values.
    type M: Copy + BitAnd<Output = Self::M> + BitOr<Output = Self::M> + Not<Output = Self::M>;

    /// The same number in every lane.
    fn splat(x: f32) -> Self::F;
    /// The first [`Self::WIDTH`] numbers of a slice. Panics when it is shorter.
    fn load(from: &[f32]) -> Self::F;
    /// Every third number from the first, second and third on. Panics when the slice is shorter than three
    /// times [`Self::WIDTH`].
    fn load_triples(from: &[f32]) -> [Self::F; 3];
    /// Writes the lanes to the start of a slice. Panics when it is shorter.
    fn store(x: Self::F, to: &mut [f32]);
    /// Writes the chosen lanes one after the other and counts them; behind them the slice is overwritten
    /// up to [`Self::WIDTH`]. Panics when it is shorter.
    fn compress(chosen: Self::M, x: Self::F, to: &mut [f32]) -> usize;
    /// The numbers from the start of a slice in the chosen lanes, one after the other; `others` elsewhere.
    /// Panics when the slice is shorter than [`Self::WIDTH`].
    fn expand(chosen: Self::M, from: &[f32], others: Self::F) -> Self::F;
    /// The largest lane.
    fn largest(x: Self::F) -> f32;
    /// Lanes 0 and 1 swapped, 2 and 3, and so on; a lane without a neighbour stays.
    fn neighbours(x: Self::F) -> Self::F;
    /// The smaller.
    fn min(a: Self::F, b: Self::F) -> Self::F;
    /// The larger.
    fn max(a: Self::F, b: Self::F) -> Self::F;
    /// Without its sign.
    fn abs(x: Self::F) -> Self::F;
    /// The next whole number below.
    fn floor(x: Self::F) -> Self::F;
    /// Square root.
    fn sqrt(x: Self::F) -> Self::F;
    /// `a * b + c`, rounded once or twice.
    fn mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a < b`.
    fn lt(a: Self::F, b: Self::F) -> Self::M;
    /// `a <= b`.
    fn le(a: Self::F, b: Self::F) -> Self::M;
    /// `yes` where the mask is set, `no` elsewhere.
    fn select(mask: Self::M, yes: Self::F, no: Self::F) -> Self::F;
    /// `x * 2^power` by adding to the exponent; `x` and the result are normal numbers.
    fn times_power(x: Self::F, power: Self::I) -> Self::F;
    /// Whole numbers as `i32`; anything else gives some `i32`.
    fn to_int(x: Self::F) -> Self::I;
    /// `i32` as `f32`.
    fn to_float(x: Self::I) -> Self::F;

    /// The same number in every lane.
    fn splat_int(x: i32) -> Self::I;
    /// The first [`Self::WIDTH`] numbers of a slice. Panics when it is shorter.
    fn load_int(from: &[i32]) -> Self::I;
    /// Writes the lanes to the start of a slice. Panics when it is shorter.
    fn store_int(x: Self::I, to: &mut [i32]);
    /// As [`Self::compress`].
    fn compress_int(chosen: Self::M, x: Self::I, to: &mut [i32]) -> usize;
    /// The smaller as unsigned numbers: negative ones count as large.
    fn min_unsigned(a: Self::I, b: Self::I) -> Self::I;
    /// The smaller.
    fn min_int(a: Self::I, b: Self::I) -> Self::I;
    /// `a < b`.
    fn lt_int(a: Self::I, b: Self::I) -> Self::M;
    /// `a == b`.
    fn eq_int(a: Self::I, b: Self::I) -> Self::M;
    /// Whether the number is odd.
    fn odd(a: Self::I) -> Self::M;
    /// `yes` where the mask is set, `no` elsewhere.
    fn select_int(mask: Self::M, yes: Self::I, no: Self::I) -> Self::I;
    /// `table[at]`; only the low four bits of `at` count.
    fn lookup(table: &[i32; 16], at: Self::I) -> Self::I;

    /// `table[at]` where the mask is set, 0 elsewhere.
    ///
    /// # Safety
    /// Chosen lanes of `at` are in `0..table.len()`.
    unsafe fn gather(table: &[f32], at: Self::I, chosen: Self::M) -> Self::F;
    /// `table[at]`.
    ///
    /// # Safety
    /// All lanes of `at` are in `0..table.len()`.
    unsafe fn gather_all(table: &[f32], at: Self::I) -> Self::F;
    /// `(table[at], table[at + 1])`.
    ///
    /// # Safety
    /// All lanes of `at` are in `0..table.len() - 1`.
    unsafe fn gather_pairs(table: &[f32], at: Self::I) -> (Self::F, Self::F);
    /// `table[at]`, `table[at + 1]`, and the two numbers `below` further on: a square of a table by rows.
    ///
    /// # Safety
    /// All lanes of `at` are in `0..table.len() - below - 1`.
    unsafe fn gather_squares(table: &[f32], at: Self::I, below: usize) -> [Self::F; 4];

    /// The mask of the first `n` lanes.
    fn first(n: usize) -> Self::M;
    /// The mask whose lane 0 is bit 0.
    fn from_bits(bits: u32) -> Self::M;
    /// Lane 0 is bit 0.
    fn bits(mask: Self::M) -> u32;
    /// Whether any lane is set.
    #[inline(always)]
    fn any(mask: Self::M) -> bool {
        Self::bits(mask) != 0
    }

    /// Exactly the same numbers in `f64`.
    fn widen(x: Self::F) -> Self::D;
    /// Rounded to `f32`.
    fn narrow(x: Self::D) -> Self::F;
    /// The same number in every lane.
    fn splat_wide(x: f64) -> Self::D;
    /// The first [`Self::WIDTH`] numbers of a slice. Panics when it is shorter.
    fn load_wide(from: &[f64]) -> Self::D;
    /// Writes the lanes to the start of a slice. Panics when it is shorter.
    fn store_wide(x: Self::D, to: &mut [f64]);
    /// As [`Self::compress`].
    fn compress_wide(chosen: Self::M, x: Self::D, to: &mut [f64]) -> usize;
    /// The smaller.
    fn min_wide(a: Self::D, b: Self::D) -> Self::D;
    /// The larger.
    fn max_wide(a: Self::D, b: Self::D) -> Self::D;
    /// The next whole number below.
    fn floor_wide(x: Self::D) -> Self::D;
    /// Square root.
    fn sqrt_wide(x: Self::D) -> Self::D;
    /// `a < b`.
    fn lt_wide(a: Self::D, b: Self::D) -> Self::M;
    /// `a <= b`.
    fn le_wide(a: Self::D, b: Self::D) -> Self::M;
    /// `yes` where the mask is set, `no` elsewhere.
    fn select_wide(mask: Self::M, yes: Self::D, no: Self::D) -> Self::D;
    /// `yes` where the sign bit of a number is set, `no` elsewhere.
    fn select_signed_wide(sign: Self::D, yes: Self::D, no: Self::D) -> Self::D;
}

/// Something to run with the lanes of the processor.
pub trait Kernel {
    /// What it gives.
    type Output;
    /// Runs it. Must be `#[inline(always)]`, as must everything below it that handles lanes: code only
    /// gets the instructions of the function it is inlined into.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// An instruction set that searches are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// What every processor of the target has; NEON on 64-bit ARM.
    Baseline,
    /// AVX2 with FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// AVX-512 F, BW, DQ and VL.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Level {
    /// All levels that this processor can run, the best last; none above the one that the environment variable
    /// `BUMPWGPU_SIMD` names, which stands in for a lesser processor.
    pub fn available() -> &'static [Self] {
        static AVAILABLE: OnceLock<Vec<Level>> = OnceLock::new();
        AVAILABLE.get_or_init(|| {
            let mut levels = vec![Self::Baseline];
            #[cfg(target_arch = "x86_64")]
            {
                if is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
                {
                    levels.push(Self::Avx2);
                    if is_x86_feature_detected!("avx512f")
                        && is_x86_feature_detected!("avx512bw")
                        && is_x86_feature_detected!("avx512dq")
                        && is_x86_feature_detected!("avx512vl")
                    {
                        levels.push(Self::Avx512);
                    }
                }
            }
            if let Ok(most) = std::env::var("BUMPWGPU_SIMD")
                && let Some(at) = levels.iter().position(|level| level.name() == most)
            {
                levels.truncate(at + 1);
            }
            levels
        })
    }

    /// The best of them.
    #[inline]
    pub fn best() -> Self {
        Self::available().last().copied().unwrap_or(Self::Baseline)
    }

    /// Its name: "baseline" ("neon" on 64-bit ARM), "avx2" or "avx512".
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline if cfg!(target_arch = "aarch64") => "neon",
            Self::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => "avx512",
        }
    }
}

/// Runs a kernel with the best lanes the processor has.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    dispatch_at(Level::best(), kernel)
}

/// Runs a kernel with the lanes of a level, or with the best there are when the processor lacks it.
#[inline]
pub fn dispatch_at<K: Kernel>(level: Level, kernel: K) -> K::Output {
    match if Level::available().contains(&level) { level } else { Level::best() } {
        Level::Baseline => kernel.run::<Portable<4>>(),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the level is among those the processor reported.
        Level::Avx2 => unsafe { run_avx2(kernel) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Level::Avx512 => unsafe { run_avx512(kernel) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<avx2::Avx2>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
fn run_avx512<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<avx512::Avx512>()
}

#[cfg(test)]
mod tests;
