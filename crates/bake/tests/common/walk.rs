//! Horizons by walking the bilinear surface in `f64`: slow and plain.

use heightfield::HeightField;

/// The steepest rise from the centre of a texel to any point of the bilinear surface along a
/// direction within `reach` mesh units, as a sine: the surface between two grid lines is a quadratic
/// `q(s)` along the way, and `(q(s) - q(0)) / s` is largest at an end or where its derivative is 0.
pub fn horizon_sine(field: &HeightField, i: usize, j: usize, direction: [f64; 2], reach: f64) -> f64 {
    let extent = field.extent();
    let size = [field.width() as f64, field.height() as f64];
    let tile = extent.tile_size.map(f64::from);
    let rate = [direction[0] * size[0] / tile[0], -direction[1] * size[1] / tile[1]];
    let scale = f64::from(extent.scale);
    let start = [i as f64, j as f64];
    let height = |s: f64| {
        let at = [0, 1].map(|a| (start[a] + rate[a] * s + 0.5) / size[a]);
        scale * field.height_at(at[0], at[1])
    };
    let mut stops = vec![0.0, reach];
    for rate in rate.map(f64::abs).into_iter().filter(|&rate| rate > 1e-9) {
        stops.extend((1..).map(|n| f64::from(n) / rate).take_while(|&s| s < reach));
    }
    stops.sort_by(f64::total_cmp);
    let base = height(0.0);
    let mut steepest: f64 = 0.0;
    for pair in stops.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        if b - a < 1e-9 {
            continue;
        }
        // Inner points: which cell an end belongs to is a matter of rounding.
        let d = 0.25 * (b - a);
        let m = 0.5 * (a + b);
        let (low, mid, high) = (height(m - d), height(m), height(m + d));
        let curve = (high - 2.0 * mid + low) / (2.0 * d * d);
        let slope = (high - low) / (2.0 * d);
        let q = |s: f64| mid + (s - m) * (slope + (s - m) * curve);
        let mut consider = |s: f64| steepest = steepest.max((q(s) - base) / s);
        consider(b);
        if a > 1e-9 {
            consider(a);
            let constant = mid - m * (slope - m * curve) - base;
            let extremum = constant / curve;
            if extremum > a * a && extremum < b * b {
                consider(extremum.sqrt());
            }
        } else {
            steepest = steepest.max(slope - 2.0 * curve * (m - a));
        }
    }
    steepest / steepest.hypot(1.0)
}
