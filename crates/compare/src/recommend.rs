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
    /// Bytes of texture that it reads.
    pub memory_bytes: f64,
}

/// What is acceptable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Largest 99th percentile of the hit-uv error, texels.
    pub max_error_texels: f64,
    /// Largest share of rays without a right hit, 0..1.
    pub max_failure_rate: f64,
    /// Longest time a ray, nanoseconds.
    pub max_time_ns: f64,
    /// Most bytes of texture.
    pub max_memory_bytes: f64,
}

impl Budget {
    /// Limits of accuracy alone.
    pub fn of_errors(max_error_texels: f64, max_failure_rate: f64) -> Self {
        Self {
            max_error_texels,
            max_failure_rate,
            max_time_ns: f64::INFINITY,
            max_memory_bytes: f64::INFINITY,
        }
    }

    fn affords(&self, entry: &Entry) -> bool {
        entry.time.median_ns <= self.max_time_ns && entry.memory_bytes <= self.max_memory_bytes
    }

    /// The limits beside those of accuracy, as part of a sentence.
    fn limits(&self) -> String {
        let mut text = String::new();
        if self.max_time_ns.is_finite() {
            text.push_str(&format!(", at most {} ns a ray", digits(self.max_time_ns)));
        }
        if self.max_memory_bytes.is_finite() {
            text.push_str(&format!(", at most {} KiB of texture", digits(self.max_memory_bytes / 1024.0)));
        }
        text
    }
}

/// What to use.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// Index of the entry, if any is within the budget.
    pub pick: Option<usize>,
    /// One or two sentences.
    pub reason: String,
}

/// Errors closer than this share are equal.
const ERROR_SLACK: f64 = 1.0e-3;

/// Picks the cheapest entry within the budget. Among those that time cannot tell apart from the
/// cheapest, the most accurate wins, and among equally accurate ones the smallest.
pub fn recommend(entries: &[Entry], budget: &Budget) -> Advice {
    let affordable: Vec<usize> = (0..entries.len()).filter(|&i| budget.affords(&entries[i])).collect();
    let reliable: Vec<usize> =
        affordable.iter().copied().filter(|&i| entries[i].failure_rate <= budget.max_failure_rate).collect();
    let within: Vec<usize> =
        reliable.iter().copied().filter(|&i| entries[i].error_texels <= budget.max_error_texels).collect();
    let by_time =
        |a: &&usize, b: &&usize| entries[**a].time.median_ns.total_cmp(&entries[**b].time.median_ns);
    let Some(&fastest) = within.iter().min_by(by_time) else {
        return Advice { pick: None, reason: why_none(entries, &affordable, &reliable, budget) };
    };
    let rivals: Vec<usize> =
        within.iter().copied().filter(|&i| !entries[fastest].time.clearly_faster(&entries[i].time)).collect();
    let pick = rivals
        .iter()
        .copied()
        .min_by(|&a, &b| entries[a].error_texels.total_cmp(&entries[b].error_texels))
        .unwrap_or(fastest);
    let equal = |i: usize| entries[i].error_texels <= entries[pick].error_texels * (1.0 + ERROR_SLACK);
    let pick = rivals
        .iter()
        .copied()
        .filter(|&i| equal(i))
        .min_by(|&a, &b| entries[a].memory_bytes.total_cmp(&entries[b].memory_bytes))
        .unwrap_or(pick);
    let chosen = &entries[pick];
    let rank = if within.len() == 1 {
        "the only setting".to_owned()
    } else {
        format!("the least of the {} settings", within.len())
    };
    let mut reason = format!(
        "{} takes {} ns a ray, {rank} with a p99 error of at most {} texels and at most {} of rays failing{}; \
         measured: {} texels, {} failing.",
        chosen.label,
        digits(chosen.time.median_ns),
        digits(budget.max_error_texels),
        percent(budget.max_failure_rate),
        budget.limits(),
        digits(chosen.error_texels),
        percent(chosen.failure_rate),
    );
    let others: Vec<&str> =
        rivals.iter().filter(|&&i| i != pick).map(|&i| entries[i].label.as_str()).collect();
    if !others.is_empty() {
        reason.push_str(&format!(
            " Its time cannot be told from that of {}, which {} no more accurate{}.",
            others.join(", "),
            if others.len() == 1 { "is" } else { "are" },
            if rivals.iter().any(|&i| i != pick && equal(i)) { " or larger" } else { "" }
        ));
    }
    Advice { pick: Some(pick), reason }
}

