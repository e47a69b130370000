//! The searches that step by cones, on baked maps, against the exact search in `f64`.

#![allow(clippy::unwrap_used, clippy::panic)]

mod cone_maps;

use bake::{Progress, provide_for};
use cone_maps::{light_faults, maps, noise, rays, waves};
use heightfield::{
    Extent, HeightField, HeightFieldError, Hits, MarchOptions, RayArray, Status, Technique, Wrap, march,
    oracle,
};

const RAYS: usize = 350;

fn ready(field: &HeightField, name: &str) -> Technique {
    let technique = Technique::named(name).unwrap();
    provide_for(field, technique.info.reads, Progress::none()).unwrap();
    technique
}

fn run(field: &HeightField, technique: &Technique, rays: &(Vec<f64>, Vec<f64>)) -> Hits {
    let options = MarchOptions::default();
    march(field, technique, RayArray::F64(&rays.0), RayArray::F64(&rays.1), &options).unwrap()
}

fn at(values: &[f64], i: usize) -> [f64; 3] {
    [values[3 * i], values[3 * i + 1], values[3 * i + 2]]
}

/// Rays that came out of the surface, by more than rounding, before the hit they report, or report none
/// or one in the air; and the largest error of the others in heights.
fn faults(field: &HeightField, technique: &Technique, rays: &(Vec<f64>, Vec<f64>)) -> (usize, f64) {
    let hits = run(field, technique, rays);
    let (t, status) = (hits.t.unwrap(), hits.status.unwrap());
    let mut wrong = 0;
    let mut worst = 0.0_f64;
    for i in 0..RAYS {
        let (origin, direction) = (at(&rays.0, i), at(&rays.1, i));
        let truth = oracle::exact(field, origin, direction);
        assert_eq!(truth.status, Status::Hit);
        if status[i] != Status::Hit as u8 {
            wrong += 1;
            continue;
        }
        let t = f64::from(t[i]);
        let gap = |t: f64| {
            let at = |axis: usize| origin[axis] + t * direction[axis];
            at(2) - field.height_at(at(0), at(1))
        };
        let late = t - truth.t;
        if late.abs() <= 1e-4 {
            worst = worst.max(gap(t).abs());
            continue;
        }
        let deepest = (1..50).map(|k| gap(truth.t + late * f64::from(k) / 50.0)).fold(0.0, f64::min);
        let out = (1..50).map(|k| gap(truth.t + late * f64::from(k) / 50.0)).fold(0.0, f64::max);
        if late < -1e-4 || (late > 1e-4 && deepest < -1e-4 && out > 1e-4) {
            wrong += 1;
        } else {
            worst = worst.max(gap(t).abs());
        }
    }
    (wrong, worst)
}

#[test]
fn nothing_is_missed_with_our_maps() {
    for (w, h) in [(40, 27), (1, 20), (17, 1), (1, 1)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for (name, field) in maps(w, h, wrap) {
                let rays = rays(&field, RAYS, 11);
                for search in ["cone", "relaxed_cone"] {
                    let (wrong, worst) = faults(&field, &ready(&field, search), &rays);
                    assert_eq!(wrong, 0, "{search} on {name} {w}x{h} {wrap:?}");
                    assert!(worst < 1e-3, "{search} on {name} {w}x{h} {wrap:?}: off by {worst} heights");
                }
            }
        }
    }
}

#[test]
fn published_maps_miss_and_the_check_sees_it() {
    let extent = Extent { scale: 0.3, ..Extent::default() };
    let field = noise(48, 48, Wrap::Repeat, 5).with_extent(extent).unwrap();
    let rays = rays(&field, RAYS, 2);
    for (search, least) in [("cone_texel", 2), ("relaxed_cone_texel", 2)] {
        let (wrong, _) = faults(&field, &ready(&field, search), &rays);
        println!("{search}: {wrong} of {RAYS}");
        assert!(wrong >= least, "{search} misses {wrong}");
    }
}

