//! Batches of rays: where results go, and what happens when a ray is unusable.

#![allow(clippy::unwrap_used)]

mod common;

use std::sync::atomic::AtomicBool;

use common::Random;
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

fn noise(wrap: Wrap) -> HeightField {
    let field = common::noise(61, 47, wrap, 3);
    common::attach_baked(&field);
    field
}

fn field() -> HeightField {
    noise(Wrap::Repeat)
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
fn rays_of_a_picture_find_what_each_row_finds() {
    // The last row is cut short, and neither side is a multiple of anything.
    let (width, rows, cut) = (203, 43, 11);
    let place = |i: usize| ((i % width) as f32 / 190.0, (i / width) as f32 / 190.0);
    let origins: Vec<f32> = (0..width * rows - cut).flat_map(|i| [place(i).0, place(i).1, 1.0]).collect();
    for slope in [[0.1, 0.05], [-1.5, 0.7]] {
        let directions: Vec<f32> = (0..origins.len() / 3)
            .flat_map(|i| if i % 97 == 5 { [0.3, 0.2, 0.1] } else { [slope[0] + place(i).0, slope[1], -1.0] })
            .collect();
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let (field, exact) = (noise(wrap), Technique::named("exact").unwrap());
            let find = |from: usize, to: usize| {
                let (o, d) = (&origins[3 * from..3 * to], &directions[3 * from..3 * to]);
                let outputs =
                    OutputSet::T | OutputSet::UV | OutputSet::Z | OutputSet::NORMAL | OutputSet::STATUS;
                let options = MarchOptions { outputs, ..MarchOptions::default() };
                march(&field, &exact, RayArray::F32(o), RayArray::F32(d), &options).unwrap()
            };
            let n = origins.len() / 3;
            let whole = find(0, n);
            for from in (0..n).step_by(width) {
                let to = (from + width).min(n);
                let row = find(from, to);
                let part =
                    |all: &Option<Vec<f32>>, k: usize| all.as_ref().map(|x| patterns(&x[k * from..k * to]));
                let same = |row: &Option<Vec<f32>>| row.as_ref().map(|x| patterns(x));
                assert_eq!(part(&whole.t, 1), same(&row.t), "{wrap:?} row {}", from / width);
                assert_eq!(part(&whole.uv, 2), same(&row.uv));
                assert_eq!(part(&whole.z, 1), same(&row.z));
                assert_eq!(part(&whole.normal, 3), same(&row.normal));
                assert_eq!(whole.status.as_ref().map(|x| &x[from..to]), row.status.as_deref());
            }
        }
    }
}

