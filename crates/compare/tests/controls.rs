//! The metrics must pass a right search and flag every broken one.

#![allow(clippy::unwrap_used)]
use compare::{Metrics, Plan, RayErrors, Rays, Reference, Reported, rays, sweep};
use heightfield::{Extent, HeightField, MarchOptions, RayArray, Technique, Wrap, march, oracle};

const SIDE: usize = 64;

/// Thin posts on a gentle swell: easy to skip.
fn posts() -> HeightField {
    let texels: Vec<f32> = (0..SIDE * SIDE)
        .map(|i| {
            let (x, y) = (i % SIDE, i / SIDE);
            let swell = 0.2 + 0.1 * (x as f32 * 0.2).sin() * (y as f32 * 0.2).cos();
            if x % 16 == 5 && y % 8 == 3 { 1.0 } else { swell }
        })
        .collect();
    let extent = Extent { scale: 0.1, base: 1.0, tile_size: [1.0, 1.0] };
    HeightField::new(&texels, SIDE, SIDE, Wrap::Repeat).unwrap().with_extent(extent).unwrap()
}

struct Answer {
    uv: Vec<f32>,
    z: Vec<f32>,
    t: Vec<f32>,
    normal: Vec<f32>,
}

/// Answers of a search given as ray number -> t.
fn answer(field: &HeightField, set: &Rays, search: impl Fn(usize) -> f64) -> Answer {
    let mut out = Answer { uv: vec![], z: vec![], t: vec![], normal: vec![] };
    for i in 0..set.len() {
        let t = search(i);
        let [u, v, z] = set.at(i, t);
        out.uv.extend([u as f32, v as f32]);
        out.z.push(z as f32);
        out.t.push(t as f32);
        out.normal.extend(heightfield::march::texture_space_normal(field.gradient_at(u, v)));
    }
    out
}

fn metrics(field: &HeightField, set: &Rays, reference: &Reference, answer: &Answer) -> Metrics {
    let reported = Reported {
        uv: &answer.uv,
        z: &answer.z,
        t: Some(&answer.t),
        normal: Some(&answer.normal),
        status: None,
        steps: None,
    };
    Metrics::of(&[&RayErrors::measure(field, set, reference, &reported).unwrap()])
}

fn set(field: &HeightField, elevation: f64) -> (Rays, Reference) {
    let set = rays::planar(field, elevation, 4000, 9).unwrap();
    let reference = Reference::new(field, &set, &rays::lights(field.extent(), 9));
    (set, reference)
}

/// What a right search is held to: the same figures that each broken one must exceed somewhere.
fn passes(m: &Metrics) -> bool {
    m.uv_error_p99_texels < 2e-3
        && m.depth_error_p99 < 1e-5
        && m.miss_rate == 0.0
        && m.false_hit_rate == 0.0
        && m.unconverged_rate == 0.0
        && m.nan_count == 0
}

#[test]
fn the_exact_search_passes_at_every_elevation() {
    let field = posts();
    for elevation in [90.0, 45.0, 20.0, 10.0, 5.0, 2.0] {
        let (set, reference) = set(&field, elevation);
        let exact = Technique::named("exact").unwrap();
        let hits = march(
            &field,
            &exact,
            RayArray::F32(&set.origins),
            RayArray::F32(&set.directions),
            &MarchOptions::default(),
        )
        .unwrap();
        let errors = RayErrors::measure(&field, &set, &reference, &compare::run::reported(&hits)).unwrap();
        let m = Metrics::of(&[&errors]);
        assert!(passes(&m), "{elevation}: {m:?}");
        assert!(m.normal_error_median_deg.unwrap() < 0.01, "{m:?}");
    }
}

#[test]
fn a_search_that_skips_a_cell_is_flagged() {
    let field = posts();
    let (set, reference) = set(&field, 10.0);
    let broken = answer(&field, &set, |i| {
        let truth = reference.truths[i];
        let [du, dv, _] = set.direction(i);
        let a_cell = 1.0 / (du.hypot(dv) * SIDE as f64);
        oracle::exact(&field, set.at(i, truth.t + 1.5 * a_cell), set.direction(i)).t + truth.t + 1.5 * a_cell
    });
    let m = metrics(&field, &set, &reference, &broken);
    assert!(m.miss_rate > 0.02, "{m:?}");
    assert!(!passes(&m));
}

#[test]
fn an_epsilon_nudge_is_flagged() {
    let field = posts();
    let (set, reference) = set(&field, 20.0);
    let broken = answer(&field, &set, |i| reference.truths[i].t + 1e-3);
    let m = metrics(&field, &set, &reference, &broken);
    assert!(!passes(&m) && m.uv_error_median_texels > 5e-3 && m.miss_rate < 0.02, "{m:?}");
}

