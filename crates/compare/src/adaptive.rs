//! The settings worth measuring, found by measuring: a quick look at a few settings of each technique,
//! then at more of them around the Pareto front, and a thorough comparison of what is left.
//!
//! The quick look goes by errors and by work, the texture reads of a ray, which are the same on every machine
//! and in every run; only the thorough comparison goes by time. So the same settings are tried everywhere, and
//! fronts of two machines can be held against each other. Times follow work within a quarter for all searches
//! that read heights alone; bounds are wide enough for that and for other machines.
//!
//! What another setting beats by far in work *and* error is dropped after the quick look. The rays of the
//! quick look are not those of the comparison, so nothing is chosen for having been lucky.

use heightfield::HeightField;

use crate::cached::truths;
use crate::pareto::{Candidate, ERROR_FLOOR, contenders, front};
use crate::run::{Tell, compare_stored};
use crate::setting::{Format, Setting};
use crate::stores::Stores;
use crate::{CompareError, DeviceMarch, Plan, Row, Timing, sweep};

/// Most settings that get a quick look.
pub const MOST_TRIED: usize = 80;
/// About as many in smaller formats.
const MOST_STORED: usize = 20;
/// Parts that progress is told in.
const PARTS: usize = 1000;
/// Rounds of refinement around the front.
const ROUNDS: usize = 4;
/// Rays at each elevation of the quick look, at most.
const QUICK_RAYS: usize = 1024;
/// Quotient of work up to which either of two settings may turn out faster: a quarter that times are off from
/// work, on a machine where another quarter lies between them.
const SAME_WORK: f64 = 1.6;
/// A setting is dropped when one with at most this share of its work ...
const LESS_WORK: f64 = 0.5;
/// ... has at most this share of its error.
const BETTER: f64 = 0.8;
/// Texture reads that a search is worth besides its own: setting a ray up and writing its hit.
const SETUP_READS: f64 = 2.0;
/// Share of rays without a right hit above which a setting cannot be on the front.
const MOST_FAILING: f64 = 1e-3;

/// A setting that got a quick look and no more.
#[derive(Debug, Clone)]
pub struct Dropped {
    /// Which.
    pub setting: Setting,
    /// Time a ray of the quick look, nanoseconds.
    pub time_ns: f64,
    /// 99th percentile of its hit-uv error, texels.
    pub uv_error_p99_texels: f64,
    /// Share of rays without a right hit.
    pub failure_rate: f64,
}

/// Compares what is worth comparing; `plan.settings` are always among it, and are all there is to it when
/// `formats` is false and nothing better is near.
///
/// The settings of the plan, usually one for each technique, are never dropped. With `formats`, those on
/// the front are also tried with smaller texture formats.
///
/// # Errors
/// As [`crate::compare`].
pub fn compare_adaptively(
    field: &HeightField,
    plan: &Plan,
    device: Option<&dyn DeviceMarch>,
    progress: &mut Tell<'_>,
) -> Result<(Vec<Row>, Vec<Dropped>), CompareError> {
    let mut stores = Stores::new(field);
    let mut furthest = 0.0_f64;
    let mut tell = |share: f64, text: &str| {
        furthest = furthest.max(share);
        progress((furthest * PARTS as f64) as usize, PARTS, text)
    };
    let seed = plan.seed ^ 0x005e_ed0f_f1de_u64;
    let quick = Plan {
        settings: Vec::new(),
        rays: plan.rays.min(QUICK_RAYS),
        repeats: 1,
        seed,
        elevations_deg: plan.elevations_deg.clone(),
    };
    for &elevation in &quick.elevations_deg {
        truths(field, elevation, quick.rays, quick.seed)?;
    }
    let mut looks: Vec<Row> = Vec::new();
    let mut pending: Vec<Setting> = plan.settings.clone();
    for technique in sweep::first_settings()? {
        if !pending.contains(&technique.into()) {
            pending.push(technique.into());
        }
    }
    for _ in 0..=ROUNDS {
        pending.truncate(MOST_TRIED - looks.len());
        if pending.is_empty() {
            break;
        }
        look(&mut stores, &quick, &pending, device, &mut looks, &mut tell)?;
        pending = around_the_front(&looks);
    }
    let front = front(&candidates(&looks, MOST_FAILING));
    let on_front: Vec<Setting> =
        front.iter().map(|&at| looks[at].setting).filter(Setting::is_plain).collect();
    let mut stored = Vec::new();
    for setting in on_front {
        for format in [Format::R16Float, Format::R16Unorm, Format::R8Unorm] {
            stored.push(setting.stored(format, Format::R32Float));
            if setting.reads_cones() {
                stored.push(setting.stored(Format::R32Float, format));
            }
        }
    }
    look(&mut stores, &quick, &stored, device, &mut looks, &mut tell)?;

    let (kept, dropped): (Vec<usize>, Vec<usize>) =
        (0..looks.len()).partition(|&at| plan.settings.contains(&looks[at].setting) || !beaten(&looks, at));
    let settings = in_order(kept.iter().map(|&at| looks[at].setting).collect());
    let dropped = dropped.into_iter().map(|at| Dropped::of(&looks[at])).collect();
    let chosen = Plan { settings, ..plan.clone() };
    let rows = compare_stored(&mut stores, &chosen, device, &mut |done, total, text| {
        tell(0.5 + 0.5 * done as f64 / total as f64, text)
    })?;
    Ok((rows, dropped))
}

