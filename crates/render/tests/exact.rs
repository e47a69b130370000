//! The exact search on the device against the `f64` oracle: rays of every kind, maps of every shape.
//!
//! Unlike the parity test this allows no share of wrong rays: a reported hit lies on the surface, and
//! before it the ray was never inside by more than rounding.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{Random, fbm, field, ridges};
use heightfield::march::period;
use heightfield::{Extent, HeightField, Segment, Status, Technique, Wrap, oracle};
use render::Device;

const RAYS: usize = 2000;
/// Height by which a ray may go through the surface unseen, and a hit lie off it; see [`Ray::tolerance`].
const TOUCH: f64 = 1e-6;
/// Points between true and reported hit that are looked at.
const SAMPLES: u32 = 256;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Steep,
    Shallow,
    BelowLid,
    UnderSurface,
    Rising,
    Level,
    AlongAxis,
    Vertical,
    AlongBorders,
    FarAway,
}

const KINDS: [Kind; 10] = [
    Kind::Steep,
    Kind::Shallow,
    Kind::BelowLid,
    Kind::UnderSurface,
    Kind::Rising,
    Kind::Level,
    Kind::AlongAxis,
    Kind::Vertical,
    Kind::AlongBorders,
    Kind::FarAway,
];

/// What the device is asked: rounded to `f32`, so that the oracle is asked the same.
struct Ray {
    origin: [f32; 3],
    direction: [f32; 3],
}

impl Ray {
    fn random(field: &HeightField, kind: Kind, random: &mut Random) -> Self {
        // Dyadic numbers keep their precision far away.
        let mut dyadic = |n: f64| (random.next() * n * 4096.0).floor() / 4096.0;
        let [mut u, mut v] = [dyadic(3.0) - 1.0, dyadic(3.0) - 1.0];
        let azimuth = random.between(0.0, std::f64::consts::TAU);
        let mut lateral = [0.02, 0.3, 1.0][(random.next() * 3.0) as usize];
        let mut along = [azimuth.cos(), azimuth.sin()];
        let (mut z, mut dz) = (1.0, -1.0);
        let surface = field.height_at(u, v);
        match kind {
            Kind::Steep => z = random.between(1.0, 1.4),
            Kind::Shallow => lateral = random.between(2.0, 20.0),
            Kind::BelowLid => z = surface + (1.0 - surface) * random.between(0.01, 1.0),
            Kind::UnderSurface => (z, dz) = (surface * random.next() - 0.01, random.between(-1.0, 1.0)),
            Kind::Rising => (z, dz) = (surface + (1.0 - surface) * random.next(), random.between(0.001, 0.5)),
            Kind::Level => (z, dz) = (surface + (1.0 - surface) * random.next(), 0.0),
            Kind::AlongAxis => {
                let sign = if random.next() < 0.5 { 1.0 } else { -1.0 };
                along = if random.next() < 0.5 { [sign, 0.0] } else { [0.0, sign] };
                dz = [-1.0, -0.05, 0.0, 0.3][(random.next() * 4.0) as usize];
                z = if dz < 0.0 { 1.0 } else { surface + (1.0 - surface) * random.next() };
            }
            Kind::Vertical => (lateral, dz) = (0.0, if random.next() < 0.5 { -1.0 } else { 1.0 }),
            Kind::AlongBorders => {
                let centre = |x: f64, n: usize| ((x * n as f64).floor() + 0.5) / n as f64;
                (u, v) = (centre(u, field.width()), centre(v, field.height()));
                let step = [[1.0, 0.0], [0.0, -1.0], [1.0, 1.0], [-1.0, 2.0]][(random.next() * 4.0) as usize];
                along = [step[0] / field.width() as f64, step[1] / field.height() as f64];
                lateral = random.between(0.1, 40.0).floor();
            }
            Kind::FarAway => (u, v) = (u + 1024.0, v - 2048.0),
        }
        Self {
            origin: [u as f32, v as f32, z as f32],
            direction: [(lateral * along[0]) as f32, (lateral * along[1]) as f32, dz as f32],
        }
    }

    /// The height that the ray gains over the surface when it moves by what `f32` positions may be off:
    /// two ulps of all cells that it crosses, at the steepest slope of the map.
    fn tolerance(&self, field: &HeightField, steepest: f64, t: f64) -> f64 {
        let cells = (f64::from(self.direction[0]) * t * field.width() as f64)
            .hypot(f64::from(self.direction[1]) * t * field.height() as f64)
            + (2 * field.width().max(field.height())) as f64;
        TOUCH + 2.0 * f64::from(f32::EPSILON) * cells * steepest
    }
}

fn maps() -> Vec<(String, HeightField)> {
    let mut maps = Vec::new();
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for size in [[64, 64], [75, 33], [1, 40], [40, 1], [1, 1], [100, 256]] {
            maps.push((format!("fbm {size:?} {wrap:?}"), field(fbm, size, wrap, Extent::default())));
        }
        maps.push((format!("ridges {wrap:?}"), field(ridges, [96, 96], wrap, Extent::default())));
        maps.push((format!("flat {wrap:?}"), field(|_, _| 0.4, [16, 16], wrap, Extent::default())));
        maps.push((format!("floor {wrap:?}"), field(|_, _| 0.0, [16, 8], wrap, Extent::default())));
    }
    maps
}

