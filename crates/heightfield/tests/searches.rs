//! The approximate searches against the oracle, closed forms and what their papers promise.

#![allow(clippy::unwrap_used)]

mod common;

use common::{Random, attach_baked, from_fn, waves};
use heightfield::{
    HeightField, HeightFieldError, Hits, MarchOptions, RayArray, Segment, Status, Technique, Wrap, march,
    oracle,
};

fn rays(n: usize, lateral: f64) -> (Vec<f64>, Vec<f64>) {
    let mut random = Random(11);
    let mut origins = Vec::new();
    let mut directions = Vec::new();
    for _ in 0..n {
        let azimuth = random.range(0.0, std::f64::consts::TAU);
        origins.extend([random.next(), random.next(), 1.0]);
        directions.extend([lateral * azimuth.cos(), lateral * azimuth.sin(), -1.0]);
    }
    (origins, directions)
}

fn run(field: &HeightField, technique: &Technique, origins: &[f64], directions: &[f64]) -> Hits {
    march(field, technique, RayArray::F64(origins), RayArray::F64(directions), &MarchOptions::default())
        .unwrap()
}

/// 99th percentile of |t - oracle t|; t is the drop, because directions have z = -1.
fn p99(field: &HeightField, technique: &Technique, origins: &[f64], directions: &[f64]) -> f64 {
    let t = run(field, technique, origins, directions).t.unwrap();
    let mut errors: Vec<f64> = t
        .iter()
        .enumerate()
        .map(|(i, &t)| {
            let o = [origins[3 * i], origins[3 * i + 1], origins[3 * i + 2]];
            let d = [directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]];
            (f64::from(t) - oracle::exact(field, o, d).t).abs()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() * 99 / 100]
}

#[test]
fn every_technique_is_right_on_flat_ground() {
    for level in [0.0, 0.25, 1.0] {
        for base in [0.0, 0.5, 1.0] {
            let extent = heightfield::Extent { base, ..Default::default() };
            let field = from_fn(8, 8, Wrap::Repeat, |_, _| level).with_extent(extent).unwrap();
            attach_baked(&field);
            let (origins, directions) = rays(200, 0.7);
            for info in Technique::all() {
                let technique = Technique::named(info.name).unwrap();
                let hits = run(&field, &technique, &origins, &directions);
                assert!(hits.status.unwrap().iter().all(|&s| s == Status::Hit as u8), "{}", info.name);
                let step = match info.name {
                    "steep" => 1.0 / 32.0,
                    "steep_linear" | "steep_exponential" => 1.0 / 8.0,
                    "binary" => 2e-5,
                    "relief" => 1.0 / 32.0 / 512.0 + 1e-6,
                    "parallax_limited" => 1.0,
                    _ => 2e-6,
                };
                for t in hits.t.unwrap() {
                    let error = (t - (1.0 - level)).abs();
                    assert!(error <= step, "{} at level {level}, base {base}: {error}", info.name);
                }
            }
        }
    }
}

#[test]
fn refinement_makes_the_bracket_smaller() {
    let field = waves(128, 128, Wrap::Repeat);
    let (origins, directions) = rays(4000, 0.2);
    let error = |technique: Technique| p99(&field, &technique, &origins, &directions);
    let steep = error(Technique::named("steep").unwrap());
    let relief = error(Technique::named("relief").unwrap());
    let pom = error(Technique::named("pom").unwrap());
    let interval = error(Technique::named("interval").unwrap().with("linear", 32.0).unwrap());
    assert!(steep < 1.0 / 32.0 + 1e-5 && steep > 1.0 / 64.0, "steep {steep}");
    assert!(relief < 1.0 / 32.0 / 256.0 + 1e-5, "relief {relief}");
    assert!(pom < steep / 20.0, "pom {pom}, steep {steep}");
    assert!(interval < pom / 5.0, "interval {interval}, pom {pom}");
}

#[test]
fn more_layers_miss_less_and_exact_misses_nothing() {
    // Walls three texels thick: thin against 16 layers, thick against 256.
    let field = from_fn(256, 256, Wrap::Repeat, |i, _| if i % 32 < 4 { 1.0 } else { 0.0 });
    let (origins, directions) = rays(4000, 1.0);
    let missed = |technique: Technique| {
        let t = run(&field, &technique, &origins, &directions).t.unwrap();
        (0..t.len())
            .filter(|&i| {
                let o = [origins[3 * i], origins[3 * i + 1], origins[3 * i + 2]];
                let d = [directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]];
                f64::from(t[i]) > oracle::exact(&field, o, d).t + 0.02
            })
            .count()
    };
    let relief = |n: f64| Technique::named("relief").unwrap().with("linear", n).unwrap();
    let (few, many) = (missed(relief(16.0)), missed(relief(256.0)));
    assert!(few > 400 && many < few / 4, "16 layers miss {few}, 256 miss {many} of 4000");
    assert!(missed(Technique::named("binary").unwrap()) > few / 2, "bisection alone misses thin ridges");
    assert_eq!(missed(Technique::named("exact").unwrap()), 0);
}

