//! Cutting the Morton order into leaves.

use std::ops::Range;

use super::LANES;

/// Runs of at most eight keys that cover the order. A run too long is cut where the highest bit of
/// its codes changes, which is a plane through the middle of its cell; runs of one code are halved.
pub(super) fn runs(order: &[u64]) -> Vec<Range<usize>> {
    let mut found = Vec::with_capacity(order.len() / 4);
    let mut open = Vec::new();
    if !order.is_empty() {
        open.push(0..order.len());
    }
    while let Some(run) = open.pop() {
        if run.len() <= LANES {
            found.push(run);
            continue;
        }
        let code = |at: usize| (order[at] >> 32) as u32;
        let (first, last) = (code(run.start), code(run.end - 1));
        let middle = if first == last {
            // Whole leaves on one side, so that few are left half empty.
            run.start + (run.len() / 2).next_multiple_of(LANES)
        } else {
            let bit = 31 - (first ^ last).leading_zeros();
            let prefix = last >> bit;
            run.start + order[run.clone()].partition_point(|&key| ((key >> 32) as u32) >> bit < prefix)
        };
        open.push(middle..run.end);
        open.push(run.start..middle);
    }
    found
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
