//! Cutting the Morton order into leaves.

use std::ops::Range;

use rayon::prelude::*;

use super::LANES;

/// Keys that one thread cuts.
const PIECE: usize = 1 << 14;

/// Runs of at most eight keys that cover the order. A run too long is cut where the highest bit of
/// its codes changes, which is a plane through the middle of its cell; runs of one code are halved.
pub(super) fn runs(order: &[u64]) -> Vec<Range<usize>> {
    let pieces = cut(order, 0..order.len(), PIECE);
    let found: Vec<_> = pieces.into_par_iter().map(|piece| cut(order, piece, LANES)).collect();
    found.concat()
}

/// Runs of at most `longest` keys.
fn cut(order: &[u64], all: Range<usize>, longest: usize) -> Vec<Range<usize>> {
    let mut found = Vec::with_capacity(2 * all.len() / longest);
    let mut open = vec![all];
    while let Some(run) = open.pop() {
        if run.len() <= longest {
            if !run.is_empty() {
                found.push(run);
            }
            continue;
        }
        let code = |at: usize| (order[run.start + at] >> 32) as u32;
        // Whole leaves on one side, so that few are left half empty.
        let half = || (run.len() / 2).next_multiple_of(LANES);
        let middle = run.start + middle(run.len(), code).unwrap_or_else(half);
        open.push(middle..run.end);
        open.push(run.start..middle);
    }
    found
}

/// Where the highest bit changes that is not the same in all of some ascending codes, at least two; `None`
/// when they are all the same.
pub(super) fn middle(count: usize, code: impl Fn(usize) -> u32) -> Option<usize> {
    let (first, last) = (code(0), code(count - 1));
    if first == last {
        return None;
    }
    let bit = 31 - (first ^ last).leading_zeros();
    let prefix = last >> bit;
    let (mut low, mut high) = (1, count - 1);
    while low < high {
        let at = low.midpoint(high);
        if code(at) >> bit < prefix {
            low = at + 1;
        } else {
            high = at;
        }
    }
    Some(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(codes: &[u32]) -> Vec<Range<usize>> {
        let order: Vec<u64> = codes.iter().map(|&code| u64::from(code) << 32).collect();
        let found = runs(&order);
        let mut next = 0;
        for run in &found {
            assert_eq!(run.start, next);
            assert!(!run.is_empty() && run.len() <= LANES);
            next = run.end;
        }
        assert_eq!(next, codes.len());
        found
    }

    #[test]
    fn leaves_cover_the_order() {
        assert!(checked(&[]).is_empty());
        assert_eq!(checked(&[5]), vec![0..1]);
        assert_eq!(checked(&[7; 9]).len(), 2);
        assert_eq!(checked(&[7; 80]).len(), 10);
        checked(&(0..1000).map(|i| i * i).collect::<Vec<_>>());
    }

    #[test]
    fn a_cut_is_at_the_highest_bit_that_changes() {
        assert_eq!(checked(&[0, 1, 2, 4, 5, 6, 7, 16, 17]), vec![0..7, 7..9]);
    }
}
