//! Cone maps against brute force in `f64`: neither wider than the surface allows nor narrower than it asks for.

#![allow(clippy::unwrap_used)]

mod cone_maps;

use bake::{ConeMode, Progress, cone_map};
use cone_maps::rises::steepest;
use cone_maps::{from_fn, maps, noise, waves};
use heightfield::{HeightField, Wrap};
use rayon::prelude::*;

/// Least and greatest of `truth - ratio + off`.
fn given_away(ratios: &[f32], truth: &[(usize, f64)], off: f64) -> [f64; 2] {
    let lost = truth.iter().map(|&(at, truth)| truth - f64::from(ratios[at]) + off);
    lost.fold([f64::INFINITY, f64::NEG_INFINITY], |range, lost| [range[0].min(lost), range[1].max(lost)])
}

fn is_exact([least, most]: [f64; 2]) -> bool {
    least >= 0.0 && most <= 1e-6
}

fn check(name: &str, field: &HeightField, texels: &[usize]) {
    let ratios = cone_map(field, ConeMode::Conservative, Progress::none()).unwrap();
    let w = field.width();
    let truth = |&at: &usize| (at, 1.0 / steepest(field, [at % w, at / w]));
    let truth: Vec<(usize, f64)> = texels.par_iter().map(truth).collect();
    let lost = given_away(&ratios, &truth, 0.0);
    println!("{name} {:?}: gives away {:.1e} to {:.1e}", field.wrap(), lost[0], lost[1]);
    assert!(is_exact(lost), "{name} {:?}: {lost:?}", field.wrap());
    // The check sees ratios that are off by a little more than it allows.
    assert!(
        !is_exact(given_away(&ratios, &truth, 1.1e-6)) && !is_exact(given_away(&ratios, &truth, -1.1e-6))
    );
}

/// Bends inside cells as well as between them.
fn product(w: usize, h: usize, wrap: Wrap) -> HeightField {
    from_fn(w, h, wrap, |i, j| 0.5 + 0.5 * (i as f32 * 0.3).sin() * (j as f32 * 0.2).cos())
}

#[test]
fn cones_are_those_of_brute_force() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for (w, h) in [(15, 11), (1, 9), (8, 1)] {
            let mut fields = maps(w, h, wrap);
            fields.push(("product", product(w, h, wrap)));
            for (name, field) in fields {
                let texels: Vec<usize> = (0..w * h).step_by(if w * h > 20 { 67 } else { 4 }).collect();
                check(name, &field, &texels);
            }
        }
    }
}

#[test]
#[ignore = "a minute: all pairs with 25 of 65536 texels"]
fn cones_of_256_texels_squared_are_those_of_brute_force() {
    let n = 256;
    let texels: Vec<usize> = (0..n * n).step_by(2711).collect();
    for (name, field) in [
        ("noise", noise(n, n, Wrap::Repeat, 9)),
        ("waves", waves(n, n, Wrap::Repeat)),
        ("product", product(n, n, Wrap::Clamp)),
    ] {
        check(name, &field, &texels);
    }
}

#[test]
#[ignore = "half a minute: the double loop over 65536 texels"]
fn texel_mode_of_256_texels_squared_is_the_double_loop() {
    let n = 256_i64;
    for field in [noise(256, 256, Wrap::Repeat, 9), waves(256, 256, Wrap::Repeat)] {
        let texels = field.texels();
        let found = cone_map(&field, ConeMode::Texel, Progress::none()).unwrap();
        let away: Vec<f64> = (0..n * n)
            .map(|at| [at % n, at / n].map(|a| ((a + n / 2) % n - n / 2) as f64 / n as f64))
            .map(|[u, v]| u.hypot(v))
            .collect();
        let worst = (0..(n * n) as usize)
            .into_par_iter()
            .map(|at| {
                let (i, j) = (at as i64 % n, at as i64 / n);
                let low = f64::from(texels[at]);
                let mut best = 1.0_f64;
                for (k, &texel) in texels.iter().enumerate() {
                    let rise = f64::from(texel) - low;
                    let (x, y) = ((k as i64 - i) & (n - 1), (k as i64 / n - j) & (n - 1));
                    if rise > 0.0 {
                        best = best.min(away[(y * n + x) as usize] / rise);
                    }
                }
                (best - f64::from(found[at])).abs()
            })
            .reduce(|| 0.0, f64::max);
        println!("largest difference: {worst:.1e}");
        assert!(worst <= 1e-6, "{worst}");
    }
}
