//! Images of another size: area averages going down, bilinear interpolation going up.
//!
//! Both keep the tile in place: texel `i` of `n` covers `i / n` to `(i + 1) / n`. An area average is
//! therefore exact for any pair of sizes - a texel that lies across a border counts in both averages,
//! by its share - and needs no wrap rule, because no target texel reaches beyond the tile.

use rayon::prelude::*;

/// What one target texel takes: `weights` of the source texels from `first` on; they add up to 1.
struct Span {
    first: usize,
    weights: Vec<f64>,
}

/// The shares of `from` texels under each of `to` texels.
fn spans(from: usize, to: usize) -> Vec<Span> {
    (0..to)
        .map(|target| {
            // In units of 1 / to of a source texel all borders are whole numbers.
            let (begin, end) = (target * from, (target + 1) * from);
            let (first, last) = (begin / to, (end - 1) / to);
            let share = |texel: usize| end.min((texel + 1) * to) - begin.max(texel * to);
            Span { first, weights: (first..=last).map(|texel| share(texel) as f64 / from as f64).collect() }
        })
        .collect()
}

/// The image averaged over the area of each texel of a `size[0] x size[1]` image.
///
/// `texels` are `from[0] * from[1] * channels` interleaved floats. Sums run in `f64`, so the mean of
/// the result is the mean of the source whatever the sizes.
pub(crate) fn area_average(texels: &[f32], from: [usize; 2], channels: usize, size: [usize; 2]) -> Vec<f32> {
    let (columns, rows) = (spans(from[0], size[0]), spans(from[1], size[1]));
    let stride = from[0] * channels;
    let mut target = vec![0.0_f32; size[0] * size[1] * channels];
    target.par_chunks_mut(size[0] * channels).zip(&rows).for_each_init(
        || vec![0.0_f64; stride],
        |sums, (out, row)| {
            sums.fill(0.0);
            for (at, &weight) in row.weights.iter().enumerate() {
                let source = &texels[(row.first + at) * stride..][..stride];
                for (sum, &texel) in sums.iter_mut().zip(source) {
                    *sum += weight * f64::from(texel);
                }
            }
            for (texel, column) in out.chunks_exact_mut(channels).zip(&columns) {
                for (channel, value) in texel.iter_mut().enumerate() {
                    let source = sums[column.first * channels + channel..].iter().step_by(channels);
                    *value = column.weights.iter().zip(source).map(|(w, s)| w * s).sum::<f64>() as f32;
                }
            }
        },
    );
    target
}

/// Where a target texel's centre lies between two source texels: indices and the second's weight.
fn taps(from: usize, to: usize, periodic: bool) -> Vec<(usize, usize, f32)> {
    (0..to)
        .map(|target| {
            let x = (target as f64 + 0.5) * from as f64 / to as f64 - 0.5;
            let left = x.floor();
            let index = |i: i64| {
                let n = from as i64;
                (if periodic { i.rem_euclid(n) } else { i.clamp(0, n - 1) }) as usize
            };
            (index(left as i64), index(left as i64 + 1), (x - left) as f32)
        })
        .collect()
}

/// The one-channel image interpolated at the texel centres of a `size[0] x size[1]` image; beyond
/// the edge it repeats, or its edge texels go on.
pub(crate) fn interpolate(texels: &[f32], from: [usize; 2], size: [usize; 2], periodic: bool) -> Vec<f32> {
    let (columns, rows) = (taps(from[0], size[0], periodic), taps(from[1], size[1], periodic));
    let mut target = vec![0.0_f32; size[0] * size[1]];
    target.par_chunks_mut(size[0]).zip(&rows).for_each_init(
        || vec![0.0_f32; from[0]],
        |blend, (out, &(upper, lower, weight))| {
            let upper = &texels[upper * from[0]..][..from[0]];
            let lower = &texels[lower * from[0]..][..from[0]];
            for ((blend, &a), &b) in blend.iter_mut().zip(upper).zip(lower) {
                *blend = a + (b - a) * weight;
            }
            for (value, &(left, right, weight)) in out.iter_mut().zip(&columns) {
                *value = blend[left] + (blend[right] - blend[left]) * weight;
            }
        },
    );
    target
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_average_weighs_by_area() {
        // 5 -> 2: each covers two and a half.
        let found = area_average(&[1.0, 2.0, 4.0, 8.0, 16.0], [5, 1], 1, [2, 1]);
        assert_eq!(found, [(1.0 + 2.0 + 2.0) / 2.5, (2.0 + 8.0 + 16.0) / 2.5]);
        // Channels stay apart, columns as rows.
        let two = [1.0, 10.0, 2.0, 20.0, 6.0, 60.0];
        assert_eq!(area_average(&two, [1, 3], 2, [1, 1]), [3.0, 30.0]);
        assert_eq!(area_average(&two, [3, 1], 2, [1, 1]), [3.0, 30.0]);
    }

    #[test]
    fn every_pair_of_sizes_keeps_the_mean_and_matches_sampling() {
        for from in 1..12 {
            for to in 1..=from {
                let source: Vec<f32> = (0..from).map(|i| ((i * 7919) % 101) as f32).collect();
                let found = area_average(&source, [from, 1], 1, [to, 1]);
                // 27720 is a multiple of every size here, so no sample lies on a border.
                let samples = 27720;
                let mut sums = vec![0.0_f64; to];
                for s in 0..samples {
                    sums[s * to / samples] += f64::from(source[s * from / samples]);
                }
                for (found, sum) in found.iter().zip(&sums) {
                    let expected = sum * to as f64 / samples as f64;
                    assert!((f64::from(*found) - expected).abs() < 1e-5, "{from} -> {to}");
                }
            }
        }
    }

    #[test]
    fn interpolation_meets_the_texels_and_wraps() {
        let source = [0.0, 1.0, 5.0];
        assert_eq!(interpolate(&source, [3, 1], [3, 1], true), source);
        let twice = interpolate(&source, [3, 1], [6, 1], true);
        assert_eq!(twice, [1.25, 0.25, 0.75, 2.0, 4.0, 3.75]);
        let clamped = interpolate(&source, [1, 3], [1, 6], false);
        assert_eq!(clamped, [0.0, 0.25, 0.75, 2.0, 4.0, 5.0]);
    }
}
