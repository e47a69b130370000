//! What is left out changes nothing that anyone could see: pictures with and without, and the counts.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::shapes::{LIGHT, shapes};
use common::{field, ridges, sun};
use glam::{DVec3, Vec3};
use heightfield::technique::Reads;
use heightfield::{Extent, HeightField, Technique, Wrap};
use mesh::Mesh;
use render::{
    AovSet, Camera, Device, Draw, Frame, Light, Material, Request, Scene, SkipError, Skips, TechniqueChoice,
};

const SIZE: [u32; 2] = [128, 96];

/// Flat, with steps up and down: the ground of most of the things people make.
fn plateaus(u: f64, v: f64) -> f64 {
    let raised = (u * 3.0).fract() < 0.6 && (v * 2.0).fract() < 0.5;
    if raised { 1.0 } else { 0.25 }
}

fn waves(u: f64, v: f64) -> f64 {
    let wave = |x: f64| (std::f64::consts::TAU * x).sin();
    0.5 + 0.25 * wave(2.0 * u) * wave(v) + 0.1 * wave(u + 3.0 * v)
}

fn level(_: f64, _: f64) -> f64 {
    0.4
}

/// Rough at all scales.
fn rough(u: f64, v: f64) -> f64 {
    common::fbm(u, v)
}

type Heights = fn(f64, f64) -> f64;
const MAPS: [(&str, Heights); 5] =
    [("plateaus", plateaus), ("waves", waves), ("level", level), ("rough", rough), ("ridges", ridges)];

struct Case {
    name: String,
    mesh: Mesh,
    field: Arc<HeightField>,
    camera: Camera,
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (at, (map, heights)) in MAPS.into_iter().enumerate() {
        for (shape, mesh, texels, eye) in shapes() {
            for (far, distance) in [("near", 1.0_f64), ("middling", 5.0), ("far", 30.0)] {
                let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][(at + cases.len()) % 3];
                let wrap = if shape == "quad" || shape == "cube" { wrap } else { Wrap::Repeat };
                let extent = Extent { scale: 0.06, base: [1.0, 0.5][at % 2], tile_size: [1.0; 2] };
                // Far off, a narrow view keeps the picture full.
                let camera = Camera {
                    fov_y: 0.8 / distance.sqrt(),
                    ..Camera::look_at(DVec3::from(eye) * distance, DVec3::ZERO)
                };
                let mesh = mesh.clone();
                let field = Arc::new(field(heights, texels, wrap, extent));
                cases.push(Case { name: format!("{map} {shape} {far}"), mesh, field, camera });
            }
        }
    }
    cases
}

fn marching() -> impl Iterator<Item = Technique> {
    Technique::all()
        .iter()
        .filter(|info| !["parallax", "parallax_limited"].contains(&info.name))
        .map(|info| Technique::named(info.name).unwrap())
}

