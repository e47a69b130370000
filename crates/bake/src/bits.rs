//! How many bits a height map really holds.
//!
//! A 16-bit file is no promise: many hold 8-bit data blown up, which shows as terraces once the map
//! is lit. [`effective_bits`] is the width of the narrowest integer (or float) that holds all
//! samples without loss:
//!
//! * Integers of `w` bits: the least `b` such that every sample is a `b`-bit integer widened to `w`
//!   bits in one of the usual ways: scaled by `(2^w - 1) / (2^b - 1)` with rounding or cutting,
//!   bits repeated (x257 for 8 to 16), or shifted left (x256). The same way must explain all
//!   samples. Data in the low bits, such as a 10-bit sensor's 0..1023 in 16 bits, is not among
//!   them: there the steps are full 16-bit steps and the range is narrow.
//! * Floats: the least `b` up to 16 such that every sample is `k / (2^b - 1)` or `k / 2^b`, up to one
//!   rounding; for whole numbers beyond 1, such as metres, the bits that count from the lowest to
//!   the highest; else 16 when every sample is a half-precision float; else 32.
//!
//! Few samples may fit a narrow lattice by chance; a constant map of 0 or 1 has one bit.

use half::f16;

use crate::Samples;

/// The number of bits really present in the samples, 1 to 8, 16 or 32; see the module.
pub fn effective_bits(samples: &Samples) -> u32 {
    match samples {
        Samples::U8(samples) => {
            let mut seen = vec![false; 1 << 8];
            samples.iter().for_each(|&v| seen[usize::from(v)] = true);
            integer_bits(&seen, 8)
        }
        Samples::U16(samples) => {
            let mut seen = vec![false; 1 << 16];
            samples.iter().for_each(|&v| seen[usize::from(v)] = true);
            integer_bits(&seen, 16)
        }
        Samples::F32(samples) => float_bits(samples),
    }
}

/// `seen[v]` tells whether value `v` of `width` bits occurs.
fn integer_bits(seen: &[bool], width: u32) -> u32 {
    let values: Vec<u32> = seen.iter().zip(0..).filter(|(seen, _)| **seen).map(|(_, value)| value).collect();
    let fits = |widen: &dyn Fn(u32, u32) -> u32, bits: u32| {
        let (top, full) = ((1_u64 << bits) - 1, (1_u64 << width) - 1);
        values.iter().all(|&value| {
            // The narrow integer next to the value; cutting may put it one higher.
            let narrow = ((u64::from(value) * top) / full) as u32;
            [narrow, narrow + 1].iter().any(|&k| u64::from(k) <= top && widen(k, bits) == value)
        })
    };
    let scale = |k: u32, bits: u32, round: u64| {
        let (top, full) = ((1_u64 << bits) - 1, (1_u64 << width) - 1);
        ((u64::from(k) * full + round * (top / 2)) / top) as u32
    };
    let rounded = |k, bits| scale(k, bits, 1);
    let cut = |k, bits| scale(k, bits, 0);
    let repeated = |k: u32, bits: u32| {
        let (mut value, mut left) = (0_u32, i64::from(width));
        while left > 0 {
            left -= i64::from(bits);
            value |= if left >= 0 { k << left } else { k >> -left };
        }
        value
    };
    let shifted = |bits: u32| values.iter().all(|value| value & ((1 << (width - bits)) - 1) == 0);
    (1..width)
        .find(|&bits| shifted(bits) || fits(&rounded, bits) || fits(&cut, bits) || fits(&repeated, bits))
        .unwrap_or(width)
}

fn float_bits(samples: &[f32]) -> u32 {
    if !samples.iter().all(|v| v.is_finite()) {
        return 32;
    }
    let (low, high) =
        samples.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
    let halves = samples.iter().all(|&v| f16::from_f32(v).to_f32() == v);
    if low >= 0.0 && high <= 1.0 {
        let lattice = (1..=16).find(|&bits| {
            let steps = f64::from(1_u32 << bits);
            on_lattice(samples, steps - 1.0, halves && bits <= 8) || on_lattice(samples, steps, false)
        });
        if let Some(bits) = lattice {
            return bits;
        }
    } else if high - low < 65536.0 && samples.iter().all(|&v| v.fract() == 0.0) {
        return (u32::BITS - ((high - low) as u32).leading_zeros()).max(1);
    }
    if halves { 16 } else { 32 }
}

