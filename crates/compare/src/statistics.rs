//! Percentiles of samples, and what they say about everything that was not sampled.

/// Quantile of the standard normal distribution for a one-sided confidence of 95 %.
const Z95: f64 = 1.644_854;

/// Nearest-rank percentile, `rank` in 0..1; 0 for no values. Reorders the values.
pub fn percentile(values: &mut [f32], rank: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let at = ((rank * values.len() as f64).ceil() as usize).clamp(1, values.len()) - 1;
    f64::from(*values.select_nth_unstable_by(at, f32::total_cmp).1)
}

/// A value that the `rank` quantile of what was sampled does not exceed, with 95 % confidence, whatever
/// its distribution: an order statistic (Thompson 1936). `None` when there are too few values for one.
/// Reorders the values.
pub fn percentile_bound(values: &mut [f32], rank: f64) -> Option<f64> {
    let n = values.len();
    let above = values_above(n, 1.0 - rank)?;
    let at = n - 1 - above;
    Some(f64::from(*values.select_nth_unstable_by(at, f32::total_cmp).1))
}

/// Largest `j` with `P(X <= j) <= 5 %` for a binomial `X` of `n` trials at chance `p`.
fn values_above(n: usize, p: f64) -> Option<usize> {
    let trials = n as f64;
    if trials * p > 500.0 {
        // With this many expected the normal distribution is near enough; one is given away.
        let low = trials * p - Z95 * (trials * p * (1.0 - p)).sqrt() - 1.0;
        return Some(low.floor() as usize);
    }
    let mut chance = (trials * (-p).ln_1p()).exp();
    let mut sum = chance;
    let mut j = 0_usize;
    while sum <= 0.05 {
        chance *= (trials - j as f64) / (j as f64 + 1.0) * p / (1.0 - p);
        sum += chance;
        j += 1;
    }
    j.checked_sub(1)
}

/// Upper end of the one-sided 95 % interval of a share seen in `n` trials (Wilson 1927); 1 without any.
pub fn share_bound(share: f64, n: usize) -> f64 {
    if n == 0 {
        return 1.0;
    }
    let (n, z2) = (n as f64, Z95 * Z95);
    let middle = share + z2 / (2.0 * n);
    let spread = Z95 * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    ((middle + spread) / (1.0 + z2 / n)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Random;

    #[test]
    fn the_bound_holds_for_nineteen_samples_of_twenty() {
        // Uniform values, whose 99th percentile is 0.99.
        let mut random = Random::new(3, 3);
        for n in [299, 1000, 4000, 60_000] {
            let tries = if n > 10_000 { 60 } else { 600 };
            let kept = (0..tries)
                .filter(|_| {
                    let mut values: Vec<f32> = (0..n).map(|_| random.unit() as f32).collect();
                    percentile_bound(&mut values, 0.99).unwrap() >= 0.99
                })
                .count() as f64
                / f64::from(tries);
            assert!(kept > 0.92, "{n}: {kept}");
        }
        assert_eq!(percentile_bound(&mut [0.5; 298], 0.99), None, "0.99^298 > 5 %");
        assert!(percentile_bound(&mut [0.5; 299], 0.99).is_some());
    }

    #[test]
    fn bounds_of_shares_are_those_of_the_tables() {
        // Wilson's upper end for 0 of n is z^2 / (n + z^2).
        assert!((share_bound(0.0, 1000) - 2.705_54 / 1_002.705_54).abs() < 1e-7);
        assert!((share_bound(0.5, 100) - 0.5811).abs() < 1e-3);
        assert_eq!(share_bound(0.0, 0), 1.0);
        assert!((share_bound(1.0, 5) - 1.0).abs() < 1e-12);
    }
}
