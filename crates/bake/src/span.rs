//! The range of many numbers, as fast as they can be read.

use rayon::prelude::*;

/// Numbers one task looks at.
const TASK: usize = 1 << 16;
/// Numbers looked at side by side.
const LANES: usize = 32;

/// The smallest and the largest number; `None` when some are not finite, or there are none.
pub fn finite_span(values: &[f32]) -> Option<(f32, f32)> {
    let join = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
    values.par_chunks(TASK).map(span_of).try_reduce_with(|a, b| Some(join(a, b))).flatten()
}

fn span_of(values: &[f32]) -> Option<(f32, f32)> {
    let (mut low, mut high, mut nothing) = ([f32::MAX; LANES], [f32::MIN; LANES], [0.0_f32; LANES]);
    let (chunks, rest) = values.as_chunks::<LANES>();
    let mut look = |lane: usize, value: f32| {
        low[lane] = if value < low[lane] { value } else { low[lane] };
        high[lane] = if value > high[lane] { value } else { high[lane] };
        // NaN for what is not finite, and NaN it stays.
        nothing[lane] += value * 0.0;
    };
    for chunk in chunks {
        for (lane, &value) in chunk.iter().enumerate() {
            look(lane, value);
        }
    }
    for (lane, &value) in rest.iter().enumerate() {
        look(lane, value);
    }
    let finite = nothing.iter().all(|&nothing| nothing == 0.0);
    let least = low.into_iter().fold(f32::MAX, f32::min);
    finite.then(|| (least, high.into_iter().fold(f32::MIN, f32::max)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_is_found_wherever_it_lies() {
        assert_eq!(finite_span(&[]), None);
        for length in [1, 31, 32, 33, TASK + 5] {
            let mut values = vec![0.25_f32; length];
            assert_eq!(finite_span(&values), Some((0.25, 0.25)));
            for at in [0, length / 2, length - 1] {
                values[at] = -3.0;
                assert_eq!(finite_span(&values).map(|span| span.0), Some(-3.0), "{at} of {length}");
                values[at] = f32::MAX;
                assert_eq!(finite_span(&values).map(|span| span.1), Some(f32::MAX), "{at} of {length}");
                for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                    values[at] = bad;
                    assert_eq!(finite_span(&values), None, "{bad} at {at} of {length}");
                }
                values[at] = 0.25;
            }
        }
    }
}
