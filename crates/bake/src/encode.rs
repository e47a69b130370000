//! Floats to the integers of image files and back.
//!
//! | range | to integer, `M` = 255 or 65535 | back |
//! |---|---|---|
//! | [`Range::Signed`] -1..1 | `floor(v * M/2 + M/2 + 1/2)` | `k / (M/2) - 1` |
//! | [`Range::Unit`] 0..1 | `floor(v * M + 1/2)` | `k / M` |
//! | [`Range::LowerBound`] 0..1 | `floor(v * M)` | `k / M`, never above `v` |
//! | [`Range::UpperBound`] 0..1 | `ceil(v * M)` | `k / M`, never below `v` |
//!
//! Halves round up. No integer stands for 0 in the signed range (`M` is odd); rounding up makes the
//! flat normal (128, 128, 255), or (32768, 32768, 65535), as every other tool writes it. The way
//! back is the one that glTF and graphics hardware use, so the flat normal comes back as
//! (0.0039, 0.0039, 1). Values outside the range are clamped and NaN becomes the lower end.

use rayon::prelude::*;

use crate::Samples;

/// What a channel's numbers mean, and so how they are rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Range {
    /// -1..1, a normal's component.
    Signed,
    /// 0..1, a height.
    Unit,
    /// 0..1, rounded down: a bound from below stays one.
    LowerBound,
    /// 0..1, rounded up: a bound from above stays one.
    UpperBound,
}

/// Integer width of an encoded map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Depth {
    /// 0..255.
    U8,
    /// 0..65535.
    U16,
}

impl Range {
    /// The integer in `0..=max` that stands for `value`; see the module's table.
    #[inline]
    pub fn encode(self, value: f32, max: u16) -> u16 {
        // f64 holds the product of a float and a 16-bit integer exactly, so bounds stay bounds.
        let max = f64::from(max);
        let value = f64::from(value);
        let scaled = match self {
            Range::Signed => value * (0.5 * max) + (0.5 * max + 0.5),
            Range::Unit => value * max + 0.5,
            Range::LowerBound | Range::UpperBound => value * max,
        };
        // The cast cuts the fraction off; it also sends NaN to 0.
        let clamped = scaled.clamp(0.0, max);
        let floor = clamped as u16;
        if self == Range::UpperBound && f64::from(floor) < clamped { floor + 1 } else { floor }
    }

    /// The value that integer `code` of `0..=max` stands for.
    #[inline]
    pub fn decode(self, code: u16, max: u16) -> f32 {
        let unit = f64::from(code) / f64::from(max);
        if self == Range::Signed { (2.0 * unit - 1.0) as f32 } else { unit as f32 }
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
        let ranges = [Range::Signed; 3];
        assert_eq!(encode(&flat, &ranges, Depth::U8), Samples::U8(vec![128, 128, 255, 128, 128, 255]));
        let wide = vec![32768, 32768, 65535, 32768, 32768, 65535];
        assert_eq!(encode(&flat, &ranges, Depth::U16), Samples::U16(wide));
    }

    #[test]
    fn ends_and_nonsense_are_clamped() {
        for max in [255, u16::MAX] {
            for range in [Range::Signed, Range::Unit, Range::LowerBound, Range::UpperBound] {
                let low = if range == Range::Signed { -1.0 } else { 0.0 };
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
        for range in [Range::Signed, Range::Unit] {
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
            let low = exact(Range::LowerBound.encode(value, max));
            let high = exact(Range::UpperBound.encode(value, max));
            prop_assert!(low <= value64 && value64 - low < step);
            prop_assert!(high >= value64 && high - value64 < step);
            let near = exact(Range::Unit.encode(value, max));
            prop_assert!((near - value64).abs() <= 0.5 * step + 1e-12);
            let signed = 2.0 * value - 1.0;
            let back = f64::from(Range::Signed.decode(Range::Signed.encode(signed, max), max));
            prop_assert!((back - f64::from(signed)).abs() <= step + 1e-6);
        }
    }
}