/// Whether every sample is `k / steps` but for one rounding, to half precision if `half`.
fn on_lattice(samples: &[f32], steps: f64, half: bool) -> bool {
    let slack = f64::from(f32::EPSILON);
    samples.iter().all(|&v| {
        let value = f64::from(v);
        let exact = (value * steps).round() / steps;
        (exact - value).abs() <= slack * value || (half && f16::from_f64(exact).to_f32() == v)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn u16s(values: impl Iterator<Item = u32>) -> u32 {
        effective_bits(&Samples::U16(values.map(|v| v as u16).collect()))
    }

    fn f32s(values: impl Iterator<Item = f32>) -> u32 {
        effective_bits(&Samples::F32(values.collect()))
    }

    #[test]
    fn narrow_integers_in_sixteen_bits() {
        assert_eq!(u16s((0..256).map(|k| k * 257)), 8);
        assert_eq!(u16s((0..256).map(|k| k * 256)), 8);
        assert_eq!(u16s((3..200).map(|k| k * 257)), 8);
        for bits in [9_u32, 10, 12, 14] {
            let top = (1_u32 << bits) - 1;
            let narrow = || 0..=top;
            assert_eq!(u16s(narrow().map(|k| k << (16 - bits))), bits, "shift {bits}");
            assert_eq!(
                u16s(narrow().map(|k| (k << (16 - bits)) | (k >> (2 * bits - 16)))),
                bits,
                "repeat {bits}"
            );
            assert_eq!(u16s(narrow().map(|k| (k * 65535 + top / 2) / top)), bits, "round {bits}");
            assert_eq!(u16s(narrow().map(|k| k * 65535 / top)), bits, "cut {bits}");
        }
    }

    #[test]
    fn full_integers_keep_their_width() {
        assert_eq!(u16s(0..65536), 16);
        // One odd sample among 8-bit data is enough.
        assert_eq!(u16s((0..256).map(|k| k * 257).chain([12345])), 16);
        // Two ways of widening in one map are not one way.
        assert_eq!(u16s((0..256).map(|k| if k % 2 == 1 { k * 257 } else { k * 256 })), 16);
        // Data in the low bits has 16-bit steps.
        assert_eq!(u16s(0..1024), 16);
        assert_eq!(effective_bits(&Samples::U8((0..=255).collect())), 8);
        assert_eq!(effective_bits(&Samples::U8((0..16).map(|k| k * 17).collect())), 4);
        assert_eq!(effective_bits(&Samples::U8(vec![0, 255])), 1);
        assert_eq!(effective_bits(&Samples::U8(vec![0; 9])), 1);
    }

    #[test]
    fn floats_remember_where_they_came_from() {
        assert_eq!(f32s((0..256).map(|k| k as f32 / 255.0)), 8);
        assert_eq!(f32s((0..256).map(|k| k as f32 * (1.0 / 255.0))), 8);
        assert_eq!(f32s((0..256).map(|k| k as f32 / 256.0)), 8);
        assert_eq!(f32s((0..256).map(|k| f16::from_f32(k as f32 / 255.0).to_f32())), 8);
        assert_eq!(f32s((0..1024).map(|k| k as f32 / 1023.0)), 10);
        assert_eq!(f32s((0..65536).map(|k| k as f32 / 65535.0)), 16);
        assert_eq!(f32s((1..5000).map(|k| f16::from_bits(k * 3).to_f32())), 16);
        assert_eq!(f32s((0..5000).map(|k| (k as f32).sqrt() / 71.0)), 32);
        assert_eq!(f32s((0..841).map(|k| (k + 236) as f32)), 10, "metres");
        assert_eq!(f32s([0.5, f32::NAN].into_iter()), 32);
        assert_eq!(f32s((0..100).map(|k| k as f32 * 0.37 - 9.0)), 32);
    }
}