#[test]
fn cones_save_steps_on_smooth_ground() {
    let field = waves(128, 128, Wrap::Repeat);
    let rays = rays(&field, RAYS, 4);
    let steps = |name: &str| {
        let hits = run(&field, &ready(&field, name), &rays);
        hits.steps.unwrap().iter().map(|&n| f64::from(n)).sum::<f64>() / RAYS as f64
    };
    let (exact, cone, relaxed) = (steps("exact"), steps("cone"), steps("relaxed_cone"));
    println!("steps a ray: exact {exact:.1}, cone {cone:.1}, relaxed {relaxed:.1}");
    assert!(cone < exact && relaxed < cone, "exact {exact}, cone {cone}, relaxed {relaxed}");
}

#[test]
fn light_rays_are_blocked_where_the_surface_blocks_them() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for (name, field) in maps(30, 20, wrap) {
            for search in ["cone", "relaxed_cone"] {
                let technique = ready(&field, search);
                let differing = light_faults(&field, &technique, RAYS);
                // Rays along the surface go either way by rounding; measured: at most 1.
                assert!(differing <= 3, "{search} on {name} {wrap:?}: {differing} of {RAYS} differ");
            }
        }
    }
}

#[test]
fn rays_in_all_directions_end() {
    let field = noise(24, 24, Wrap::Repeat, 1);
    for search in ["cone", "relaxed_cone", "cone_texel", "relaxed_cone_texel"] {
        let technique = ready(&field, search);
        let origins = [[0.2, 0.3, 0.99], [0.2, 0.3, 0.0], [1e6, -1e6, 1.0], [0.5, 0.5, 0.5]];
        for origin in origins {
            for direction in [
                [1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0],
                [0.0, 0.0, -1.0],
                [1.0, 1.0, -1e-9],
                [1e-9, 0.0, 1.0],
                [-1.0, 0.3, 1e-30],
                [1e30, 0.0, -1.0],
            ] {
                let options = MarchOptions::default();
                let hits =
                    march(&field, &technique, RayArray::F64(&origin), RayArray::F64(&direction), &options)
                        .unwrap();
                assert!(!hits.t.unwrap()[0].is_nan(), "{search} {origin:?} {direction:?}");
            }
        }
    }
}

#[test]
fn maps_of_other_sizes_and_ratios_out_of_range_are_refused() {
    use heightfield::{ConeKind, ConeMap};
    let field = noise(4, 3, Wrap::Clamp, 1);
    let make = |ratios: &[f32]| ConeMap::new(&field, ConeKind::Cone, ratios).unwrap_err().to_string();
    assert!(make(&[0.5; 11]).contains("needs 12 values, got 11"), "{}", make(&[0.5; 11]));
    for bad in [f32::NAN, -0.1, 1.1, f32::INFINITY] {
        let mut ratios = [0.5; 12];
        ratios[6] = bad;
        assert!(make(&ratios).contains("row 1, column 2"), "{}", make(&ratios));
    }
}

#[test]
fn a_map_that_is_not_there_is_named() {
    let field = noise(8, 8, Wrap::Repeat, 1);
    let technique = Technique::named("relaxed_cone").unwrap();
    let ray = [0.0, 0.0, 1.0];
    let attempt = || {
        march(
            &field,
            &technique,
            RayArray::F64(&ray),
            RayArray::F64(&[0.0, 0.0, -1.0]),
            &MarchOptions::default(),
        )
    };
    let missing = HeightFieldError::MapMissing { technique: "relaxed_cone", map: "cone" };
    assert_eq!(attempt().unwrap_err(), missing);
    provide_for(&field, Technique::named("cone").unwrap().info.reads, Progress::none()).unwrap();
    let missing = HeightFieldError::MapMissing { technique: "relaxed_cone", map: "relaxed_cone" };
    assert_eq!(attempt().unwrap_err(), missing);
    provide_for(&field, technique.info.reads, Progress::none()).unwrap();
    assert!(attempt().is_ok());
}