/// Greatest difference of neighbouring corners: the height a cell may rise.
fn steepest(field: &HeightField) -> f64 {
    let [nx, ny] = field.cells();
    let mut steepest = 0.0_f32;
    for j in 0..ny {
        for i in 0..nx {
            let [a, b, c, d] = field.cell(i, j);
            steepest = steepest.max((b - a).abs()).max((c - a).abs()).max((d - b).abs()).max((d - c).abs());
        }
    }
    f64::from(steepest)
}

/// Rays that a technique gets wrong on a map, of those whose truth is known, and one of them.
fn wrong(device: &Device, technique: &str, field: &HeightField, kind: Kind) -> (usize, usize, String) {
    let mut random = Random(kind as u64 + 1);
    let rays: Vec<Ray> = (0..RAYS).map(|_| Ray::random(field, kind, &mut random)).collect();
    let origins: Vec<f32> = rays.iter().flat_map(|ray| ray.origin).collect();
    let directions: Vec<f32> = rays.iter().flat_map(|ray| ray.direction).collect();
    let technique = Technique::named(technique).unwrap();
    let hits = render::march(device, field, &technique, &origins, &directions).unwrap().hits;
    let (t, status) = (hits.t.unwrap(), hits.status.unwrap());
    let steepest = steepest(field);
    let (mut wrong, mut example) = (0, String::new());
    let mut asked = 0;
    for (i, ray) in rays.iter().enumerate() {
        let (o, d) = (ray.origin.map(f64::from), ray.direction.map(f64::from));
        // The device is asked about the clipped segment, rounded to f32.
        let segment = Segment::clip(o, d, 1.0, period(field.wrap()));
        let (tau, truth, at) = match &segment {
            Some(segment) => {
                let (start, delta) = (segment.start.as_dvec3(), segment.delta.as_dvec3());
                let length = if segment.t_length > 0.0 { segment.t_length } else { 1.0 };
                let tau = (f64::from(t[i]) - segment.t_start) / length;
                let truth = oracle::exact(field, start.to_array(), delta.to_array());
                (tau, truth, Some((start, delta)))
            }
            None => (f64::INFINITY, oracle::exact(field, o, d), None),
        };
        // A level ray may cross the plane before it meets anything.
        if truth.status == Status::Unconverged || truth.t.is_finite() && truth.t > 50.0 {
            continue;
        }
        asked += 1;
        let gap = |tau: f64| {
            let point = at.map_or(glam::DVec3::Z, |(start, delta)| start + delta * tau);
            point.z - field.height_at(point.x, point.y)
        };
        let hit = status[i] == Status::Hit as u8;
        let expected = truth.status == Status::Hit;
        let reached = if hit { tau } else { 50.0_f64.min(truth.t + 2.0) };
        let mut fault = None;
        if hit && gap(tau) > ray.tolerance(field, steepest, f64::from(t[i])) + f64::from(f32::EPSILON) {
            fault = Some(format!("reported {} above the surface", gap(tau)));
        }
        if expected && reached > truth.t {
            let deepest = (0..=SAMPLES)
                .map(|k| -gap(truth.t + (reached - truth.t) * f64::from(k) / f64::from(SAMPLES)))
                .fold(0.0, f64::max);
            if deepest > ray.tolerance(field, steepest, truth.t) && (!hit || tau - truth.t > 1e-5) {
                fault = Some(format!("went {deepest} into the surface"));
            }
        }
        if !hit && !expected && status[i] != Status::Left as u8 {
            fault = Some("unconverged".to_owned());
        }
        if let Some(fault) = fault {
            wrong += 1;
            example = format!(
                "{:?} + t {:?}: truth {:?} at {}, got status {} at {tau}: {fault}",
                ray.origin, ray.direction, truth.status, truth.t, status[i]
            );
        }
    }
    (wrong, asked, example)
}

#[test]
fn rays_of_every_kind_hit_what_the_oracle_hits() {
    let Some(device) = common::device() else { return };
    let mut faults = Vec::new();
    for (name, field) in maps() {
        for kind in KINDS {
            let (wrong, asked, example) = wrong(&device, "exact", &field, kind);
            assert!(asked > RAYS / 2 || kind == Kind::Level, "{name} {kind:?}: {asked} rays asked");
            if wrong > 0 {
                faults.push(format!("{name} {kind:?}: {wrong} of {asked} rays, e.g. {example}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn a_search_that_skips_hits_would_be_noticed() {
    // Negative control: the same judge over a search that does miss.
    let Some(device) = common::device() else { return };
    let field = field(ridges, [96, 96], Wrap::Repeat, Extent::default());
    let (wrong, asked, _) = wrong(&device, "relief", &field, Kind::Shallow);
    assert!(wrong > asked / 50, "{wrong} of {asked}");
}