fn why_none(entries: &[Entry], affordable: &[usize], reliable: &[usize], budget: &Budget) -> String {
    if entries.is_empty() {
        return "Nothing was measured.".to_owned();
    }
    let least = |indices: &[usize], key: fn(&Entry) -> f64| {
        indices.iter().copied().min_by(|&a, &b| key(&entries[a]).total_cmp(&key(&entries[b])))
    };
    if affordable.is_empty()
        && let (Some(fastest), Some(smallest)) = {
            let all: Vec<usize> = (0..entries.len()).collect();
            (least(&all, |e| e.time.median_ns), least(&all, |e| e.memory_bytes))
        }
    {
        return format!(
            "No setting is within the limits{}; the fastest, {}, takes {} ns a ray, and the smallest, {}, {} KiB.",
            budget.limits(),
            entries[fastest].label,
            digits(entries[fastest].time.median_ns),
            entries[smallest].label,
            digits(entries[smallest].memory_bytes / 1024.0)
        );
    }
    if let Some(best) = least(reliable, |e| e.error_texels) {
        return format!(
            "No setting has a p99 error of at most {} texels{}; the most accurate one that is reliable, {}, \
             has {}.",
            digits(budget.max_error_texels),
            budget.limits(),
            entries[best].label,
            digits(entries[best].error_texels)
        );
    }
    match least(affordable, |e| e.failure_rate) {
        Some(best) => format!(
            "Every setting{} fails on more than {} of rays (hits skipped or in the air, no answer or NaN); the \
             most reliable, {}, on {}.",
            budget.limits(),
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
        Entry { label: label.to_owned(), time, error_texels: error, failure_rate, memory_bytes: 4096.0 }
    }

    const BUDGET: Budget = Budget {
        max_error_texels: 0.5,
        max_failure_rate: 1e-3,
        max_time_ns: f64::INFINITY,
        max_memory_bytes: f64::INFINITY,
    };

    #[test]
    fn time_and_memory_are_limits() {
        let all = [entry("slow", 9.0, 0.0, 0.1, 0.0), entry("quick", 2.0, 0.0, 2.0, 0.0)];
        assert_eq!(recommend(&all, &BUDGET).pick, Some(0));
        let hurried = Budget { max_time_ns: 5.0, ..BUDGET };
        let advice = recommend(&all, &hurried);
        assert!(advice.pick.is_none() && advice.reason.contains("at most 5 ns a ray"), "{}", advice.reason);
        assert_eq!(recommend(&all, &Budget { max_error_texels: 3.0, ..hurried }).pick, Some(1));
        let tight = recommend(&all, &Budget { max_memory_bytes: 1024.0, ..BUDGET });
        assert!(tight.pick.is_none() && tight.reason.contains("slow, 4 KiB"), "{}", tight.reason);
        assert_eq!(Budget::of_errors(0.5, 1e-3), BUDGET);
        let small = Entry { memory_bytes: 9.0, ..entry("small", 9.1, 0.5, 0.1, 0.0) };
        let advice = recommend(&[entry("slow", 9.0, 0.5, 0.1, 0.0), small], &BUDGET);
        assert_eq!(advice.pick, Some(1));
        assert!(advice.reason.contains("no more accurate or larger"), "{}", advice.reason);
    }

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
