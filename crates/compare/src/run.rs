//! A whole comparison of one height map: settings by elevations, errors and times.

use std::sync::Arc;

use heightfield::{HeightField, Hits, MarchOptions, RayArray, Segment, Technique, march};
use rayon::prelude::*;

use crate::cached::{Truths, truths};
use crate::region::Region;
use crate::rounds::Rounds;
use crate::setting::Setting;
use crate::statistics::percentile;
use crate::stores::{Stores, device_march};
use crate::{CompareError, DeviceMarch, Metrics, RayErrors, Reference, Reported, Timing};

/// Most rays at one elevation: errors of all rays are kept until the end, for percentiles.
pub const MAX_RAYS: usize = 1 << 20;

/// Told what is done, the total, and a word about it; answers whether to go on.
pub type Tell<'a> = dyn FnMut(usize, usize, &str) -> bool + 'a;

/// What to compare, and how thoroughly.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Settings to try.
    pub settings: Vec<Setting>,
    /// View elevations in degrees, above 0 to 90, in mesh units.
    pub elevations_deg: Vec<f64>,
    /// Rays at each elevation.
    pub rays: usize,
    /// Timed repeats after one warm-up; fewer for settings that are beaten by far.
    pub repeats: usize,
    /// Fixes rays and lights.
    pub seed: u64,
}