fn picture(device: &Device, case: &Case, choice: TechniqueChoice, skips: Skips, lights: &[Light]) -> Frame {
    let material = Material::new(Arc::clone(&case.field));
    let scene = Scene {
        draws: vec![Draw::new(&case.mesh, &material)],
        camera: case.camera,
        lights: lights.to_vec(),
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    let aovs = AovSet::UV | AovSet::MASK | AovSet::SKIP | AovSet::SHADOW | AovSet::HEIGHT;
    let request = Request { aovs, skips, ..Request::new(choice, SIZE[0], SIZE[1]) };
    render::render(device, &scene, &request).unwrap()
}

/// How the uv changes along the picture at a pixel, in texels, on the mesh itself; `None` at its edges.
fn footprint(flat: &Frame, texels: [f64; 2], at: usize) -> Option<[[f64; 2]; 2]> {
    let (width, mask) = (SIZE[0] as usize, flat.aovs.mask.as_ref().unwrap());
    let uv = flat.aovs.uv.as_ref().unwrap();
    if at < width || at + width >= mask.len() {
        return None;
    }
    let mut steps = [[0.0; 2]; 2];
    for (step, offset) in steps.iter_mut().zip([1, width]) {
        if mask[at - offset] == 0 || mask[at + offset] == 0 {
            return None;
        }
        for axis in 0..2 {
            let side = |at: usize| f64::from(uv[2 * at + axis]) * texels[axis];
            let (before, after) = (side(at) - side(at - offset), side(at + offset) - side(at));
            // An edge of a mesh, or a seam of its chart.
            if (before - after).abs() > 0.2 * (before.abs() + after.abs()) + 1e-3 {
                return None;
            }
            step[axis] = 0.5 * (before + after);
        }
    }
    Some(steps)
}

/// Texels and pixels between what two pictures show at a pixel.
fn apart(a: &Frame, b: &Frame, texels: [f64; 2], steps: [[f64; 2]; 2], at: usize) -> [f64; 2] {
    let [du, dv] = [0, 1].map(|axis| {
        let uv = |frame: &Frame| f64::from(frame.aovs.uv.as_ref().unwrap()[2 * at + axis]);
        (uv(a) - uv(b)) * texels[axis]
    });
    let [[xu, xv], [yu, yv]] = steps;
    let area = xu * yv - xv * yu;
    let pixels = ((du * yv - dv * yu) / area).hypot((dv * xu - du * xv) / area);
    [du.hypot(dv), if area == 0.0 { f64::INFINITY } else { pixels }]
}

/// Pixels at which the two differ by more than the bound, times `share`.
fn beyond(case: &Case, flat: &Frame, a: &Frame, b: &Frame, share: f64) -> usize {
    let texels = [case.field.width(), case.field.height()].map(|side| side as f64);
    let bound = SkipError::default();
    let mask = a.aovs.mask.as_ref().unwrap();
    (0..mask.len())
        .filter(|&at| mask[at] != 0)
        .filter(|&at| {
            let Some(steps) = footprint(flat, texels, at) else { return false };
            let [by_texels, by_pixels] = apart(a, b, texels, steps, at);
            // The mesh bends within a pixel, and 32 bits end somewhere.
            by_texels > share * f64::from(bound.texels) + 0.01
                && by_pixels > 1.1 * share * f64::from(bound.pixels)
        })
        .count()
}

/// Every how-manieth case the quick tests look at; coprime with the shapes, the distances and the maps.
const QUICK: usize = 7;
const QUICK_SEARCHES: [&str; 3] = ["exact", "relief", "steep"];

#[test]
fn what_is_seen_stays_within_the_bound() {
    within_the_bound(QUICK, |name| QUICK_SEARCHES.contains(&name));
}

#[test]
#[ignore = "every search on every case"]
fn what_is_seen_stays_within_the_bound_everywhere() {
    within_the_bound(1, |_| true);
}

fn within_the_bound(every: usize, wanted: impl Fn(&str) -> bool) {
    let Some(device) = common::device() else { return };
    let mut skipped = render::Skipped::default();
    for case in cases().into_iter().step_by(every) {
        let flat = TechniqueChoice::named("flat").unwrap();
        let flat = picture(&device, &case, flat, Skips::NONE, &[sun(LIGHT)]);
        for technique in marching().filter(|technique| wanted(technique.info.name)) {
            let name = technique.info.name;
            let choice = TechniqueChoice::Search(technique);
            let plain = picture(&device, &case, choice, Skips::NONE, &[sun(LIGHT)]);
            let spared = picture(&device, &case, choice, Skips::ALL, &[sun(LIGHT)]);
            let off = beyond(&case, &flat, &plain, &spared, 1.0);
            assert_eq!(off, 0, "{name} on {}: pixels are off", case.name);
            for (kind, count) in spared.stats.skipped.iter() {
                skipped.add(Skips::named(kind).unwrap(), count);
            }
        }
    }
    for kind in [Skips::FLAT, Skips::PARALLAX, Skips::RANGE, Skips::SHADOW] {
        assert!(skipped.of(kind) > 0, "{kind:?}: nothing was left out");
    }
}

#[test]
fn a_wrong_bound_is_noticed() {
    let Some(device) = common::device() else { return };
    let case = cases().into_iter().find(|case| case.name == "rough quad near").unwrap();
    let exact = TechniqueChoice::named("exact").unwrap();
    let flat = picture(&device, &case, TechniqueChoice::named("flat").unwrap(), Skips::NONE, &[sun(LIGHT)]);
    let plain = picture(&device, &case, exact, Skips::NONE, &[sun(LIGHT)]);
    // Four times what is allowed.
    let material = Material::new(Arc::clone(&case.field));
    let scene = Scene {
        draws: vec![Draw::new(&case.mesh, &material)],
        camera: case.camera,
        lights: vec![sun(LIGHT)],
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    let skip_error = SkipError { texels: 0.5, pixels: 1.0 };
    let aovs = AovSet::UV | AovSet::MASK;
    let request = Request { aovs, skip_error, ..Request::new(exact, SIZE[0], SIZE[1]) };
    let loose = render::render(&device, &scene, &request).unwrap();
    assert!(beyond(&case, &flat, &plain, &loose, 1.0) > 60);
}

/// Without bounds to go by, rays cut short and rays left out must give the very same picture.
#[test]
fn range_and_shadow_change_no_pixel_of_searches_that_keep_their_samples() {
    same_pixels(QUICK, |name| QUICK_SEARCHES.contains(&name));
}

#[test]
#[ignore = "every search on every case"]
fn range_and_shadow_change_no_pixel_anywhere() {
    same_pixels(1, |_| true);
}

fn same_pixels(every: usize, wanted: impl Fn(&str) -> bool) {
    let Some(device) = common::device() else { return };
    let low = Light::Directional { direction: Vec3::new(-0.9, 0.3, -0.25), color: [1.0; 3], intensity: 0.7 };
    for case in cases().into_iter().step_by(every) {
        for technique in marching().filter(|technique| wanted(technique.info.name)) {
            let layered = technique.info.reads == Reads::Heights;
            let name = technique.info.name;
            let choice = TechniqueChoice::Search(technique);
            let lights = [sun(LIGHT), low];
            let plain = picture(&device, &case, choice, Skips::NONE, &lights);
            let spared = picture(&device, &case, choice, Skips::RANGE | Skips::SHADOW, &lights);
            let differing = |channels: usize, a: &[f32], b: &[f32], most: f32| {
                a.chunks(channels)
                    .zip(b.chunks(channels))
                    .filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > most))
                    .count()
            };
            let (a, b) = (plain.aovs.uv.as_ref().unwrap(), spared.aovs.uv.as_ref().unwrap());
            let off = differing(2, a, b, if layered { 0.0 } else { 2e-5 });
            assert_eq!(off, 0, "{name} on {}: hits differ", case.name);
            let (a, b) = (plain.aovs.shadow.as_ref().unwrap(), spared.aovs.shadow.as_ref().unwrap());
            let off = differing(1, a, b, 0.0);
            assert_eq!(off, 0, "{name} on {}: shadows differ", case.name);
        }
    }
}

