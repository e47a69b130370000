//! Floats to the integers of image files and back.
//!
//! A channel holds numbers from `low` to `high`; with `x = (v - low) / (high - low)` and `M` = 255 or
//! 65535 the integer `k` is
//!
//! | rounding | to integer | back: `low + (high - low) * k / M` |
//! |---|---|---|
//! | [`Rounding::Nearest`] | `floor(x * M + 1/2)` | within half a step of `v` |
//! | [`Rounding::Down`] | `floor(x * M)` | never above `v` |
//! | [`Rounding::Up`] | `ceil(x * M)` | never below `v` |
//!
//! Halves round up. No integer stands for 0 in the signed range (`M` is odd); rounding up makes the
//! flat normal (128, 128, 255), or (32768, 32768, 65535), as every other tool writes it. The way
//! back is the one that glTF and graphics hardware use, so the flat normal comes back as
//! (0.0039, 0.0039, 1). Values outside the range are clamped and NaN becomes the lower end.
//!
//! 8-bit normals are rounded in single precision, so that a bake can do it as it goes: what lies
//! within 2^-15 of a step of halfway may go either way.

use rayon::prelude::*;

use crate::Samples;

/// Which way a number goes to the integer that stands for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Rounding {
    /// To the nearest one.
    Nearest,
    /// Down: a bound from below stays one.
    Down,
    /// Up: a bound from above stays one.
    Up,
}

impl Rounding {
    /// `"nearest"`, `"down"` or `"up"`.
    pub fn name(self) -> &'static str {
        match self {
            Rounding::Nearest => "nearest",
            Rounding::Down => "down",
            Rounding::Up => "up",
        }
    }
}

/// The numbers a channel holds, and how they are rounded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// What integer 0 stands for.
    pub low: f32,
    /// What the largest integer stands for.
    pub high: f32,
    /// Which way numbers between two integers go.
    pub rounding: Rounding,
}

/// Integer width of an encoded map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Depth {
    /// 0..255.
    U8,
    /// 0..65535.
    U16,
}

impl Depth {
    /// Bytes of an integer.
    pub fn bytes(self) -> usize {
        match self {
            Depth::U8 => 1,
            Depth::U16 => 2,
        }
    }
}

impl Range {
    /// -1..1, a normal's component.
    pub const SIGNED: Self = Self { low: -1.0, high: 1.0, rounding: Rounding::Nearest };
    /// 0..1, a height.
    pub const UNIT: Self = Self { low: 0.0, high: 1.0, rounding: Rounding::Nearest };
    /// 0..1, rounded down.
    pub const LOWER_BOUND: Self = Self { low: 0.0, high: 1.0, rounding: Rounding::Down };
    /// 0..1, rounded up.
    pub const UPPER_BOUND: Self = Self { low: 0.0, high: 1.0, rounding: Rounding::Up };

    /// The integer in `0..=max` that stands for `value`; see the module's table.
    #[inline]
    pub fn encode(self, value: f32, max: u16) -> u16 {
        if self.low >= self.high {
            return 0;
        }
        if self == Self::SIGNED && matches!(max, 255 | u16::MAX) {
            // NaN is not above -1 either.
            let value = if value > -1.0 { value.min(1.0) } else { -1.0 };
            return if max == 255 { u8::signed(value).into() } else { u16::signed(value) };
        }
        let wide = f64::from(max);
        let scaled = (f64::from(value) - f64::from(self.low)) * (wide / self.width());
        let scaled = if self.rounding == Rounding::Nearest { scaled + 0.5 } else { scaled };
        // The cast cuts the fraction off; it also sends NaN to 0.
        let code = scaled.clamp(0.0, wide) as u16;
        // Division and product round: bounds are held against what the integer stands for.
        let stands_for = |code| self.decode_f64(code, wide);
        match self.rounding {
            Rounding::Nearest => code,
            Rounding::Down if code > 0 && stands_for(code) > f64::from(value) => code - 1,
            Rounding::Down if code < max && stands_for(code + 1) <= f64::from(value) => code + 1,
            Rounding::Up if code < max && stands_for(code) < f64::from(value) => code + 1,
            _ => code,
        }
    }

    /// The value that integer `code` of `0..=max` stands for.
    #[inline]
    pub fn decode(self, code: u16, max: u16) -> f32 {
        self.decode_f64(code, f64::from(max)) as f32
    }

