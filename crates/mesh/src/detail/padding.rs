//! Charts grown into the space between them, so that filtering and mipmaps find no gaps.
//!
//! Each texel takes the value of the nearest covered one: exact Euclidean distances, columns first,
//! then rows. Source: Saito and Toriwaki, "New Algorithms for Euclidean Distance Transformation",
//! 1994.

use rayon::prelude::*;

/// No covered texel in reach.
const NONE: i32 = i32::MAX;

/// Pairs of an uncovered texel and the covered one nearest to it, at most `reach` texels away.
///
/// Of equally near ones the leftmost is taken, and in its column the upper one.
pub(super) fn sources(covered: &[bool], width: usize, reach: usize) -> Vec<(usize, usize)> {
    if reach == 0 || covered.iter().all(|&c| c) {
        return Vec::new();
    }
    let columns = nearest_in_columns(covered, width, reach);
    let rows = covered.par_chunks_exact(width).zip(columns.par_chunks_exact(width)).enumerate();
    let found = rows.with_min_len(8).map(|(row, (covered, down))| {
        let mut found = Vec::new();
        for column in (0..width).filter(|&column| !covered[column]) {
            let mut best = (reach * reach + 1) as i64;
            let mut source = None;
            for across in 0..=reach {
                let squared = (across * across) as i64;
                if squared >= best {
                    break;
                }
                let right = (across > 0 && column + across < width).then_some(column + across);
                for other in column.checked_sub(across).into_iter().chain(right) {
                    let distance = squared + i64::from(down[other]) * i64::from(down[other]);
                    if down[other] != NONE && distance < best {
                        best = distance;
                        source = Some((row as i64 + i64::from(down[other])) as usize * width + other);
                    }
                }
            }
            found.extend(source.map(|source| (row * width + column, source)));
        }
        found
    });
    found.flatten_iter().collect()
}

/// For each texel, how many rows down the nearest covered texel of its column is; negative is up.
fn nearest_in_columns(covered: &[bool], width: usize, reach: usize) -> Vec<i32> {
    let reach = i32::try_from(reach).unwrap_or(NONE - 1);
    let mut down = vec![NONE; covered.len()];
    for at in 0..covered.len() {
        let above = at.checked_sub(width).map_or(NONE, |above| down[above]);
        if covered[at] {
            down[at] = 0;
        } else if above != NONE && above > -reach {
            down[at] = above - 1;
        }
    }
    let mut below = vec![NONE; width];
    for at in (0..covered.len()).rev() {
        let below = &mut below[at % width];
        *below = if covered[at] { 0 } else { below.saturating_add(1) };
        if *below <= reach && (down[at] == NONE || *below < -down[at]) {
            down[at] = *below;
        }
    }
    down
}

/// Copies texels of `channels` floats along [`sources`].
pub(super) fn fill(map: &mut [f32], channels: usize, sources: &[(usize, usize)]) {
    for &(target, source) in sources {
        map.copy_within(source * channels..(source + 1) * channels, target * channels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_covered_texel_is_found() {
        let (width, height) = (23, 17);
        for seed in 0..20u32 {
            let covered: Vec<bool> = (0..width * height)
                .map(|i| (i as u32 ^ seed).wrapping_mul(2_654_435_761).rotate_left(13).is_multiple_of(60))
                .collect();
            for reach in [1, 3, 8, 1000] {
                let found = sources(&covered, width, reach);
                let map: std::collections::HashMap<usize, usize> = found.iter().copied().collect();
                assert_eq!(map.len(), found.len());
                for at in 0..width * height {
                    let distance = |to: usize| {
                        let (dx, dy) = ((at % width).abs_diff(to % width), (at / width).abs_diff(to / width));
                        dx * dx + dy * dy
                    };
                    let nearest = (0..width * height).filter(|&to| covered[to]).map(distance).min();
                    let expected = nearest.filter(|&d| !covered[at] && d <= reach * reach);
                    assert_eq!(map.get(&at).map(|&to| distance(to)), expected, "texel {at}, reach {reach}");
                    assert!(map.get(&at).is_none_or(|&to| covered[to]));
                }
            }
        }
    }

    #[test]
    fn nothing_is_grown_from_nothing() {
        assert!(sources(&[false; 12], 4, 3).is_empty());
        assert!(sources(&[true; 12], 4, 3).is_empty());
        assert!(sources(&[true, false], 2, 0).is_empty());
    }

    #[test]
    fn texels_are_copied_whole() {
        let mut map = vec![0.0, 0.0, 5.0, 6.0];
        fill(&mut map, 2, &[(0, 1)]);
        assert_eq!(map, [5.0, 6.0, 5.0, 6.0]);
    }
}