/// One setting at one elevation, or at all of them.
#[derive(Debug, Clone)]
pub struct Row {
    /// The setting.
    pub setting: Setting,
    /// Elevation in degrees; `None` for all elevations together.
    pub elevation_deg: Option<f64>,
    /// How wrong it is.
    pub metrics: Metrics,
    /// How wrong it is in each region that has rays.
    pub regions: Vec<(Region, Metrics)>,
    /// Bytes of texture that it reads.
    pub memory_bytes: usize,
    /// Time a ray on one core of the CPU.
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
pub(crate) struct Cell {
    pub(crate) errors: RayErrors,
    device_uv: Vec<f32>,
    device_status: usize,
    /// Rays of a pass on the CPU; 0 before the first.
    pub(crate) pass_rays: usize,
    /// Seconds for all rays, of each round.
    pub(crate) cpu_seconds: Vec<f64>,
    pub(crate) device_seconds: Vec<f64>,
}

/// Compares all settings at all elevations.
///
/// The reference is found once for each elevation, and kept for the next comparison. Times are taken in turns
/// (see [`crate::rounds`]). The formats of maps are measured for what they do to errors; on the CPU all are
/// marched as 32-bit floats, so that a setting that differs from another in its formats alone takes over the
/// other's times.
///
/// Rows come setting by setting: one for each elevation, then one for all of them together.
///
/// # Errors
/// Senseless settings, a device that fails, or [`CompareError::Interrupted`].
pub fn compare(
    field: &HeightField,
    plan: &Plan,
    device: Option<&dyn DeviceMarch>,
    progress: &mut Tell<'_>,
) -> Result<Vec<Row>, CompareError> {
    compare_stored(&mut Stores::new(field), plan, device, progress)
}

/// [`compare`] with maps that were prepared before.
pub(crate) fn compare_stored(
    stores: &mut Stores<'_>,
    plan: &Plan,
    device: Option<&dyn DeviceMarch>,
    progress: &mut Tell<'_>,
) -> Result<Vec<Row>, CompareError> {
    plan.check()?;
    let (settings, elevations) = (plan.settings.len(), plan.elevations_deg.len());
    let timed: Vec<usize> = (0..settings).map(|at| times_of(&plan.settings, at)).collect();
    let own: Vec<usize> = (0..settings).filter(|&at| timed[at] == at).collect();
    let total = settings + elevations * (1 + settings + own.len() * plan.repeats);
    let mut done = 0;
    for setting in &plan.settings {
        let text = format!("maps of {setting}");
        stores.prepare(setting, &mut |_, _| progress(done, total, &text))?;
        done += 1;
    }
    let field = stores.original();
    let mut tell = |text: &str, step: usize| {
        let going = progress(done, total, text);
        done += step;
        if going { Ok(()) } else { Err(CompareError::Interrupted) }
    };
    let mut sets: Vec<Arc<Truths>> = Vec::with_capacity(elevations);
    let mut cells: Vec<Vec<Cell>> = (0..settings).map(|_| Vec::with_capacity(elevations)).collect();
    for &elevation in &plan.elevations_deg {
        tell(&format!("exact surface at {elevation} degrees"), 1)?;
        let (set, _) = truths(field, elevation, plan.rays, plan.seed)?;
        for (setting, row) in plan.settings.iter().zip(&mut cells) {
            tell(&format!("errors of {setting} at {elevation} degrees"), 1)?;
            row.push(measure(stores, setting, &set, device)?);
        }
        sets.push(set);
    }
    Rounds { stores, plan, sets: &sets, own: &own, device }.take(&mut cells, &mut tell)?;
    tell("done", 0)?;
    for (which, &from) in timed.iter().enumerate().filter(|(which, from)| which != *from) {
        let times: Vec<_> =
            cells[from].iter().map(|cell| (cell.cpu_seconds.clone(), cell.device_seconds.clone())).collect();
        for (cell, times) in cells[which].iter_mut().zip(times) {
            (cell.cpu_seconds, cell.device_seconds) = times;
        }
    }
    let mut rows = Vec::with_capacity(settings * (elevations + 1));
    for (setting, cells) in plan.settings.iter().zip(&cells) {
        let memory = setting.memory_bytes(stores.field(setting));
        for (cell, &elevation) in cells.iter().zip(&plan.elevations_deg) {
            rows.push(row(setting, Some(elevation), &[cell], plan.rays, memory)?);
        }
        rows.push(row(setting, None, &cells.iter().collect::<Vec<_>>(), plan.rays, memory)?);
    }
    Ok(rows)
}

/// Errors of one setting on seeded rays at some elevations together, without any timing: whether what was
/// found on some rays holds on others.
///
/// # Errors
/// As [`compare`].
pub fn verify(
    field: &HeightField,
    plan: &Plan,
    progress: &mut Tell<'_>,
) -> Result<Vec<Metrics>, CompareError> {
    plan.check()?;
    let mut stores = Stores::new(field);
    let total = plan.settings.len() * (1 + plan.elevations_deg.len());
    let mut done = 0;
    let mut all = Vec::with_capacity(plan.settings.len());
    for setting in &plan.settings {
        let text = format!("checking {setting}");
        stores.prepare(setting, &mut |_, _| progress(done, total, &text))?;
        done += 1;
        let mut parts = Vec::with_capacity(plan.elevations_deg.len());
        for &elevation in &plan.elevations_deg {
            if !progress(done, total, &text) {
                return Err(CompareError::Interrupted);
            }
            let (set, _) = truths(field, elevation, plan.rays, plan.seed)?;
            parts.push(measure(&stores, setting, &set, None)?.errors);
            done += 1;
        }
        all.push(Metrics::of(&parts.iter().collect::<Vec<_>>()));
    }
    Ok(all)
}

/// Whose times a setting has: its own, or those of the first that differs in formats alone.
fn times_of(settings: &[Setting], at: usize) -> usize {
    let technique = &settings[at].technique;
    let plain = settings.iter().position(|other| other.is_plain() && other.technique == *technique);
    plain.or_else(|| settings.iter().position(|other| other.technique == *technique)).unwrap_or(at)
}

impl Plan {
    fn check(&self) -> Result<(), CompareError> {
        let few = |name, count: usize, expected: &str| Err(CompareError::setting(name, count, expected));
        if self.settings.is_empty() {
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
pub(crate) fn measure(
    stores: &Stores<'_>,
    setting: &Setting,
    set: &Truths,
    device: Option<&dyn DeviceMarch>,
) -> Result<Cell, CompareError> {
    let (technique, field) = (&setting.technique, stores.field(setting));
    let (origins, directions) = (RayArray::F32(&set.rays.origins), RayArray::F32(&set.rays.directions));
    let hits = march(field, technique, origins, directions, &MarchOptions::default())?;
    let errors = RayErrors::measure(stores.original(), &set.rays, &set.reference, &reported(&hits))?;
    let mut cell = Cell { errors, ..Cell::default() };
    if technique.info.casts_shadows {
        cell.errors.shadows = Some(wrong_shadows(field, technique, &set.reference));
    }
    if let Some(device) = device {
        let (theirs, _) = device_march(device, stores, setting, &set.rays)?;
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

/// By region, shadow rays and how many of them a technique answers otherwise than the exact surface.
fn wrong_shadows(
    field: &HeightField,
    technique: &Technique,
    reference: &Reference,
) -> [(usize, usize); Region::ALL.len()] {
    let period = heightfield::march::period(field.wrap());
    let wrong: Vec<bool> = reference
        .shadows
        .par_iter()
        .map(|ray| {
            let cos_theta = field.extent().cos_theta(ray.direction);
            let occluded = Segment::clip(ray.origin, ray.direction, cos_theta, period)
                .is_some_and(|s| technique.occluded(field, s.start, s.delta, cos_theta));
            occluded != ray.occluded
        })
        .collect();
    let mut counts = [(0, 0); Region::ALL.len()];
    for (ray, wrong) in reference.shadows.iter().zip(wrong) {
        let (tested, bad) = &mut counts[reference.regions[ray.ray] as usize];
        *tested += 1;
        *bad += usize::from(wrong);
    }
    counts
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
    setting: &Setting,
    elevation_deg: Option<f64>,
    cells: &[&Cell],
    rays: usize,
    memory_bytes: usize,
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
    let regions = Region::ALL.map(|region| (region, Metrics::of_region(&errors, region)));
    Ok(Row {
        setting: *setting,
        elevation_deg,
        metrics: Metrics::of(&errors),
        regions: regions.into_iter().filter(|(_, metrics)| metrics.rays > 0).collect(),
        memory_bytes,
        cpu,
        device,
        device_difference,
    })
}