    #[inline]
    fn decode_f64(self, code: u16, max: f64) -> f64 {
        f64::from(self.low) + self.width() * (f64::from(code) / max)
    }

    #[inline]
    fn width(self) -> f64 {
        f64::from(self.high) - f64::from(self.low)
    }
}

/// A number type in which normals and heights can be baked: floats as they are, integers as
/// [`Range::encode`] gives them.
pub trait Sample: Copy + Default + Send + Sync + 'static {
    /// A number of -1..1 (rounding may exceed that by some 1e-7).
    fn signed(value: f32) -> Self;
    /// A number of 0..1.
    fn unit(value: f32) -> Self;
    /// The samples where they are bytes.
    #[inline(always)]
    fn as_bytes_mut(_samples: &mut [Self]) -> Option<&mut [u8]> {
        None
    }
}

impl Sample for f32 {
    #[inline(always)]
    fn signed(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn unit(value: f32) -> Self {
        value
    }
}

impl Sample for u8 {
    #[inline(always)]
    fn signed(value: f32) -> Self {
        // From 256 to 512 the eight bits below the exponent are the whole part: the code and 256.
        ((value * 127.5 + 384.0).to_bits() >> 15) as u8
    }

    #[inline(always)]
    fn unit(value: f32) -> Self {
        (f64::from(value) * 255.0 + 0.5) as u8
    }

    #[inline(always)]
    fn as_bytes_mut(samples: &mut [Self]) -> Option<&mut [u8]> {
        Some(samples)
    }
}

impl Sample for u16 {
    #[inline(always)]
    fn signed(value: f32) -> Self {
        // As for `u8`, with 36 bits left below the whole part.
        ((f64::from(value) * 32767.5 + 98304.0).to_bits() >> 36) as u16
    }