#[test]
fn counts_are_what_the_output_shows_and_each_kind_can_be_switched_alone() {
    let Some(device) = common::device() else { return };
    let kinds = [Skips::FLAT, Skips::PARALLAX, Skips::RANGE];
    let back = Light::Directional { direction: Vec3::Z, color: [1.0; 3], intensity: 0.5 };
    let lights = [sun(LIGHT), back];
    for case in cases().into_iter().filter(|case| case.name.contains("plateaus quad")) {
        let mut counted = [Skips::NONE; 8].map(|_| 0);
        for (at, (name, only)) in Skips::NAMED.into_iter().enumerate() {
            let relief = TechniqueChoice::named("relief").unwrap();
            let frame = picture(&device, &case, relief, only, &lights);
            let codes = frame.aovs.skip.as_ref().unwrap();
            for (other, kind) in Skips::NAMED {
                let count = frame.stats.skipped.of(kind);
                assert!(other == name || count == 0, "only {name}, but {count} of {other}");
            }
            for kind in kinds {
                let shown = codes.iter().filter(|&&code| code & kind.bits() != 0).count();
                assert_eq!(frame.stats.skipped.of(kind), shown as u64, "{name} on {}", case.name);
            }
            let rays: u64 = codes.iter().map(|code| u64::from(code >> 16)).sum();
            assert_eq!(frame.stats.skipped.of(Skips::SHADOW), rays);
            assert_eq!(frame.stats.shadow_rays + rays, 2 * frame.stats.pixels_covered);
            counted[at] = frame.stats.skipped.of(only);
        }
        let none = picture(&device, &case, TechniqueChoice::named("relief").unwrap(), Skips::NONE, &lights);
        assert!(none.stats.skipped.iter().all(|(_, count)| count == 0));
        assert!(none.aovs.skip.unwrap().iter().all(|&code| code == 0));
        assert!(counted.iter().sum::<u64>() > 0, "{}", case.name);
    }
}

#[test]
fn relief_too_small_to_be_seen_is_not_compiled_into_the_draw() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    for (scale, eye, spared) in [(0.001, 20.0, true), (0.05, 2.0, false), (0.0, 2.0, true)] {
        let extent = Extent { scale, ..Extent::default() };
        let field = Arc::new(field(rough, [64, 64], Wrap::Repeat, extent));
        let camera = Camera { fov_y: 1.0 / eye, ..Camera::look_at(DVec3::new(0.0, 0.0, eye), DVec3::ZERO) };
        let case = Case { name: String::new(), mesh: mesh.clone(), field, camera };
        let steep = TechniqueChoice::named("steep").unwrap();
        let frame = picture(&device, &case, steep, Skips::ALL, &[sun(LIGHT)]);
        assert!(frame.stats.pixels_covered > 0, "{scale} from {eye}");
        assert_eq!(frame.stats.pixels_marched == 0, spared, "{scale} from {eye}: {:?}", frame.stats);
    }
}

#[test]
fn a_bound_that_is_none_is_refused() {
    let Some(device) = common::device() else { return };
    let scene = Scene {
        draws: Vec::new(),
        camera: common::front(),
        lights: Vec::new(),
        ambient: [0.0; 3],
        background: [0.0; 4],
    };
    for skip_error in [SkipError { texels: -1.0, pixels: 0.0 }, SkipError { texels: 0.0, pixels: f32::NAN }] {
        let request = Request { skip_error, ..Request::new(TechniqueChoice::named("exact").unwrap(), 8, 8) };
        let error = render::render(&device, &scene, &request).unwrap_err();
        assert!(error.to_string().contains("skip_error"), "{error}");
    }
}
