//! Times of many settings, taken so that they can be held against each other.
//!
//! Each round takes every setting once at every elevation, every other round backwards: a machine that slows
//! down is fair to all. A sample is the least of a few passes, which slow settings make over a part of the rays,
//! always the same. After [`SURE_ROUNDS`] a setting leaves that another one beats at every elevation, and by
//! far: more samples would only say so again.

use std::sync::Arc;

use crate::cached::Truths;
use crate::core_time::Core;
use crate::pareto::ERROR_FLOOR;
use crate::run::Cell;
use crate::stores::{Stores, device_march};
use crate::timing::{least_of_passes, time_cpu};
use crate::{CompareError, DeviceMarch, Metrics, Plan, RayErrors, Rays};

/// Rounds after which settings may leave.
const SURE_ROUNDS: usize = 2;
/// Quotient of the quickest time of a setting and the slowest of another by which it is beaten beyond doubt.
const FAR: f64 = 1.6;
/// Least rays of a pass.
const PASS_RAYS: usize = 1024;
/// A pass over more of them than that takes no longer than about this, seconds.
const PASS_SECONDS: f64 = 2e-3;
/// Share of rays without a right hit below which settings are equally sound.
const SOUND: f64 = 1e-3;

/// Hears what is being done and how many steps that were announced it stands for.
type Step<'a> = dyn FnMut(&str, usize) -> Result<(), CompareError> + 'a;

/// What takes part.
pub(crate) struct Rounds<'a, 'f> {
    pub stores: &'a Stores<'f>,
    pub plan: &'a Plan,
    /// Rays of each elevation.
    pub sets: &'a [Arc<Truths>],
    /// Indices of the settings that are timed themselves.
    pub own: &'a [usize],
    pub device: Option<&'a dyn DeviceMarch>,
}

/// What counts against time.
struct Standing {
    error: f64,
    failures: f64,
}

impl Rounds<'_, '_> {
    /// Fills in the times of the cells: setting by setting, elevation by elevation.
    pub fn take(&self, cells: &mut [Vec<Cell>], tell: &mut Step<'_>) -> Result<(), CompareError> {
        let core = Core::new()?;
        let standings: Vec<Vec<Standing>> = cells.iter().map(|cells| standings(cells)).collect();
        let mut left = self.own.to_vec();
        for round in 1..=self.plan.repeats {
            // Those that left count as done.
            let mut over = (self.own.len() - left.len()) * self.sets.len();
            for (at, set) in self.sets.iter().enumerate() {
                for &which in &left {
                    let text = format!(
                        "timing {}, round {round} of {}",
                        self.plan.settings[which], self.plan.repeats
                    );
                    tell(&text, 1 + std::mem::take(&mut over))?;
                    self.sample(&core, which, &set.rays, &mut cells[which][at])?;
                }
            }
            if round >= SURE_ROUNDS {
                let beaten =
                    |which: &usize| self.own.iter().any(|&by| self.beats(cells, &standings, by, *which));
                let kept: Vec<usize> = left.iter().copied().filter(|which| !beaten(which)).collect();
                left = kept;
            }
            left.reverse();
        }
        Ok(())
    }

    fn sample(&self, core: &Core, which: usize, rays: &Rays, cell: &mut Cell) -> Result<(), CompareError> {
        let setting = &self.plan.settings[which];
        let field = self.stores.field(setting);
        let time = |count: usize| time_cpu(core, field, &setting.technique, rays, count);
        if cell.pass_rays == 0 {
            let few = rays.len().min(PASS_RAYS);
            cell.pass_rays = pass_rays(rays.len(), time(few)? / few as f64);
        }
        let part = cell.pass_rays as f64 / rays.len() as f64;
        cell.cpu_seconds.push(least_of_passes(|| time(cell.pass_rays))? / part);
        if let Some(device) = self.device {
            let pass = || Ok(device_march(device, self.stores, setting, rays)?.1);
            cell.device_seconds.push(least_of_passes(pass)?);
        }
        Ok(())
    }

