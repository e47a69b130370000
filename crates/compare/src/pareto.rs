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
/// Errors up to this many texels are the same: what is left of an exact answer in 32 bits, which differs with
/// the order of operations and shows nowhere.
pub const ERROR_FLOOR: f64 = 1.0e-3;

impl Candidate {
    fn ranked_error(&self) -> f64 {
        self.error.max(ERROR_FLOOR)
    }
}

fn no_less_accurate(a: &Candidate, b: &Candidate) -> bool {
    a.ranked_error() <= b.ranked_error()
}

/// Whether `a` makes `b` pointless: it is not slower beyond the spread, not less accurate, and clearly
/// better in one of the two, or equal in both with less memory.
fn dominates(a: &Candidate, b: &Candidate) -> bool {
    if b.time.clearly_faster(&a.time) {
        return false;
    }
    let more_accurate = a.ranked_error() < b.ranked_error() * (1.0 - ERROR_SLACK);
    let better = no_less_accurate(a, b) && (more_accurate || a.time.clearly_faster(&b.time));
    let equal = a.ranked_error() <= b.ranked_error() * (1.0 + ERROR_SLACK) && !a.time.clearly_faster(&b.time);
    better || equal && a.memory < b.memory
}

/// Whether `a` makes `b` pointless however ties in time are broken: it is clearly faster, or both were timed as
/// one (they differ in formats alone).
fn outclasses(a: &Candidate, b: &Candidate) -> bool {
    if a.time == b.time { dominates(a, b) } else { no_less_accurate(a, b) && a.time.clearly_faster(&b.time) }
}

/// Indices of those that are on the front or would be, were ties in time broken in their favour.
pub fn contenders(candidates: &[Candidate]) -> Vec<usize> {
    let fit: Vec<usize> = (0..candidates.len())
        .filter(|&i| candidates[i].eligible && candidates[i].error.is_finite())
        .collect();
    let beaten = |i: usize| fit.iter().any(|&j| j != i && outclasses(&candidates[j], &candidates[i]));
    fit.iter().copied().filter(|&i| !beaten(i)).collect()
}

/// Indices on the Pareto front, by rising median time.
///
/// With spreads, being dominated does not carry over from one to the next: a may tie b and b tie c
/// while a is clearly faster than c. So candidates are taken from the most accurate one on, and only
/// those that were kept can keep others out.
pub fn front(candidates: &[Candidate]) -> Vec<usize> {
    let at = |i: usize| &candidates[i];
    let by_time = |a: &usize, b: &usize| at(*a).time.median_ns.total_cmp(&at(*b).time.median_ns);
    let mut order = contenders(candidates);
    order.sort_by(|a, b| at(*a).ranked_error().total_cmp(&at(*b).ranked_error()).then_with(|| by_time(a, b)));
    // Of equally accurate ones, those that need less memory come first.
    let equals = |a: &usize, b: &usize| at(*b).ranked_error() <= at(*a).ranked_error() * (1.0 + ERROR_SLACK);
    for group in order.chunk_by_mut(equals) {
        group.sort_by(|a, b| at(*a).memory.total_cmp(&at(*b).memory).then_with(|| by_time(a, b)));
    }
    let mut front: Vec<usize> = Vec::new();
    for i in order {
        if !front.iter().any(|&kept| dominates(at(kept), at(i))) {
            front.push(i);
        }
    }
    front.sort_by(by_time);
    front
}

