//! Batches of rays: where results go, and what happens when a ray is unusable.

#![allow(clippy::unwrap_used)]

mod common;

use std::sync::atomic::AtomicBool;

use common::{Random, noise};
use heightfield::{
    HeightField, HeightFieldError, Hits, HitsMut, MarchOptions, OutputSet, RayArray, Technique, Wrap, march,
    march_into,
};

/// More than two tasks' worth, and not a whole number of tasks.
const RAYS: usize = 10_007;

fn rays() -> (Vec<f32>, Vec<f32>) {
    let mut random = Random(21);
    let mut origins = Vec::new();
    let mut directions = Vec::new();
    for _ in 0..RAYS {
        origins.extend([random.next() as f32, random.next() as f32, 1.0]);
        directions.extend([random.range(-1.0, 1.0) as f32, random.range(-1.0, 1.0) as f32, -1.0]);
    }
    (origins, directions)
}

fn field() -> HeightField {
    noise(61, 47, Wrap::Repeat, 3)
}

fn into(
    field: &HeightField,
    technique: &Technique,
    (origins, directions): &(Vec<f32>, Vec<f32>),
    places: HitsMut<'_>,
) -> Result<(), HeightFieldError> {
    let options = MarchOptions::default();
    march_into(field, technique, RayArray::F32(origins), RayArray::F32(directions), &options, places)
}

#[test]
fn places_of_the_callers_get_what_march_returns() {
    let (field, rays) = (field(), rays());
    for info in Technique::all() {
        let technique = Technique::named(info.name).unwrap();
        let (o, d) = (RayArray::F32(&rays.0), RayArray::F32(&rays.1));
        let whole = march(&field, &technique, o, d, &MarchOptions::default()).unwrap();
        let mut hits = Hits::new(RAYS, OutputSet::ALL);
        into(&field, &technique, &rays, hits.as_mut()).unwrap();
        assert_eq!(hits, whole, "{}", info.name);
        let mut some = Hits::new(RAYS, OutputSet::Z | OutputSet::STATUS);
        into(&field, &technique, &rays, some.as_mut()).unwrap();
        assert_eq!((some.t, some.z, some.status), (None, whole.z, whole.status), "{}", info.name);
    }
}

#[test]
fn places_of_the_wrong_length_are_refused_and_left_alone() {
    let (field, rays) = (field(), rays());
    let exact = Technique::named("exact").unwrap();
    for (length, outputs) in [(RAYS - 1, OutputSet::ALL), (RAYS + 1, OutputSet::NORMAL)] {
        let mut hits = Hits::new(length, outputs);
        let error = into(&field, &exact, &rays, hits.as_mut()).unwrap_err();
        let (name, width) = if length < RAYS { ("t", 1) } else { ("normal", 3) };
        assert_eq!(
            error,
            HeightFieldError::OutputLength { name, expected: width * RAYS, got: width * length }
        );
        assert_eq!(hits, Hits::new(length, outputs));
    }
}

#[test]
fn the_first_ray_at_fault_is_named_wherever_it_lies() {
    let (field, (origins, directions)) = (field(), rays());
    for info in Technique::all() {
        let technique = Technique::named(info.name).unwrap();
        for first in [0, 1, 4095, 4096, 8191, RAYS - 1] {
            let mut directions = directions.clone();
            // Others after it, in its own task and in later ones, change nothing.
            for at in [first, (first + 1).min(RAYS - 1), RAYS - 1] {
                directions[3 * at + 1] = f32::NAN;
            }
            let (o, d) = (RayArray::F32(&origins), RayArray::F32(&directions));
            let error = march(&field, &technique, o, d, &MarchOptions::default()).unwrap_err();
            assert_eq!(error, HeightFieldError::RayNotFinite { index: first, what: "direction" });
        }
    }
}

#[test]
fn a_cancelled_batch_says_so() {
    let (field, rays) = (field(), rays());
    let exact = Technique::named("exact").unwrap();
    let cancel = AtomicBool::new(true);
    let options = MarchOptions { cancel: Some(&cancel), ..MarchOptions::default() };
    let error = march(&field, &exact, RayArray::F32(&rays.0), RayArray::F32(&rays.1), &options).unwrap_err();
    assert_eq!(error, HeightFieldError::Interrupted);
}
