//! A whole comparison of one height map: settings by elevations, errors and times.

use bake::Progress;
use heightfield::{BakedMap, HeightField, Hits, MarchOptions, RayArray, Segment, Technique, march};
use rayon::prelude::*;

use crate::metrics::percentile;
use crate::timing::time_cpu;
use crate::{CompareError, DeviceMarch, Metrics, RayErrors, Rays, Reference, Reported, Timing, rays};

/// Most rays at one elevation: errors of all rays are kept until the end, for percentiles.
pub const MAX_RAYS: usize = 1 << 20;

/// What to compare, and how thoroughly.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Settings to try.
    pub techniques: Vec<Technique>,
    /// View elevations in degrees, above 0 to 90, in mesh units.
    pub elevations_deg: Vec<f64>,
    /// Rays at each elevation.
    pub rays: usize,
    /// Timed repeats after one warm-up.
    pub repeats: usize,
    /// Fixes rays and lights.
    pub seed: u64,
}

/// One setting at one elevation, or at all of them.
#[derive(Debug, Clone)]
pub struct Row {
    /// The setting.
    pub technique: Technique,
    /// Elevation in degrees; `None` for all elevations together.
    pub elevation_deg: Option<f64>,
    /// How wrong it is.
    pub metrics: Metrics,
    /// Time a ray on the CPU, all cores.
    pub cpu: Timing,
    /// Time a ray on the device, if there is one.
    pub device: Option<Timing>,
    /// How far the device's answers lie from the CPU's.
    pub device_difference: Option<DeviceDifference>,
}

/// Device against CPU on the same rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceDifference {
    /// 99th percentile of the distance between both hits, texels.
    pub uv_p99_texels: f64,
    /// Share of rays that only one of the two reports as hit.
    pub status_rate: f64,
}

/// What is known of one setting at one elevation while the comparison runs.
#[derive(Default)]
struct Cell {
    errors: RayErrors,
    device_uv: Vec<f32>,
    device_status: usize,
    cpu_seconds: Vec<f64>,
    device_seconds: Vec<f64>,
}

/// Compares all settings at all elevations.
///
/// The reference is found once for each elevation. Times are taken in turns - repeat by repeat over
/// all settings - so that a machine that slows down is fair to all. `progress` gets what is done, the
/// total, and a word about it; when it returns `false` the comparison stops.
///
/// Rows come setting by setting: one for each elevation, then one for all of them together.
///
/// # Errors
/// Senseless settings, a device that fails, or [`CompareError::Interrupted`].
pub fn compare(
    field: &HeightField,
    plan: &Plan,
    device: Option<&dyn DeviceMarch>,
    progress: &mut dyn FnMut(usize, usize, &str) -> bool,
) -> Result<Vec<Row>, CompareError> {
    plan.check()?;
    let (settings, elevations) = (plan.techniques.len(), plan.elevations_deg.len());
    let maps = missing_maps(field, &plan.techniques);
    let total = maps.len() + elevations * (1 + settings * (1 + plan.repeats));
    let mut done = 0;
    for map in maps {
        let text = format!("baking map {:?}", map.name());
        bake::provide(field, map, Progress::new(&mut |_, _| progress(done, total, &text)))?;
        done += 1;
    }
    let mut tell = |text: &str, step: usize| {
        let going = progress(done, total, text);
        done += step;
        if going { Ok(()) } else { Err(CompareError::Interrupted) }
    };
    let lights = rays::lights(field.extent(), plan.seed);
    let mut sets = Vec::with_capacity(elevations);
    let mut cells: Vec<Vec<Cell>> = (0..settings).map(|_| Vec::with_capacity(elevations)).collect();
    for &elevation in &plan.elevations_deg {
        tell(&format!("exact surface at {elevation} degrees"), 1)?;
        let set = rays::planar(field, elevation, plan.rays, plan.seed)?;
        let reference = Reference::new(field, &set, &lights);
        for (technique, row) in plan.techniques.iter().zip(&mut cells) {
            tell(&format!("errors of {technique} at {elevation} degrees"), 1)?;
            row.push(measure(field, technique, &set, &reference, device)?);
        }
        sets.push(set);
    }
    for repeat in 1..=plan.repeats {
        for (at, set) in sets.iter().enumerate() {
            for (technique, row) in plan.techniques.iter().zip(&mut cells) {
                tell(&format!("timing {technique}, round {repeat} of {}", plan.repeats), 1)?;
                let cell = &mut row[at];
                cell.cpu_seconds.push(time_cpu(field, technique, set)?);
                if let Some(device) = device {
                    let (_, seconds) = device.march(field, technique, set).map_err(CompareError::Device)?;
                    cell.device_seconds.push(seconds);
                }
            }
        }
    }
    tell("done", 0)?;
    let mut rows = Vec::with_capacity(settings * (elevations + 1));
    for (technique, cells) in plan.techniques.iter().zip(&cells) {
        for (cell, &elevation) in cells.iter().zip(&plan.elevations_deg) {
            rows.push(row(technique, Some(elevation), &[cell], plan.rays)?);
        }
        rows.push(row(technique, None, &cells.iter().collect::<Vec<_>>(), plan.rays)?);
    }
    Ok(rows)
}