#[test]
fn one_step_techniques_follow_their_formulas() {
    let extent = heightfield::Extent { scale: 0.2, base: 0.6, tile_size: [2.0, 3.0] };
    let field = waves(64, 64, Wrap::Repeat).with_extent(extent).unwrap();
    let (origins, directions) = rays(500, 0.4);
    for limited in [false, true] {
        let technique = Technique::named(if limited { "parallax_limited" } else { "parallax" }).unwrap();
        let t = run(&field, &technique, &origins, &directions).t.unwrap();
        for (i, &t) in t.iter().enumerate() {
            let o = &origins[3 * i..3 * i + 3];
            let d = &directions[3 * i..3 * i + 3];
            let mesh = (o[0] + 0.4 * d[0], o[1] + 0.4 * d[1]);
            let offset = field.height_at(mesh.0, mesh.1) - 0.6;
            let view = [d[0] * 2.0, d[1] * 3.0, d[2] * 0.2];
            let cos = -view[2] / (view[0] * view[0] + view[1] * view[1] + view[2] * view[2]).sqrt();
            let expected = 1.0 - (0.6 + offset * if limited { cos } else { 1.0 });
            let expected = expected.max(0.0);
            assert!((f64::from(t) - expected).abs() < 1e-5, "{t} against {expected}");
        }
    }
}

#[test]
fn segments_end_on_floor_or_lid() {
    let clip = |o, d| Segment::clip(o, d, 1.0, 1.0);
    let s = clip([0.25, 0.5, 3.0], [0.5, 0.0, -2.0]).unwrap();
    assert_eq!((s.t_start, s.t_length, s.start.z, s.delta.z), (1.0, 0.5, 1.0, -1.0));
    assert_eq!((s.start.x, s.delta.x), (0.75, 0.25));
    let up = clip([0.0, 0.0, 0.5], [0.0, 1.0, 1.0]).unwrap();
    assert_eq!((up.t_length, up.delta.z, up.closed), (0.5, 0.5, true));
    assert!(clip([0.0, 0.0, 1.5], [1.0, 0.0, 0.0]).is_none());
    assert!(!clip([0.0, 0.0, 0.5], [2.0, 0.0, 0.0]).unwrap().closed);
    let far = clip([1e6 + 0.25, -0.25, 1.0], [0.0, 0.0, -1.0]).unwrap();
    assert_eq!((far.start.x, far.start.y), (0.25, 0.75));
}

#[test]
fn bad_rays_and_settings_are_refused_by_name() {
    let field = waves(8, 8, Wrap::Repeat);
    let exact = Technique::named("exact").unwrap();
    let attempt = |o: &[f64], d: &[f64]| {
        march(&field, &exact, RayArray::F64(o), RayArray::F64(d), &MarchOptions::default()).unwrap_err()
    };
    assert_eq!(
        attempt(&[0.0, 0.0, 1.0, f64::NAN, 0.0, 1.0], &[0.0, 0.0, -1.0, 0.0, 0.0, -1.0]),
        HeightFieldError::RayNotFinite { index: 1, what: "origin" }
    );
    assert_eq!(
        attempt(&[0.0; 3], &[f64::INFINITY, 0.0, 0.0]),
        HeightFieldError::RayNotFinite { index: 0, what: "direction" }
    );
    assert_eq!(attempt(&[0.0; 3], &[0.0; 3]), HeightFieldError::RayZeroDirection { index: 0 });
    assert_eq!(attempt(&[0.0; 6], &[1.0; 3]), HeightFieldError::RayCount { origins: 2, directions: 1 });
    assert!(matches!(Technique::named("steeep"), Err(HeightFieldError::UnknownTechnique { .. })));
    let relief = Technique::named("relief").unwrap();
    assert!(relief.with("linear", 0.0).is_err() && relief.with("linear", 1.5).is_err());
    assert!(relief.with("depth", 1.0).is_err());
    assert!(HeightField::new(&[0.5, f32::NAN], 2, 1, Wrap::Repeat).is_err());
    assert!(HeightField::new(&[0.5, 1.5], 2, 1, Wrap::Repeat).is_err());
    assert!(HeightField::new(&[], 0, 1, Wrap::Repeat).is_err());
}
