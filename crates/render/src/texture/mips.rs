//! Mipmaps by exact box filtering, odd sizes included.

use rayon::prelude::*;

/// The texels that target texel `at` of `half` covers on a side of `full` texels, with their shares.
///
/// A texel of the next level covers `full / half` texels: two, or between two and three when the side
/// is odd. Dropping the last texel instead, as is often done, shifts the picture.
fn footprint(at: usize, half: usize, full: usize) -> ([usize; 3], [f32; 3]) {
    let ratio = full as f64 / half as f64;
    let (from, to) = (at as f64 * ratio, (at + 1) as f64 * ratio);
    let mut texels = [0; 3];
    let mut shares = [0.0; 3];
    for (k, (texel, share)) in texels.iter_mut().zip(&mut shares).enumerate() {
        let i = from.floor() as usize + k;
        *texel = i.min(full - 1);
        let overlap = to.min((i + 1) as f64) - from.max(i as f64);
        *share = (overlap.max(0.0) / ratio) as f32;
    }
    (texels, shares)
}

/// The next smaller level of a map of `C` numbers a texel: half the size, rounded down, at least 1.
///
/// `read` gives the texel at `(x, y)`. Returns width, height and texels.
pub fn halve<const C: usize>(
    size: [usize; 2],
    read: impl Fn(usize, usize) -> [f32; C] + Sync,
) -> ([usize; 2], Vec<[f32; C]>) {
    let half = size.map(|side| (side / 2).max(1));
    let columns: Vec<_> = (0..half[0]).map(|x| footprint(x, half[0], size[0])).collect();
    let mut texels = vec![[0.0; C]; half[0] * half[1]];
    texels.par_chunks_mut(half[0]).enumerate().for_each(|(y, row)| {
        let (rows, row_shares) = footprint(y, half[1], size[1]);
        for (texel, (xs, column_shares)) in row.iter_mut().zip(&columns) {
            for (&j, &share_y) in rows.iter().zip(&row_shares) {
                for (&i, &share_x) in xs.iter().zip(column_shares) {
                    let share = share_x * share_y;
                    if share > 0.0 {
                        let value = read(i, j);
                        for (sum, component) in texel.iter_mut().zip(value) {
                            *sum += component * share;
                        }
                    }
                }
            }
        }
    });
    (half, texels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_keeps_the_mean() {
        for size in [[1, 1], [7, 5], [8, 8], [33, 1], [1, 6], [3, 3]] {
            let level: Vec<[f32; 1]> = (0..size[0] * size[1]).map(|i| [((i * 37) % 11) as f32]).collect();
            let mean = |texels: &[[f32; 1]]| texels.iter().map(|t| t[0]).sum::<f32>() / texels.len() as f32;
            let (half, next) = halve(size, |x, y| level[y * size[0] + x]);
            assert_eq!(next.len(), half[0] * half[1]);
            assert!((mean(&next) - mean(&level)).abs() < 1e-4, "{size:?}: {} {}", mean(&next), mean(&level));
        }
    }

    #[test]
    fn an_odd_ramp_stays_centred() {
        let (half, next) = halve([5, 1], |x, _| [x as f32]);
        assert_eq!(half, [2, 1]);
        assert!((next[0][0] + next[1][0] - 4.0).abs() < 1e-5, "{next:?}");
    }
}
