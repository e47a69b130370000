//! Horizon maps against a walk of the bilinear surface in `f64`, closed forms and symmetries.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use bake::{BakeError, Progress, azimuth, horizon_map};
use common::walk::horizon_sine;
use heightfield::{Extent, HeightField, Wrap};

fn field(texels: &[f32], size: [usize; 2], wrap: Wrap, scale: f32, tile_size: [f32; 2]) -> HeightField {
    let extent = Extent { scale, tile_size, ..Extent::default() };
    HeightField::new(texels, size[0], size[1], wrap).unwrap().with_extent(extent).unwrap()
}

fn bake(field: &HeightField, azimuths: usize) -> Vec<f32> {
    horizon_map(field, azimuths, Progress::none()).unwrap()
}

/// Errors of a map, sorted; `shown[k]` is the azimuth that plane `k` is said to show.
///
/// A map promises to look over one length of the field along the azimuth's main axis, and never looks
/// farther than two. What it says is wrong by as much as it is below the one or above the other: a judge
/// that looked over one and a half would call wrong what only he, or only the map, has seen.
fn errors(field: &HeightField, map: &[f32], shown: impl Fn(usize) -> [f64; 2]) -> Vec<f64> {
    let (w, h) = (field.width(), field.height());
    let tile = field.extent().tile_size.map(f64::from);
    let mut errors: Vec<f64> = map
        .iter()
        .enumerate()
        .map(|(at, &sine)| {
            let (k, j, i) = (at / (w * h), at / w % h, at % w);
            let direction = shown(k);
            let texels = [direction[0].abs() * w as f64 / tile[0], direction[1].abs() * h as f64 / tile[1]];
            let length = if texels[0] >= texels[1] { w as f64 / texels[0] } else { h as f64 / texels[1] };
            let seen = |lengths: f64| horizon_sine(field, i, j, direction, lengths * length);
            let sine = f64::from(sine);
            (seen(1.0) - sine).max(sine - seen(2.0)).max(0.0)
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * q) as usize]
}

fn waves(n: usize) -> Vec<f32> {
    let t = std::f32::consts::TAU;
    (0..n * n)
        .map(|at| {
            let (x, y) = ((at % n) as f32 / n as f32, (at / n) as f32 / n as f32);
            0.5 + 0.2 * (t * 2.0 * x + 1.0).sin() * (t * y).cos() + 0.2 * (t * (3.0 * y - x)).sin()
        })
        .collect()
}

fn close(a: &[f32], b: &[f32], tolerance: f32, what: &str) {
    assert_eq!(a.len(), b.len());
    let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(worst <= tolerance, "{what}: {worst} apart");
}

#[test]
fn azimuths_along_the_axes_are_exact() {
    for (size, tile) in [([40, 40], [1.0, 1.0]), ([31, 17], [2.0, 0.5]), ([1, 24], [1.0, 1.0])] {
        for wrap in [Wrap::Repeat, Wrap::Clamp] {
            let field = field(&common::noise(size[0] * size[1], 3), size, wrap, 0.2, tile);
            let sorted = errors(&field, &bake(&field, 4), |k| azimuth(k, 4));
            assert!(quantile(&sorted, 1.0) < 2e-6, "{size:?} {wrap:?}: {}", quantile(&sorted, 1.0));
        }
    }
}

/// Measured: smooth 0.0016 and 0.0099 (90 and 99 %), noise texel by texel 0.009 and 0.062.
#[test]
fn any_azimuth_is_close_and_the_wrong_one_is_not() {
    let n = 28;
    for (texels, limits) in [(waves(n), [0.002, 0.012]), (common::noise(n * n, 7), [0.015, 0.08])] {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let field = field(&texels, [n, n], wrap, 0.2, [1.0, 1.0]);
            let map = bake(&field, 13);
            let sorted = errors(&field, &map, |k| azimuth(k, 13));
            assert!(quantile(&sorted, 0.5) < 1e-3, "{wrap:?}: {}", quantile(&sorted, 0.5));
            for (q, limit) in [0.9, 0.99].into_iter().zip(limits) {
                assert!(quantile(&sorted, q) < limit, "{wrap:?}, {q}: {}", quantile(&sorted, q));
            }
            // The same comparison must fail when y is taken to run down.
            let down = |k| azimuth(13 - k, 13);
            let wrong = errors(&field, &map, down);
            assert!(quantile(&wrong, 0.9) > 10.0 * limits[0], "{}", quantile(&wrong, 0.9));
        }
    }
}

