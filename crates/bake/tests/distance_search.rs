//! The search through a distance map, on baked maps, against the exact search in `f64`.

#![allow(clippy::unwrap_used, clippy::panic)]

mod cone_maps;

use bake::{Progress, distance_map, provide_for};
use cone_maps::{from_fn, light_faults, maps, rays, waves};
use heightfield::{
    DistanceMap, Extent, HeightField, HeightFieldError, MarchOptions, RayArray, Status, Technique, Wrap,
    march, oracle,
};

const RAYS: usize = 500;
const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];

fn ready(field: &HeightField) -> Technique {
    let technique = Technique::named("distance").unwrap();
    provide_for(field, technique.info.reads, Progress::none()).unwrap();
    technique
}

/// Rays whose first hit was skipped, seen from the surface between it and the hit reported; the largest
/// error of the others in heights; and the mean number of steps.
fn faults(field: &HeightField, technique: &Technique) -> (usize, f64, f64) {
    let (origins, directions) = rays(field, RAYS, 11);
    let options = MarchOptions::default();
    let (o, d) = (RayArray::F64(&origins), RayArray::F64(&directions));
    let hits = march(field, technique, o, d, &options).unwrap();
    let (t, status, steps) = (hits.t.unwrap(), hits.status.unwrap(), hits.steps.unwrap());
    let (mut missed, mut worst) = (0, 0.0_f64);
    for i in 0..RAYS {
        let at = |values: &[f64]| [values[3 * i], values[3 * i + 1], values[3 * i + 2]];
        let (origin, direction) = (at(&origins), at(&directions));
        let truth = oracle::exact(field, origin, direction);
        assert_eq!(truth.status, Status::Hit);
        let gap = |t: f64| {
            let place = |axis: usize| origin[axis] + t * direction[axis];
            place(2) - field.height_at(place(0), place(1))
        };
        let t = f64::from(t[i]);
        let between: Vec<f64> =
            (1..200).map(|k| gap(truth.t + (t - truth.t) * f64::from(k) / 200.0)).collect();
        let deepest = between.iter().copied().fold(0.0, f64::min);
        // A ray that only grazes a crest may pass it by rounding; one that goes below it may not.
        if status[i] != Status::Hit as u8 || t < truth.t - 1e-4 || (t > truth.t + 1e-4 && deepest < -1e-4) {
            missed += 1;
        } else {
            worst = worst.max(gap(t).abs());
        }
    }
    (missed, worst, steps.iter().map(|&n| f64::from(n)).sum::<f64>() / RAYS as f64)
}

#[test]
fn nothing_is_missed() {
    for (w, h) in [(64, 48), (33, 70), (1, 20), (17, 1), (1, 1)] {
        for wrap in WRAPS {
            for (name, field) in maps(w, h, wrap) {
                let (missed, worst, _) = faults(&field, &ready(&field));
                assert_eq!(missed, 0, "{name} {w}x{h} {wrap:?}");
                assert!(worst < 1e-3, "{name} {w}x{h} {wrap:?}: off by {worst} heights");
            }
        }
    }
}

#[test]
fn distances_that_are_no_bound_miss_and_the_check_sees_it() {
    let peaks = |i: usize, j: usize| if i.is_multiple_of(9) && j.is_multiple_of(7) { 1.0 } else { 0.0 };
    let extent = Extent { scale: 0.3, ..Extent::default() };
    let field = || from_fn(64, 64, Wrap::Repeat, peaks).with_extent(extent).unwrap();
    let wrong = field();
    let distances: Vec<f32> =
        distance_map(&wrong, 32, Progress::none()).unwrap().iter().map(|d| 2.0 * d + 0.05).collect();
    wrong.attach_distance_map(DistanceMap::new(&wrong, 32, &distances).unwrap());
    let (missed, ..) = faults(&wrong, &Technique::named("distance").unwrap());
    let right = field();
    assert!(missed > 10, "{missed}");
    assert_eq!(faults(&right, &ready(&right)).0, 0);
}

#[test]
fn balls_save_steps_on_smooth_ground() {
    let field = waves(256, 256, Wrap::Repeat);
    let (.., steps) = faults(&field, &ready(&field));
    // Without distances the search goes from cell to cell.
    let blind = waves(256, 256, Wrap::Repeat);
    blind.attach_distance_map(DistanceMap::new(&blind, 1, &[0.0; 256 * 256]).unwrap());
    let (missed, _, walked) = faults(&blind, &Technique::named("distance").unwrap());
    println!("steps a ray: cell by cell {walked:.1}, by distances {steps:.1}");
    assert!(missed == 0 && 1.5 * steps < walked, "{walked} cell by cell, {steps} by distances");
}

#[test]
fn light_is_blocked_where_the_surface_blocks_it() {
    for wrap in WRAPS {
        for (name, field) in maps(48, 40, wrap) {
            let technique = ready(&field);
            let differing = light_faults(&field, &technique, RAYS);
            // Rays along the surface go either way by rounding.
            assert!(differing <= 2, "{name} {wrap:?}: {differing} differ");
        }
    }
}

#[test]
fn without_its_map_a_search_is_an_error_that_names_it() {
    let field = waves(8, 8, Wrap::Repeat);
    let technique = Technique::named("distance").unwrap();
    let ray = RayArray::F64(&[0.5, 0.5, 1.0]);
    let error = march(&field, &technique, ray, ray, &MarchOptions::default()).unwrap_err();
    assert!(error.to_string().contains("distance"), "{error}");
    assert!(!matches!(error, HeightFieldError::Interrupted));
}