/// Numbers that can be compared even if they are not one.
fn patterns(values: &[f32]) -> Vec<u32> {
    values.iter().map(|x| x.to_bits()).collect()
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

/// Finite rays that overflow, underflow or never end once they are clipped and scaled.
fn hostile(at: usize) -> ([f32; 3], [f32; 3]) {
    let (huge, tiny) = (f32::MAX, f32::from_bits(1));
    let rays = [
        ([0.5, 0.5, huge], [1.0, 1.0, -tiny]),
        ([huge, -huge, 1.0], [huge, huge, -huge]),
        ([0.5, 0.5, 0.5], [huge, 0.0, 0.0]),
        ([0.5, 0.5, 1.0], [tiny, tiny, -tiny]),
        ([0.5, 0.5, 1.0], [0.0, -0.0, -huge]),
        ([0.5, 0.5, -huge], [0.1, 0.1, huge]),
        ([-0.0, tiny, 1.0], [huge, tiny, -1.0]),
        ([1e30, 1e-30, 1e30], [-1e30, 1e-30, -1e30]),
        ([0.3, 0.3, 0.999], [1.0, 1e-30, -1e-30]),
        ([0.5, 0.5, 2.0], [1.0, 1.0, 0.0]),
        ([0.5, 0.5, 1.0], [0.3, 0.2, huge]),
    ];
    rays[at % rays.len()]
}

/// Bits of everything a batch gives for some of its rays.
fn bits(
    field: &HeightField,
    technique: &Technique,
    rays: &(Vec<f32>, Vec<f32>),
    kept: &[usize],
) -> Vec<[u32; 9]> {
    let mut hits = Hits::new(rays.0.len() / 3, OutputSet::ALL);
    into(field, technique, rays, hits.as_mut()).unwrap();
    let places = [hits.t.unwrap(), hits.z.unwrap(), hits.uv.unwrap(), hits.normal.unwrap()];
    let (steps, status) = (hits.steps.unwrap(), hits.status.unwrap());
    kept.iter()
        .map(|&i| {
            let [t, z, uv, n] = &places;
            let floats = [t[i], z[i], uv[2 * i], uv[2 * i + 1], n[3 * i], n[3 * i + 1], n[3 * i + 2]];
            let [a, b, c, d, e, f, g] = floats.map(f32::to_bits);
            // Neighbours go through the exact search in bundles and share some of their steps.
            let steps = if technique.info.name == "exact" { 0 } else { steps[i] };
            [a, b, c, d, e, f, g, steps, u32::from(status[i])]
        })
        .collect()
}

#[test]
fn no_ray_depends_on_its_neighbours() {
    let n = 150;
    let (origins, directions) = rays();
    let all = (origins[..3 * n].to_vec(), directions[..3 * n].to_vec());
    let everyone: Vec<usize> = (0..n).collect();
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let field = noise(wrap);
        for info in Technique::all() {
            let technique = Technique::named(info.name).unwrap();
            let together = bits(&field, &technique, &all, &everyone);
            // In other company: batches of every length up to more than two packets of any width.
            let mut at = 0;
            let mut length = 1;
            while at < n {
                let to = (at + length).min(n);
                let part = (all.0[3 * at..3 * to].to_vec(), all.1[3 * at..3 * to].to_vec());
                let kept: Vec<usize> = (0..to - at).collect();
                assert_eq!(bits(&field, &technique, &part, &kept), together[at..to], "{} at {at}", info.name);
                (at, length) = (to, length % 40 + 1);
            }
            // Among rays that overflow and underflow, in every place of a packet.
            let mut mixed = (Vec::new(), Vec::new());
            let mut kept = Vec::new();
            for i in 0..n {
                for _ in 0..i % 4 {
                    let (o, d) = hostile(mixed.0.len() / 3);
                    mixed.0.extend(o);
                    mixed.1.extend(d);
                }
                kept.push(mixed.0.len() / 3);
                mixed.0.extend(&all.0[3 * i..3 * i + 3]);
                mixed.1.extend(&all.1[3 * i..3 * i + 3]);
            }
            let among = bits(&field, &technique, &mixed, &kept);
            let changed = among.iter().zip(&together).position(|(a, b)| a != b);
            assert_eq!(changed, None, "{} {wrap:?}", info.name);
        }
    }
}

#[test]
fn hostile_rays_end_and_give_numbers() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let field = noise(wrap);
        let rays: (Vec<_>, Vec<_>) = (0..88).map(hostile).unzip();
        let rays = (rays.0.concat(), rays.1.concat());
        for info in Technique::all() {
            let technique = Technique::named(info.name).unwrap();
            let mut hits = Hits::new(88, OutputSet::T | OutputSet::STATUS);
            into(&field, &technique, &rays, hits.as_mut()).unwrap();
            let (t, status) = (hits.t.unwrap(), hits.status.unwrap());
            for (i, (t, status)) in t.into_iter().zip(status).enumerate() {
                assert!(
                    !t.is_nan() && status <= 2,
                    "{} {wrap:?}, ray {:?}: {t} {status}",
                    info.name,
                    hostile(i)
                );
                assert!(t >= 0.0, "{} {wrap:?}, ray {:?}: {t}", info.name, hostile(i));
            }
        }
    }
}
