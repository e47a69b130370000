//! Time per ray: warmed up, repeated in turns, with its spread.

use std::time::Instant;

use heightfield::{HeightField, Hits, MarchOptions, OutputSet, RayArray, Technique, march};

use crate::core_time::Core;
use crate::{CompareError, Rays};

/// A device that can march, such as a GPU.
pub trait DeviceMarch {
    /// Marches the rays; returns the hits and the seconds that the device itself took.
    ///
    /// # Errors
    /// A message for the user.
    fn march(&self, field: &HeightField, technique: &Technique, rays: &Rays) -> Result<(Hits, f64), String>;
}

/// Quotient of two medians below which times are a tie however little they scatter: load, clocks, caches and
/// where code happens to lie move the quotient of two searches' times by that much from one machine to the next.
pub const LEAST_LEAD: f64 = 1.25;

/// One sample of a time is the least of passes, of which there are this many at least and at most. What else a
/// machine does only ever adds.
const PASSES: (usize, usize) = (2, 8);
/// No more passes begin after this long, seconds.
const SAMPLE_SECONDS: f64 = 2e-3;

/// Nanoseconds per ray over several repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Median.
    pub median_ns: f64,
    /// Least.
    pub low_ns: f64,
    /// Upper quartile.
    pub high_ns: f64,
}

impl Timing {
    /// Median, least and upper quartile of repeats; `None` without any.
    pub fn of(samples_ns: &[f64]) -> Option<Self> {
        let mut sorted = samples_ns.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |rank: f64| -> Option<f64> {
            let x = rank * (sorted.len().checked_sub(1)?) as f64;
            let (low, high) = (sorted.get(x.floor() as usize)?, sorted.get(x.ceil() as usize)?);
            Some(low + (high - low) * x.fract())
        };
        Some(Self { median_ns: at(0.5)?, low_ns: at(0.0)?, high_ns: at(0.75)? })
    }

    /// Whether this is faster beyond doubt: the ranges do not meet, and the medians as well as the least, to
    /// which a busy machine adds nothing, differ by more than [`LEAST_LEAD`]. Anything else is a tie.
    pub fn clearly_faster(&self, other: &Self) -> bool {
        let leads = |ours: f64, theirs: f64| ours * LEAST_LEAD < theirs;
        self.high_ns < other.low_ns
            && leads(self.median_ns, other.median_ns)
            && leads(self.low_ns, other.low_ns)
    }
}

/// The least of several passes; a pass says how long it took itself.
///
/// # Errors
/// That of the first pass that fails.
pub fn least_of_passes(mut pass: impl FnMut() -> Result<f64, CompareError>) -> Result<f64, CompareError> {
    let start = Instant::now();
    let mut least = pass()?;
    for done in 1..PASSES.1 {
        if done >= PASSES.0 && start.elapsed().as_secs_f64() > SAMPLE_SECONDS {
            break;
        }
        least = least.min(pass()?);
    }
    Ok(least)
}

/// Seconds that one core takes to find the hit positions of the first `count` rays.
///
/// # Errors
/// Whatever [`march`] refuses.
pub fn time_cpu(
    core: &Core,
    field: &HeightField,
    technique: &Technique,
    rays: &Rays,
    count: usize,
) -> Result<f64, CompareError> {
    let options = MarchOptions { outputs: OutputSet::UV, ..MarchOptions::default() };
    let some = 3 * count.min(rays.len());
    let (origins, directions) =
        (RayArray::F32(&rays.origins[..some]), RayArray::F32(&rays.directions[..some]));
    core.time(|| Ok(march(field, technique, origins, directions, &options)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slow_repeat_does_not_move_the_median() {
        let timing = Timing::of(&[5.0, 5.1, 900.0, 4.9, 5.0]).unwrap();
        assert_eq!(timing.median_ns, 5.0);
        assert!(timing.low_ns == 4.9 && timing.high_ns <= 5.1);
        assert!(Timing::of(&[]).is_none());
    }

    #[test]
    fn overlapping_spreads_are_a_tie() {
        let a = Timing::of(&[1.0, 2.0, 3.0]).unwrap();
        let b = Timing::of(&[2.0, 3.0, 4.0]).unwrap();
        let c = Timing::of(&[9.0, 9.1, 9.2]).unwrap();
        assert!(!a.clearly_faster(&b) && !b.clearly_faster(&a));
        assert!(a.clearly_faster(&c) && !c.clearly_faster(&a));
        let d = Timing::of(&[11.0, 11.01, 11.02]).unwrap();
        assert!(!c.clearly_faster(&d), "21 % is no lead");
        // The other one was disturbed most of the time, but not when it was left alone.
        let e = Timing { median_ns: 30.0, low_ns: 10.5, high_ns: 40.0 };
        assert!(!c.clearly_faster(&e) && a.clearly_faster(&e));
    }

    #[test]
    fn a_sample_is_the_least_of_passes_and_slow_ones_are_few() {
        // Something else took the processor during the first pass.
        let mut times = [5.0, 0.5e-3, 0.6e-3].into_iter().cycle();
        assert_eq!(least_of_passes(|| Ok(times.next().unwrap())).unwrap(), 0.5e-3);
        let mut passes = 0;
        let slow = least_of_passes(|| {
            passes += 1;
            std::thread::sleep(std::time::Duration::from_millis(2));
            Ok(7.0)
        });
        assert_eq!((slow.unwrap(), passes), (7.0, 2));
        let refused = least_of_passes(|| Err(CompareError::Interrupted));
        assert!(matches!(refused, Err(CompareError::Interrupted)));
    }
}