/// Measures settings on a few rays.
fn look(
    stores: &mut Stores<'_>,
    quick: &Plan,
    settings: &[Setting],
    device: Option<&dyn DeviceMarch>,
    looks: &mut Vec<Row>,
    tell: &mut dyn FnMut(f64, &str) -> bool,
) -> Result<(), CompareError> {
    if settings.is_empty() {
        return Ok(());
    }
    let plan = Plan { settings: settings.to_vec(), ..quick.clone() };
    let before = looks.len();
    let rows = compare_stored(stores, &plan, device, &mut |done, total, text| {
        let tried = before as f64 + settings.len() as f64 * done as f64 / total as f64;
        tell(0.5 * (tried / (MOST_TRIED + MOST_STORED) as f64).min(1.0), &format!("first look: {text}"))
    })?;
    looks.extend(rows.into_iter().filter(|row| row.elevation_deg.is_none()));
    Ok(())
}

/// Texture reads of a ray: a step reads the heights, and the map besides in a search that has one.
fn work(row: &Row) -> f64 {
    let reads = if row.setting.technique.info.reads.baked().is_empty() { 1.0 } else { 2.0 };
    SETUP_READS + reads * row.metrics.steps_mean
}

/// Settings by work in place of time.
fn candidates(looks: &[Row], allowed: f64) -> Vec<Candidate> {
    let spread = SAME_WORK.sqrt();
    let of = |row: &Row| {
        let work = work(row);
        Candidate {
            time: Timing { median_ns: work, low_ns: work / spread, high_ns: work * spread },
            error: row.metrics.uv_error_p99_texels,
            memory: row.memory_bytes as f64,
            eligible: row.metrics.failure_rate() <= allowed,
        }
    };
    looks.iter().map(of).collect()
}

/// Neighbours of the settings on the front or tied with it, and of those that would be but for a few failing
/// rays: more steps may mend that.
fn around_the_front(looks: &[Row]) -> Vec<Setting> {
    let tried: Vec<_> = looks.iter().map(|row| row.setting.technique).collect();
    let mut wanted = contenders(&candidates(looks, MOST_FAILING));
    wanted.extend(contenders(&candidates(looks, 20.0 * MOST_FAILING)));
    let mut found: Vec<Setting> = Vec::new();
    for at in wanted {
        for technique in sweep::neighbours(&tried[at], &tried) {
            if !found.contains(&technique.into()) {
                found.push(technique.into());
            }
        }
    }
    found
}

/// Whether another setting makes this one pointless by a margin that more rays will not overturn. A setting
/// in a smaller format is there for its memory, so only one that is as small counts against it.
fn beaten(looks: &[Row], at: usize) -> bool {
    let row = &looks[at];
    let fails = row.metrics.failure_rate();
    looks.iter().enumerate().any(|(other, than)| {
        if other == at || than.memory_bytes > row.memory_bytes && !row.setting.is_plain() {
            return false;
        }
        let (error, least) = (row.metrics.uv_error_p99_texels, than.metrics.uv_error_p99_texels);
        let technique = |row: &Row| row.setting.technique.info.name;
        let alike = technique(row) == technique(than) && row.setting.is_plain() && than.setting.is_plain();
        if alike && least.max(error) <= ERROR_FLOOR && work(than) < work(row) {
            // Nothing is left to be gained by the steps that it takes more.
            return true;
        }
        let quicker = work(than) <= LESS_WORK * work(row);
        let sounder = than.metrics.failure_rate() <= fails.max(MOST_FAILING);
        if quicker && sounder && least <= (BETTER * error).max(ERROR_FLOOR) {
            return true;
        }
        // The same technique in another format of the same size.
        let twin = than.setting.technique == row.setting.technique;
        let smaller = than.memory_bytes <= row.memory_bytes;
        !row.setting.is_plain() && twin && smaller && sounder && least <= BETTER * error
    })
}

/// Technique by technique as users see them, the parameters rising.
fn in_order(mut settings: Vec<Setting>) -> Vec<Setting> {
    let place = |setting: &Setting| {
        heightfield::Technique::all().iter().position(|info| info.name == setting.technique.info.name)
    };
    let key = |setting: &Setting| (setting.technique.values, setting.heights, setting.cones);
    settings.sort_by(|a, b| {
        let by_name = place(a).cmp(&place(b));
        by_name.then_with(|| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal))
    });
    settings
}

impl Dropped {
    fn of(row: &Row) -> Self {
        Self {
            setting: row.setting,
            time_ns: row.device.as_ref().unwrap_or(&row.cpu).median_ns,
            uv_error_p99_texels: row.metrics.uv_error_p99_texels,
            failure_rate: row.metrics.failure_rate(),
        }
    }
}
