//! The time that one core spends on a task, whatever else the machine does meanwhile.

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::CompareError;

/// One thread to take times on.
///
/// What is timed is the processor time of this thread: work of other programs, which takes cores away for a
/// while, and the number of cores do not count. Caches and clocks are shared still.
pub struct Core(ThreadPool);

impl Core {
    /// Starts the thread.
    ///
    /// # Errors
    /// [`CompareError::Device`] when the system gives none.
    pub fn new() -> Result<Self, CompareError> {
        let pool = ThreadPoolBuilder::new().num_threads(1).thread_name(|_| "bumpwgpu-timing".to_owned());
        pool.build().map(Self).map_err(|error| CompareError::Device(format!("no thread to time on: {error}")))
    }

    /// Seconds that the task takes on the thread, with everything that it hands to rayon.
    ///
    /// # Errors
    /// That of the task.
    pub fn time<T: Send>(
        &self,
        task: impl FnOnce() -> Result<T, CompareError> + Send,
    ) -> Result<f64, CompareError> {
        self.0.install(|| {
            let start = thread_seconds();
            let result = task()?;
            let seconds = thread_seconds() - start;
            std::hint::black_box(&result);
            Ok(seconds)
        })
    }
}

/// Processor time of this thread so far.
#[cfg(unix)]
fn thread_seconds() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Time since the first call: what there is where no clock of a thread's own is at hand.
#[cfg(not(unix))]
fn thread_seconds() -> f64 {
    static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    START.elapsed().as_secs_f64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    fn spin(rounds: u64) -> u64 {
        (0..rounds).fold(1, |x: u64, k| std::hint::black_box(x.wrapping_mul(k | 1)))
    }

    #[test]
    fn all_parts_of_a_task_count() {
        let core = Core::new().unwrap();
        let of = |parts: u64| {
            let task = || Ok((0..parts).into_par_iter().map(|_| spin(300_000)).max());
            (0..5).map(|_| core.time(task).unwrap()).fold(f64::INFINITY, f64::min)
        };
        let quotient = of(8) / of(2);
        assert!((3.0..5.0).contains(&quotient), "{quotient}");
        let refused: Result<f64, _> = core.time(|| Err::<(), _>(CompareError::Interrupted));
        assert_eq!(refused, Err(CompareError::Interrupted));
    }

    #[cfg(unix)]
    #[test]
    fn time_that_passes_without_work_does_not_count() {
        let idle = Core::new().unwrap().time(|| {
            std::thread::sleep(std::time::Duration::from_millis(30));
            Ok(())
        });
        assert!(idle.unwrap() < 0.01);
    }
}