/// Those of the contenders that may take the place of contender `i` where ties in time are broken otherwise: no
/// less accurate, not clearly slower, and not timed as one with it.
///
/// One of `i` and its rivals is on the front however ties are broken: of all that are no less accurate than `i`,
/// the one that is truly fastest is kept out by nothing, and whoever is clearly slower than `i` is not that one.
pub fn rivals(candidates: &[Candidate], i: usize, contenders: &[usize]) -> Vec<usize> {
    let own = &candidates[i];
    let rival = |&j: &usize| {
        let other = &candidates[j];
        let as_accurate = other.ranked_error() <= own.ranked_error() * (1.0 + ERROR_SLACK);
        as_accurate && other.time != own.time && !own.time.clearly_faster(&other.time)
    };
    contenders.iter().copied().filter(|&j| j != i).filter(rival).collect()
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
    use crate::timing::LEAST_LEAD;

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
    fn what_is_left_of_exact_answers_is_no_difference() {
        let all = [candidate(2.0, 0.0, 1e-5), candidate(1.0, 0.0, 6e-4), candidate(0.5, 0.0, 2e-3)];
        assert_eq!(front(&all), [2, 1]);
    }

    #[test]
    fn contenders_are_the_front_and_what_ties_with_it() {
        // Beside the front: one that ties with its better, one that is beaten outright, one timed as its better.
        let all = [
            candidate(1.0, 0.0, 9.0),
            candidate(2.0, 0.0, 1.0),
            candidate(1.9, 0.0, 2.0),
            candidate(4.0, 0.0, 2.0),
            candidate(2.0, 0.0, 3.0),
        ];
        assert_eq!(front(&all), [0, 1]);
        assert_eq!(contenders(&all), [0, 1, 2]);
        assert_eq!(ties(&all, 1, &[0, 1, 2]), [2]);
    }

    #[test]
    fn whatever_the_noise_the_front_is_among_the_contenders() {
        let mut random = crate::rays::Random::new(9, 9);
        for _ in 0..500 {
            let all: Vec<Candidate> = (0..12)
                .map(|_| {
                    let mut unit = || random.unit();
                    let (time, spread) = (1.0 + 2.0 * unit(), 0.4 * unit());
                    Candidate {
                        memory: (2.0 * unit()).round(),
                        ..candidate(time, spread, (4.0 * unit()).round())
                    }
                })
                .collect();
            let near = contenders(&all);
            let front = front(&all);
            assert!(front.iter().all(|i| near.contains(i)));
            // Each contender that is off the front ties with a member of it.
            let tied = |i: &usize| front.contains(i) || !ties(&all, *i, &front).is_empty();
            assert!(near.iter().all(tied));
            // The rivals of a contender tie with it, and a contender without any is on the front.
            for &i in &near {
                let rivals = rivals(&all, i, &near);
                assert_eq!(ties(&all, i, &rivals), rivals);
                assert!(!rivals.is_empty() || front.contains(&i));
            }
        }
    }

    #[test]
    fn one_of_a_contender_and_its_rivals_is_never_beaten_while_times_stay_within_the_tie() {
        let mut random = crate::rays::Random::new(9, 10);
        let (mut certain, mut alone_beaten, mut one_missing) = (0, 0, 0);
        for _ in 0..500 {
            let mut run = |all: &[Candidate], most: f64| -> Vec<Candidate> {
                let moved = |one: &Candidate| {
                    let factor = most.powf(random.unit() - 0.5);
                    let Timing { median_ns, low_ns, high_ns } = one.time;
                    let time = Timing {
                        median_ns: median_ns * factor,
                        low_ns: low_ns * factor,
                        high_ns: high_ns * factor,
                    };
                    Candidate { time, ..*one }
                };
                all.iter().map(moved).collect()
            };
            let even: Vec<Candidate> = (0..12).map(|k| candidate(2.0, 0.02, f64::from(k % 7))).collect();
            let here = run(&even, 6.0);
            // Each quotient of two times moves by a tie's breadth at most.
            let there = run(&here, LEAST_LEAD);
            // Beaten by medians alone, where a tie is no excuse.
            let beaten = |i: &usize| {
                let faster = |by: &Candidate| by.time.median_ns < there[*i].time.median_ns;
                there.iter().any(|by| faster(by) && no_less_accurate(by, &there[*i]))
            };
            let near = contenders(&here);
            for &i in &near {
                let rivals = rivals(&here, i, &near);
                certain += usize::from(rivals.is_empty());
                alone_beaten += usize::from(beaten(&i));
                assert!(!beaten(&i) || !rivals.iter().all(beaten));
                let but_first = rivals.get(1..).unwrap_or_default();
                one_missing += usize::from(beaten(&i) && but_first.iter().all(beaten));
            }
        }
        assert!(certain > 500, "{certain}");
        assert!(alone_beaten > 100, "rivals count for something: {alone_beaten}");
        assert!(one_missing > 50, "and none of them too many: {one_missing}");
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