#[test]
fn a_flat_map_has_no_horizon_and_steepness_no_nan() {
    let flat = field(&[0.7; 35], [7, 5], Wrap::Repeat, 3.0, [1.0, 1.0]);
    assert!(bake(&flat, 12).iter().all(|&sine| sine == 0.0));
    for scale in [0.0, 1e-30, 1e30] {
        let rough = field(&common::noise(64, 5), [8, 8], Wrap::Mirror, scale, [1.0, 1.0]);
        assert!(bake(&rough, 7).iter().all(|sine| (0.0..=1.0).contains(sine)));
    }
    let one = field(&[1.0], [1, 1], Wrap::Clamp, 1.0, [1.0, 1.0]);
    assert_eq!(bake(&one, 3), [0.0; 3]);
}

/// Lines that pass beside a texel run over the pit; their eyes must not be taken for the texel's.
#[test]
fn a_pit_raises_no_horizon_beside_it() {
    for (size, wrap) in [([48, 40], Wrap::Repeat), ([33, 47], Wrap::Clamp), ([40, 40], Wrap::Mirror)] {
        let mut texels = vec![1.0; size[0] * size[1]];
        let pits = [7 * size[0] + 19, 25 * size[0] + 9, 25 * size[0] + 11];
        for pit in pits {
            texels[pit] = 0.0;
        }
        let map = bake(&field(&texels, size, wrap, 0.3, [1.0, 1.0]), 32);
        for (at, &sine) in map.iter().enumerate() {
            let pit = pits.contains(&(at % texels.len()));
            assert_eq!(
                sine > 5e-6,
                pit,
                "{wrap:?}, azimuth {}, texel {}: {sine}",
                at / texels.len(),
                at % texels.len()
            );
        }
    }
}

/// A wall along x, `d` rows away, rises by `scale sin(a) / distance` at azimuth `a`.
#[test]
fn an_endless_wall_stands_at_the_known_angle() {
    let (w, h) = (64, 48);
    let texels: Vec<f32> = (0..w * h).map(|at| if at / w == 20 { 1.0 } else { 0.0 }).collect();
    let field = field(&texels, [w, h], Wrap::Repeat, 0.3, [1.0, 0.75]);
    let (map, n) = (bake(&field, 24), 24);
    for k in 0..n {
        let [dx, dy] = azimuth(k, n);
        for rows in 1..12 {
            // Up the image is towards lower rows: looking with +y, the wall is above rows 21 and on.
            let j = if dy > 0.0 { 20 + rows } else { 20 - rows };
            let distance = rows as f64 / 64.0;
            if dy.abs() < 0.3 || distance * dx.abs() > 0.75 * dy.abs() {
                continue;
            }
            let tangent = 0.3 * dy.abs() / distance;
            let expected = tangent / tangent.hypot(1.0);
            for i in 0..w {
                let got = f64::from(map[(k * h + j) * w + i]);
                // Within the steps that a texel goes itself, or between two lines.
                let near = rows as f64 <= 8.0 * (dy / dx).abs().min(1.0);
                let limit = if near { 1e-5 } else { 0.02 };
                assert!((got - expected).abs() < limit, "azimuth {k}, {rows} rows, {got} for {expected}");
            }
        }
    }
}