/// The baked maps that some technique reads and the field does not have, each once.
fn missing_maps(field: &HeightField, techniques: &[Technique]) -> Vec<BakedMap> {
    let mut maps = Vec::new();
    for &map in techniques.iter().flat_map(|technique| technique.info.reads.baked()) {
        if !field.has(map) && !maps.contains(&map) {
            maps.push(map);
        }
    }
    maps
}

impl Plan {
    fn check(&self) -> Result<(), CompareError> {
        let few = |name, count: usize, expected: &str| Err(CompareError::setting(name, count, expected));
        if self.techniques.is_empty() {
            return few("techniques", 0, "at least one is needed");
        }
        if self.elevations_deg.is_empty() {
            return few("elevations", 0, "at least one is needed");
        }
        if self.repeats == 0 {
            return few("repeats", 0, "at least one is needed to take a time");
        }
        if !(1..=MAX_RAYS).contains(&self.rays) {
            return few("rays", self.rays, &format!("it must be in 1..{MAX_RAYS}"));
        }
        Ok(())
    }
}

/// Errors of one setting on one set of rays; also warms CPU and device up for the timing.
fn measure(
    field: &HeightField,
    technique: &Technique,
    set: &Rays,
    reference: &Reference,
    device: Option<&dyn DeviceMarch>,
) -> Result<Cell, CompareError> {
    let hits = march(
        field,
        technique,
        RayArray::F32(&set.origins),
        RayArray::F32(&set.directions),
        &MarchOptions::default(),
    )?;
    let mut errors = RayErrors::measure(field, set, reference, &reported(&hits))?;
    if technique.info.casts_shadows {
        let wrong = wrong_shadows(field, technique, reference);
        errors.shadows = Some((reference.shadows.len(), wrong));
    }
    let mut cell = Cell { errors, ..Cell::default() };
    if let Some(device) = device {
        let (theirs, _) = device.march(field, technique, set).map_err(CompareError::Device)?;
        (cell.device_uv, cell.device_status) = differences(field, &hits, &theirs);
    }
    Ok(cell)
}

/// Hits of a march as something to measure. Outputs that are absent count as empty.
pub fn reported(hits: &Hits) -> Reported<'_> {
    Reported {
        uv: hits.uv.as_deref().unwrap_or_default(),
        z: hits.z.as_deref().unwrap_or_default(),
        t: hits.t.as_deref(),
        normal: hits.normal.as_deref(),
        status: hits.status.as_deref(),
        steps: hits.steps.as_deref(),
    }
}

/// Shadow rays that a technique answers otherwise than the exact surface.
fn wrong_shadows(field: &HeightField, technique: &Technique, reference: &Reference) -> usize {
    let period = heightfield::march::period(field.wrap());
    reference
        .shadows
        .par_iter()
        .filter(|ray| {
            let cos_theta = field.extent().cos_theta(ray.direction);
            let occluded = Segment::clip(ray.origin, ray.direction, cos_theta, period)
                .is_some_and(|s| technique.occluded(field, s.start, s.delta, cos_theta));
            occluded != ray.occluded
        })
        .count()
}

/// Distances in texels where both report a hit, and the number of rays where only one does.
fn differences(field: &HeightField, ours: &Hits, theirs: &Hits) -> (Vec<f32>, usize) {
    let (a, b) = (reported(ours), reported(theirs));
    let size = [field.width() as f32, field.height() as f32];
    let mut distances = Vec::new();
    let mut differing = 0;
    for (p, q) in a.uv.chunks_exact(2).zip(b.uv.chunks_exact(2)) {
        let hit = |uv: &[f32]| uv.iter().all(|x| x.is_finite());
        match (hit(p), hit(q)) {
            (true, true) => distances.push(((p[0] - q[0]) * size[0]).hypot((p[1] - q[1]) * size[1])),
            (false, false) => {}
            _ => differing += 1,
        }
    }
    (distances, differing)
}

fn row(
    technique: &Technique,
    elevation_deg: Option<f64>,
    cells: &[&Cell],
    rays: usize,
) -> Result<Row, CompareError> {
    let marched = rays * cells.len();
    let timing = |seconds: fn(&Cell) -> &Vec<f64>| {
        let repeats = cells.iter().map(|cell| seconds(cell).len()).min().unwrap_or(0);
        let samples: Vec<f64> = (0..repeats)
            .map(|at| cells.iter().map(|cell| seconds(cell)[at]).sum::<f64>() * 1e9 / marched as f64)
            .collect();
        Timing::of(&samples)
    };
    let errors: Vec<&RayErrors> = cells.iter().map(|cell| &cell.errors).collect();
    let device = timing(|cell| &cell.device_seconds);
    let device_difference = device.map(|_| {
        let mut uv: Vec<f32> = cells.iter().flat_map(|cell| cell.device_uv.iter().copied()).collect();
        let differing: usize = cells.iter().map(|cell| cell.device_status).sum();
        DeviceDifference {
            uv_p99_texels: percentile(&mut uv, 0.99),
            status_rate: differing as f64 / marched as f64,
        }
    });
    let cpu = timing(|cell| &cell.cpu_seconds)
        .ok_or_else(|| CompareError::setting("repeats", 0, "at least one is needed to take a time"))?;
    Ok(Row {
        technique: *technique,
        elevation_deg,
        metrics: Metrics::of(&errors),
        cpu,
        device,
        device_difference,
    })
}
