//! Which settings are worth having: nothing else is both faster and more accurate.

use crate::Timing;

/// One setting in the time-against-error plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Time per ray with its spread.
    pub time: Timing,
    /// Error to trade against time, such as the 99th percentile in texels.
    pub error: f64,
    /// What it needs besides, such as bytes of texture: of settings that are equal in both, the one that
    /// needs least counts.
    pub memory: f64,
    /// Whether it may be on the front at all: misses are a filter, not a trade.
    pub eligible: bool,
}

/// Errors closer than this share are the same: percentiles of a sample are not sharper.
const ERROR_SLACK: f64 = 1.0e-3;

/// Whether `a` makes `b` pointless: it is not slower beyond the spread, not less accurate, and clearly
/// better in one of the two, or equal in both with less memory.
fn dominates(a: &Candidate, b: &Candidate) -> bool {
    if b.time.clearly_faster(&a.time) {
        return false;
    }
    let more_accurate = a.error < b.error * (1.0 - ERROR_SLACK);
    let better = a.error <= b.error && (more_accurate || a.time.clearly_faster(&b.time));
    let equal = a.error <= b.error * (1.0 + ERROR_SLACK) && !a.time.clearly_faster(&b.time);
    better || equal && a.memory < b.memory
}

/// Indices on the Pareto front, by rising median time.
///
/// With spreads, being dominated does not carry over from one to the next: a may tie b and b tie c
/// while a is clearly faster than c. So candidates are taken from the most accurate one on, and only
/// those that were kept can keep others out.
pub fn front(candidates: &[Candidate]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..candidates.len())
        .filter(|&i| candidates[i].eligible && candidates[i].error.is_finite())
        .collect();
    let by_time = |a: usize, b: usize| candidates[a].time.median_ns.total_cmp(&candidates[b].time.median_ns);
    order.sort_by(|&a, &b| candidates[a].error.total_cmp(&candidates[b].error).then(by_time(a, b)));
    // An equal that needs less memory comes first, since only what was kept can keep others out.
    let at = |i: usize| &candidates[i];
    let spared = |i: usize| {
        let equal = |j: usize| (at(j).error - at(i).error).abs() <= ERROR_SLACK * at(i).error;
        order.iter().any(|&j| j != i && equal(j) && at(j).memory < at(i).memory && dominates(at(j), at(i)))
    };
    let order: Vec<usize> = order.iter().copied().filter(|&i| !spared(i)).collect();
    let mut front: Vec<usize> = Vec::new();
    for i in order {
        if !front.iter().any(|&kept| dominates(&candidates[kept], &candidates[i])) {
            front.push(i);
        }
    }
    front.sort_by(|&a, &b| by_time(a, b));
    front
}

/// Those of `others` whose time cannot be told from that of candidate `i`.
pub fn ties(candidates: &[Candidate], i: usize, others: &[usize]) -> Vec<usize> {
    let time = &candidates[i].time;
    let tied = |j: usize| {
        let other = &candidates[j].time;
        !time.clearly_faster(other) && !other.clearly_faster(time)
    };
    others.iter().copied().filter(|&j| j != i && tied(j)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(time: f64, spread: f64, error: f64) -> Candidate {
        let time = Timing { median_ns: time, low_ns: time - spread, high_ns: time + spread };
        Candidate { time, error, memory: 1.0, eligible: true }
    }

    #[test]
    fn slower_and_worse_is_off_the_front() {
        let all = [
            candidate(1.0, 0.0, 9.0),
            candidate(2.0, 0.0, 1.0),
            candidate(3.0, 0.0, 2.0),
            candidate(4.0, 0.0, 0.1),
        ];
        assert_eq!(front(&all), [0, 1, 3]);
    }

    #[test]
    fn misses_filter_before_anything_is_traded() {
        let mut all = [candidate(1.0, 0.0, 0.1), candidate(2.0, 0.0, 0.5)];
        assert_eq!(front(&all), [0]);
        all[0].eligible = false;
        assert_eq!(front(&all), [1]);
        all[1].error = f64::NAN;
        assert!(front(&all).is_empty());
    }

    #[test]
    fn a_lead_within_the_noise_does_not_count() {
        let all = [candidate(1.00, 0.1, 5.0), candidate(1.05, 0.1, 1.0)];
        assert_eq!(front(&all), [1], "the accurate one is not slower beyond the spread");
        assert_eq!((ties(&all, 0, &[0, 1]), ties(&all, 1, &[0])), (vec![1], vec![0]));
        let chain = [candidate(1.0, 0.6, 9.0), candidate(2.0, 0.6, 5.0), candidate(3.0, 0.6, 1.0)];
        assert_eq!(front(&chain), [0, 2], "the middle one is out, so it cannot keep the first one out");
        let equal = [candidate(1.00, 0.1, 1.0), candidate(1.05, 0.1, 1.0)];
        assert_eq!(front(&equal), [0, 1], "a tie in both stays a tie");
        let small = [Candidate { memory: 0.5, ..equal[1] }, equal[0], candidate(9.0, 0.1, 0.1)];
        assert_eq!(front(&small), [0, 2], "unless one needs less memory");
    }
}
