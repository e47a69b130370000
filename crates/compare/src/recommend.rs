//! The cheapest setting within an error budget, and why; or why there is none.

use crate::Timing;

/// A measured setting.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Name for the reason, such as `relief(linear=32, refine=8)`.
    pub label: String,
    /// Time per ray.
    pub time: Timing,
    /// 99th percentile of the hit-uv error, texels.
    pub error_texels: f64,
    /// Share of rays without a right hit, 0..1.
    pub failure_rate: f64,
}

/// What is acceptable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Largest 99th percentile of the hit-uv error, texels.
    pub max_error_texels: f64,
    /// Largest share of rays without a right hit, 0..1.
    pub max_failure_rate: f64,
}

/// What to use.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// Index of the entry, if any is within the budget.
    pub pick: Option<usize>,
    /// One or two sentences.
    pub reason: String,
}

/// Picks the cheapest entry within the budget. Among those that time cannot tell apart from the
/// cheapest, the most accurate wins.
pub fn recommend(entries: &[Entry], budget: &Budget) -> Advice {
    let reliable: Vec<usize> =
        (0..entries.len()).filter(|&i| entries[i].failure_rate <= budget.max_failure_rate).collect();
    let within: Vec<usize> =
        reliable.iter().copied().filter(|&i| entries[i].error_texels <= budget.max_error_texels).collect();
    let by_time =
        |a: &&usize, b: &&usize| entries[**a].time.median_ns.total_cmp(&entries[**b].time.median_ns);
    let Some(&fastest) = within.iter().min_by(by_time) else {
        return Advice { pick: None, reason: why_none(entries, &reliable, budget) };
    };
    let rivals: Vec<usize> =
        within.iter().copied().filter(|&i| !entries[fastest].time.clearly_faster(&entries[i].time)).collect();
    let pick = rivals
        .iter()
        .copied()
        .min_by(|&a, &b| entries[a].error_texels.total_cmp(&entries[b].error_texels))
        .unwrap_or(fastest);
    let chosen = &entries[pick];
    let rank = if within.len() == 1 {
        "the only setting".to_owned()
    } else {
        format!("the least of the {} settings", within.len())
    };
    let mut reason = format!(
        "{} takes {} ns a ray, {rank} with a p99 error of at most {} texels and at most {} of rays failing; \
         measured: {} texels, {} failing.",
        chosen.label,
        digits(chosen.time.median_ns),
        digits(budget.max_error_texels),
        percent(budget.max_failure_rate),
        digits(chosen.error_texels),
        percent(chosen.failure_rate),
    );
    let others: Vec<&str> =
        rivals.iter().filter(|&&i| i != pick).map(|&i| entries[i].label.as_str()).collect();
    if !others.is_empty() {
        reason.push_str(&format!(
            " Its time cannot be told from that of {}, which {} less accurate.",
            others.join(", "),
            if others.len() == 1 { "is" } else { "are" }
        ));
    }
    Advice { pick: Some(pick), reason }
}

fn why_none(entries: &[Entry], reliable: &[usize], budget: &Budget) -> String {
    if entries.is_empty() {
        return "Nothing was measured.".to_owned();
    }
    let least = |indices: &[usize], key: fn(&Entry) -> f64| {
        indices.iter().copied().min_by(|&a, &b| key(&entries[a]).total_cmp(&key(&entries[b])))
    };
    if let Some(best) = least(reliable, |e| e.error_texels) {
        return format!(
            "No setting has a p99 error of at most {} texels; the most accurate one that is reliable, {}, \
             has {}.",
            digits(budget.max_error_texels),
            entries[best].label,
            digits(entries[best].error_texels)
        );
    }
    let all: Vec<usize> = (0..entries.len()).collect();
    match least(&all, |e| e.failure_rate) {
        Some(best) => format!(
            "Every setting fails on more than {} of rays (skipped hits, no answer or NaN); the most reliable, \
             {}, on {}.",
            percent(budget.max_failure_rate),
            entries[best].label,
            percent(entries[best].failure_rate)
        ),
        None => "Nothing was measured.".to_owned(),
    }
}

fn percent(share: f64) -> String {
    format!("{} %", digits(share * 100.0))
}

/// Three significant digits, with an exponent where that is shorter.
fn digits(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let magnitude = value.abs().log10().floor() as i32;
    if (-3..6).contains(&magnitude) {
        let text = format!("{value:.*}", (2 - magnitude).max(0) as usize);
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(label: &str, time: f64, spread: f64, error: f64, failure_rate: f64) -> Entry {
        let time = Timing { median_ns: time, low_ns: time - spread, high_ns: time + spread };
        Entry { label: label.to_owned(), time, error_texels: error, failure_rate }
    }

    const BUDGET: Budget = Budget { max_error_texels: 0.5, max_failure_rate: 1e-3 };

    #[test]
    fn the_cheapest_within_the_budget_wins() {
        let all = [
            entry("sloppy", 1.0, 0.0, 3.0, 0.0),
            entry("leaky", 2.0, 0.0, 0.1, 0.02),
            entry("good", 3.0, 0.0, 0.4, 0.0),
            entry("better", 9.0, 0.0, 0.01, 0.0),
        ];
        let advice = recommend(&all, &BUDGET);
        assert_eq!(advice.pick, Some(2));
        assert!(advice.reason.contains("good") && advice.reason.contains("0.4 texels"), "{}", advice.reason);
    }

    #[test]
    fn of_tied_times_the_more_accurate_wins() {
        let all = [entry("a", 3.0, 0.5, 0.4, 0.0), entry("b", 3.2, 0.5, 0.2, 0.0)];
        let advice = recommend(&all, &BUDGET);
        assert_eq!(advice.pick, Some(1));
        assert!(advice.reason.contains("cannot be told"), "{}", advice.reason);
    }

    #[test]
    fn numbers_have_three_digits() {
        let expected = [(0.0, "0"), (0.5, "0.5"), (1234.5, "1234"), (0.01234, "0.0123"), (2.4e-5, "2.4e-5")];
        for (value, text) in expected {
            assert_eq!(digits(value), text);
        }
    }

    #[test]
    fn says_why_nothing_qualifies() {
        let inaccurate = recommend(&[entry("a", 1.0, 0.0, 3.0, 0.0)], &BUDGET);
        assert!(inaccurate.pick.is_none() && inaccurate.reason.contains("has 3."), "{}", inaccurate.reason);
        let leaky = recommend(&[entry("a", 1.0, 0.0, 0.1, 0.5)], &BUDGET);
        assert!(leaky.pick.is_none() && leaky.reason.contains("50 %"), "{}", leaky.reason);
        assert!(recommend(&[], &BUDGET).pick.is_none());
    }
}