/// Seen from `d` away, at `b` beside its middle, a half ball of radius `r` rises to
/// `asin(sqrt(r^2 - d^2 sin^2 b) / (d cos b))`.
#[test]
fn a_half_ball_rises_as_geometry_says() {
    let n = 160;
    let radius = 0.15;
    let centre = [80.0, 80.0];
    let texels: Vec<f32> = (0..n * n)
        .map(|at| {
            let (x, y) = ((at % n) as f32 - centre[0], (at / n) as f32 - centre[1]);
            let r2 = (x * x + y * y) / (n * n) as f32;
            (radius * radius - r2).max(0.0).sqrt() / radius
        })
        .collect();
    let field = field(&texels, [n, n], Wrap::Clamp, radius, [1.0, 1.0]);
    let azimuths = 36;
    let map = bake(&field, azimuths);
    let mut seen = 0;
    for (i, j) in [(40, 80), (80, 20), (130, 120), (30, 100), (110, 130)] {
        let (x, y) = ((80.0 - i as f64) / n as f64, (j as f64 - 80.0) / n as f64);
        let distance = x.hypot(y);
        for k in 0..azimuths {
            let [dx, dy] = azimuth(k, azimuths);
            let (along, beside) = (x * dx + y * dy, x * dy - y * dx);
            let chord = f64::from(radius * radius) - beside * beside;
            let expected = if along > 0.0 && chord > 0.0 { chord.sqrt() / along } else { 0.0 };
            let got = f64::from(map[(k * n + j) * n + i]);
            // Where the line of sight only just touches the ball, a texel decides.
            if chord.abs() > 0.15 * f64::from(radius * radius) {
                assert!((got - expected).abs() < 0.02, "{i} {j} azimuth {k}: {got} for {expected}");
                seen += usize::from(expected > 0.0 && distance > 0.2);
            }
        }
    }
    assert!(seen > 10);
}

#[test]
fn turning_the_map_turns_the_horizon() {
    let n = 24;
    let texels = common::noise(n * n, 11);
    // A quarter turn counter-clockwise: what was at +x comes to +y, up the image.
    let turned: Vec<f32> = (0..n * n).map(|at| texels[at % n * n + n - 1 - at / n]).collect();
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        let before = bake(&field(&texels, [n, n], wrap, 0.3, [1.0, 1.0]), 12);
        let after = bake(&field(&turned, [n, n], wrap, 0.3, [1.0, 1.0]), 12);
        let expected: Vec<f32> = (0..12 * n * n)
            .map(|at| {
                let (k, j, i) = (at / (n * n), at / n % n, at % n);
                before[((k + 9) % 12 * n + i) * n + n - 1 - j]
            })
            .collect();
        close(&after, &expected, 1e-5, &format!("{wrap:?}"));
    }
}

#[test]
fn shifting_a_tiled_map_shifts_the_horizon() {
    let n = 32;
    let shifted = |values: &[f32], [x, y]: [usize; 2]| -> Vec<f32> {
        values
            .chunks(n * n)
            .flat_map(|plane| (0..n * n).map(move |at| plane[(at / n + y) % n * n + (at % n + x) % n]))
            .collect()
    };
    let texels = common::noise(n * n, 2);
    let bake_of =
        |texels: &[f32], azimuths| bake(&field(texels, [n, n], Wrap::Repeat, 0.3, [1.0, 1.0]), azimuths);
    for by in [[5, 0], [0, 9], [17, 30]] {
        // Along the axes and the diagonals; elsewhere far lines pass between texels, and others of them.
        let moved = bake_of(&shifted(&texels, by), 8);
        close(&moved, &shifted(&bake_of(&texels, 8), by), 1e-5, &format!("{by:?}"));
    }
}

#[test]
fn a_senseless_number_of_azimuths_is_refused_and_a_stop_is_heard() {
    let field = field(&[0.5; 16], [4, 4], Wrap::Repeat, 0.1, [1.0, 1.0]);
    for azimuths in [0, 5000] {
        let error = horizon_map(&field, azimuths, Progress::none()).unwrap_err();
        assert!(matches!(error, BakeError::Option { .. }), "{error}");
    }
    let mut reports = Vec::new();
    let mut stop = |done, total| {
        reports.push((done, total));
        reports.len() < 3
    };
    let stopped = horizon_map(&field, 8, Progress::new(&mut stop));
    assert!(matches!(stopped, Err(BakeError::Interrupted)));
    assert_eq!(reports, [(0, 4), (0, 4), (1, 4)]);
}