    #[inline(always)]
    fn unit(value: f32) -> Self {
        (f64::from(value) * 65535.0 + 0.5) as u16
    }
}

/// Encodes interleaved floats; `ranges` has one entry a channel.
pub fn encode(values: &[f32], ranges: &[Range], depth: Depth) -> Samples {
    match depth {
        Depth::U8 => Samples::U8(map_channels(values, ranges, |range, v| range.encode(v, 255) as u8)),
        Depth::U16 => Samples::U16(map_channels(values, ranges, |range, v| range.encode(v, u16::MAX))),
    }
}

/// Decodes integer samples; floats pass as they are. `ranges` has one entry a channel.
pub fn decode(samples: &Samples, ranges: &[Range]) -> Vec<f32> {
    match samples {
        Samples::U8(codes) => map_channels(codes, ranges, |range, code| range.decode(u16::from(code), 255)),
        Samples::U16(codes) => map_channels(codes, ranges, |range, code| range.decode(code, u16::MAX)),
        Samples::F32(values) => values.clone(),
    }
}

fn map_channels<A, B>(from: &[A], ranges: &[Range], convert: impl Fn(Range, A) -> B + Sync) -> Vec<B>
where
    A: Copy + Sync,
    B: Copy + Default + Send,
{
    let block = ranges.len().max(1) << 12;
    let mut to = vec![B::default(); from.len()];
    to.par_chunks_mut(block).zip(from.par_chunks(block)).for_each(|(to, from)| {
        // Channel by channel, so that the range is not looked up for each sample.
        for (channel, &range) in ranges.iter().enumerate() {
            let from = from.iter().skip(channel).step_by(ranges.len());
            for (to, &from) in to.iter_mut().skip(channel).step_by(ranges.len()).zip(from) {
                *to = convert(range, from);
            }
        }
    });
    to
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_flat_normal_is_128_128_255() {
        let flat = [0.0, 0.0, 1.0, -0.0, 0.0, 1.0];
        let ranges = [Range::SIGNED; 3];
        assert_eq!(encode(&flat, &ranges, Depth::U8), Samples::U8(vec![128, 128, 255, 128, 128, 255]));
        let wide = vec![32768, 32768, 65535, 32768, 32768, 65535];
        assert_eq!(encode(&flat, &ranges, Depth::U16), Samples::U16(wide));
    }

    #[test]
    fn ends_and_nonsense_are_clamped() {
        for max in [255, u16::MAX] {
            for range in [Range::SIGNED, Range::UNIT, Range::LOWER_BOUND, Range::UPPER_BOUND] {
                let low = if range == Range::SIGNED { -1.0 } else { 0.0 };
                assert_eq!(range.encode(low, max), 0, "{range:?}");
                assert_eq!(range.encode(1.0, max), max, "{range:?}");
                assert_eq!(range.encode(f32::INFINITY, max), max);
                assert_eq!(range.encode(f32::NEG_INFINITY, max), 0);
                assert_eq!(range.encode(f32::NAN, max), 0);
            }
        }
    }

    #[test]
    fn every_code_round_trips() {
        for range in [Range::SIGNED, Range::UNIT] {
            for code in 0..=u16::MAX {
                assert_eq!(range.encode(range.decode(code, u16::MAX), u16::MAX), code);
            }
            for code in 0..=255 {
                assert_eq!(range.encode(range.decode(code, 255), 255), code);
            }
        }
    }

    proptest! {
        #[test]
        fn bounds_stay_bounds_and_rounding_is_to_nearest(value in 0.0_f32..=1.0, wide: bool) {
            let max = if wide { u16::MAX } else { 255 };
            let step = 1.0 / f64::from(max);
            let exact = |code: u16| f64::from(code) / f64::from(max);
            let value64 = f64::from(value);
            let low = exact(Range::LOWER_BOUND.encode(value, max));
            let high = exact(Range::UPPER_BOUND.encode(value, max));
            prop_assert!(low <= value64 && value64 - low < step);
            prop_assert!(high >= value64 && high - value64 < step);
            let near = exact(Range::UNIT.encode(value, max));
            prop_assert!((near - value64).abs() <= 0.5 * step + 1e-12);
            let signed = 2.0 * value - 1.0;
            let back = f64::from(Range::SIGNED.decode(Range::SIGNED.encode(signed, max), max));
            prop_assert!((back - f64::from(signed)).abs() <= step + 1e-6);
        }

        #[test]
        fn bounds_hold_in_any_range(
            low in -1e3_f32..1e3,
            width in 1e-3_f32..1e3,
            at in 0.0_f32..=1.0,
            wide: bool,
        ) {
            let max = if wide { u16::MAX } else { 255 };
            let high = low + width;
            prop_assume!(high > low);
            let value = (low + at * width).clamp(low, high);
            let step = f64::from(high - low) / f64::from(max) * (1.0 + 1e-6) + 1e-4;
            let back = |rounding| {
                let range = Range { low, high, rounding };
                range.decode(range.encode(value, max), max)
            };
            let (down, up, near) = (back(Rounding::Down), back(Rounding::Up), back(Rounding::Nearest));
            prop_assert!(down <= value && f64::from(value - down) <= step);
            prop_assert!(up >= value && f64::from(up - value) <= step);
            prop_assert!(f64::from((near - value).abs()) <= 0.5 * step);
        }
    }

    #[test]
    fn samples_are_encoded_alike() {
        // All floats of 2^-24 to 1 with a few mantissas each, and their negatives.
        for bits in (0x3380_0000_u32..=0x3f80_0000).step_by(997).chain([0, 0x3f80_0000]) {
            let value = f32::from_bits(bits);
            for signed in [value, -value] {
                // The rule of the table in double precision.
                assert_eq!(u16::signed(signed), (f64::from(signed) * 32767.5 + 32768.0) as u16);
                let exact = f64::from(signed) * 127.5 + 128.0;
                let halfway = (exact - exact.round()).abs() < 1.0 / 32768.0;
                assert!(halfway || u8::signed(signed) == exact as u8, "{signed:e}");
            }
            assert_eq!(u16::from(u8::unit(value)), Range::UNIT.encode(value, 255), "{value:e}");
            assert_eq!(u16::unit(value), Range::UNIT.encode(value, u16::MAX), "{value:e}");
        }
    }

    #[test]
    fn an_empty_range_is_its_one_number() {
        for rounding in [Rounding::Nearest, Rounding::Down, Rounding::Up] {
            let range = Range { low: 3.5, high: 3.5, rounding };
            assert_eq!(range.encode(3.5, 255), 0, "{rounding:?}");
            assert_eq!(range.decode(0, 255), 3.5);
        }
    }
}