#[test]
fn a_tenth_of_a_texel_is_flagged() {
    let field = posts();
    let (set, reference) = set(&field, 45.0);
    let mut broken = answer(&field, &set, |i| reference.truths[i].t);
    assert!(passes(&metrics(&field, &set, &reference, &broken)), "the answer itself is right");
    broken.uv.iter_mut().step_by(2).for_each(|u| *u += 0.1 / SIDE as f32);
    let m = metrics(&field, &set, &reference, &broken);
    assert!((m.uv_error_median_texels - 0.1).abs() < 1e-3, "{m:?}");
    assert!(!passes(&m));
}

#[test]
fn whole_tiles_are_no_error_but_the_wrong_axis_is() {
    let field = posts();
    let (set, reference) = set(&field, 45.0);
    let mut moved = answer(&field, &set, |i| reference.truths[i].t);
    moved.uv.iter_mut().for_each(|x| *x += 3.0);
    assert!(metrics(&field, &set, &reference, &moved).uv_error_p99_texels < 2e-3);
    moved.uv.chunks_exact_mut(2).for_each(|uv| uv.swap(0, 1));
    assert!(!passes(&metrics(&field, &set, &reference, &moved)));
}

#[test]
fn hits_in_the_air_and_nonsense_are_counted() {
    let field = posts();
    let (set, reference) = set(&field, 20.0);
    let early = answer(&field, &set, |i| 0.5 * reference.truths[i].t);
    assert!(metrics(&field, &set, &reference, &early).false_hit_rate > 0.9);
    let mut nan = answer(&field, &set, |i| reference.truths[i].t);
    nan.uv[6] = f32::NAN;
    nan.normal[9] = f32::INFINITY;
    let m = metrics(&field, &set, &reference, &nan);
    assert_eq!(m.nan_count, 1, "both belong to ray 3");
    let status: Vec<u8> = (0..set.len()).map(|i| (i % 4) as u8).map(|s| s.min(2)).collect();
    let reported =
        Reported { uv: &early.uv, z: &early.z, t: None, normal: None, status: Some(&status), steps: None };
    let m = Metrics::of(&[&RayErrors::measure(&field, &set, &reference, &reported).unwrap()]);
    assert!((m.unconverged_rate - 0.5).abs() < 1e-9 && (m.miss_rate - 0.25).abs() < 1e-9, "{m:?}");
    assert_eq!(m.normal_error_p99_deg, None);
}

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let field = posts();
    let (set, reference) = set(&field, 45.0);
    let reported = Reported { uv: &[0.0; 4], z: &[0.0; 2], t: None, normal: None, status: None, steps: None };
    assert!(RayErrors::measure(&field, &set, &reference, &reported).is_err());
}

#[test]
fn a_whole_comparison_ranks_as_it_must() {
    let field = posts();
    let plan = Plan {
        settings: [("steep", vec![("steps", 8.0)]), ("relief", vec![]), ("exact", vec![])]
            .iter()
            .map(|(name, parameters)| sweep::with_parameters(name, parameters).unwrap().into())
            .collect(),
        elevations_deg: vec![90.0, 10.0],
        rays: 3000,
        repeats: 2,
        seed: 4,
    };
    let mut calls = 0;
    let rows = compare::compare(&field, &plan, None, &mut |done, total, _| {
        calls += 1;
        assert!(done <= total);
        true
    })
    .unwrap();
    assert_eq!(rows.len(), 9);
    assert!(calls > 20);
    let all: Vec<_> = rows.iter().filter(|row| row.elevation_deg.is_none()).collect();
    assert!(all[0].metrics.miss_rate > 0.01, "eight layers jump posts: {:?}", all[0].metrics);
    assert!(all[0].metrics.uv_error_p99_texels > all[1].metrics.uv_error_p99_texels);
    assert!(passes(&all[2].metrics), "{:?}", all[2].metrics);
    assert!(all[2].metrics.shadow_error_rate.unwrap() < 2e-3, "{:?}", all[2].metrics);
    assert!(all.iter().all(|row| row.cpu.median_ns > 0.0 && row.device.is_none()));

    let stopped = compare::compare(&field, &plan, None, &mut |done, _, _| done < 3);
    assert_eq!(stopped.unwrap_err(), compare::CompareError::Interrupted);
    let nothing = Plan { settings: vec![], ..plan };
    assert!(compare::compare(&field, &nothing, None, &mut |_, _, _| true).is_err());
}

#[test]
fn a_picture_of_the_exact_search_is_right_everywhere() {
    let field = posts();
    let view = compare::picture::View::new(&field, [48, 36]).unwrap();
    let exact = view.picture(&field, &Technique::named("exact").unwrap()).unwrap();
    assert_eq!((exact.rgb.len(), exact.error_texels.len()), (48 * 36 * 3, 48 * 36));
    assert!(exact.error_texels.iter().all(|&e| e < 0.01));
    let flat = view.picture(&field, &Technique::named("parallax").unwrap()).unwrap();
    assert!(flat.error_texels.iter().any(|&e| e > 1.0));
    assert!(compare::picture::View::new(&field, [0, 36]).is_err());
}