    /// Whether a setting is no less accurate than another and quicker by far, at every elevation and on every
    /// clock.
    fn beats(&self, cells: &[Vec<Cell>], standings: &[Vec<Standing>], by: usize, which: usize) -> bool {
        let far = |ours: &[f64], theirs: &[f64]| {
            let slowest = ours.iter().copied().fold(0.0, f64::max);
            theirs.iter().all(|time| FAR * slowest < *time)
        };
        let quicker = cells[by].iter().zip(&cells[which]).all(|(ours, theirs)| {
            far(&ours.cpu_seconds, &theirs.cpu_seconds)
                && (self.device.is_none() || far(&ours.device_seconds, &theirs.device_seconds))
        });
        quicker
            && standings[by].iter().zip(&standings[which]).all(|(ours, theirs)| {
                ours.error <= theirs.error.max(ERROR_FLOOR) && ours.failures <= theirs.failures.max(SOUND)
            })
    }
}

/// Rays of a pass: all, or a half of them, a quarter and so on, so that settings that take about as long mostly
/// march the same ones.
fn pass_rays(all: usize, seconds_per_ray: f64) -> usize {
    let mut count = all;
    while count / 2 >= PASS_RAYS && count as f64 * seconds_per_ray > PASS_SECONDS {
        count /= 2;
    }
    count
}

/// At each elevation, then over all of them.
fn standings(cells: &[Cell]) -> Vec<Standing> {
    let of = |errors: &[&RayErrors]| {
        let metrics = Metrics::of(errors);
        Standing { error: metrics.uv_error_p99_texels, failures: metrics.failure_rate() }
    };
    let all: Vec<&RayErrors> = cells.iter().map(|cell| &cell.errors).collect();
    all.iter().map(|&errors| of(&[errors])).chain([of(&all)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use heightfield::{HeightField, Technique, Wrap};

    #[test]
    fn slow_settings_march_a_part_of_the_rays() {
        assert_eq!(pass_rays(8192, 1e-8), 8192);
        assert_eq!(pass_rays(8192, 4e-7), 4096);
        assert_eq!(pass_rays(8192, 1e-3), 1024);
        assert_eq!(pass_rays(300, 1.0), 300);
        assert_eq!(pass_rays(3000, 1.0), 1500);
    }

    #[test]
    fn what_is_beaten_by_far_is_timed_twice_and_the_rest_each_round() {
        let texels: Vec<f32> = (0..64 * 64).map(|i| ((i * 7919) % 1009) as f32 / 1009.0).collect();
        let field = HeightField::new(&texels, 64, 64, Wrap::Repeat).unwrap();
        let with =
            |name: &str, steps: f64| Technique::named(name).unwrap().with("steps", steps).unwrap().into();
        let settings =
            vec![Technique::named("exact").unwrap().into(), with("steep", 1000.0), with("steep", 2.0)];
        let plan = Plan { settings, elevations_deg: vec![60.0, 40.0], rays: 2000, repeats: 5, seed: 1 };
        let sets: Vec<_> = plan
            .elevations_deg
            .iter()
            .map(|at| crate::cached::truths(&field, *at, 2000, 1).unwrap().0)
            .collect();
        let stores = Stores::new(&field);
        let mut cells: Vec<Vec<Cell>> = plan
            .settings
            .iter()
            .map(|setting| {
                sets.iter().map(|set| crate::run::measure(&stores, setting, set, None).unwrap()).collect()
            })
            .collect();
        let mut told = 0;
        let rounds = Rounds { stores: &stores, plan: &plan, sets: &sets, own: &[0, 1, 2], device: None };
        rounds
            .take(&mut cells, &mut |_, steps| {
                told += steps;
                Ok(())
            })
            .unwrap();
        let taken: Vec<usize> = cells.iter().map(|cells| cells[0].cpu_seconds.len()).collect();
        assert_eq!(
            taken,
            [5, 2, 5],
            "exact beats the slow one; the quick one is no less worth for its errors"
        );
        assert_eq!(told, 3 * 2 * 5);
    }
}
