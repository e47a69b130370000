//! The one way heavy work leaves Python: without the GIL, interruptible, and never as a panic.
//!
//! The work runs on a thread pool of our own while the calling thread waits. The calling thread is
//! the only one that may run Python signal handlers, so it looks at them every [`POLL`]; it also
//! calls the user's progress callback, which therefore never runs on a foreign thread.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::Raise;
use crate::errors::classes::BumpError;

/// How often the calling thread looks at signals and progress.
const POLL: Duration = Duration::from_millis(50);

/// What the work and the waiting thread tell each other.
#[derive(Debug, Default)]
pub struct Task {
    cancel: AtomicBool,
    done: AtomicUsize,
    total: AtomicUsize,
}

impl Task {
    /// Set when the caller wants the work to stop.
    pub fn cancel_flag(&self) -> &AtomicBool {
        &self.cancel
    }

    /// Notes how far the work has come; returns whether to go on.
    pub fn advance(&self, done: usize, total: usize) -> bool {
        self.total.store(total, Ordering::Relaxed);
        self.done.store(done, Ordering::Relaxed);
        !self.cancel.load(Ordering::Relaxed)
    }

    /// Runs pending signal handlers and reports progress.
    fn poll(&self, py: Python<'_>, progress: Option<&Py<PyAny>>, reported: &mut usize) -> PyResult<()> {
        py.check_signals()?;
        let done = self.done.load(Ordering::Relaxed);
        if let Some(callback) = progress
            && done != *reported
        {
            *reported = done;
            callback.call1(py, (done, self.total.load(Ordering::Relaxed)))?;
        }
        Ok(())
    }
}

/// The last panic message, kept by the hook for the exception that replaces it.
static LAST_PANIC: Mutex<Option<String>> = Mutex::new(None);

/// Keeps panics off stderr: their message goes into the Python exception instead.
pub fn install_panic_hook() {
    std::panic::set_hook(Box::new(|info| {
        let payload = info.payload();
        let message = payload
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned())
            .or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "unknown cause".to_owned());
        let place = info.location().map_or_else(String::new, |at| format!(" ({}:{})", at.file(), at.line()));
        *LAST_PANIC.lock().unwrap_or_else(PoisonError::into_inner) = Some(format!("{message}{place}"));
    }));
}

fn panic_error() -> PyErr {
    let cause = LAST_PANIC.lock().unwrap_or_else(PoisonError::into_inner).take();
    let cause = cause.unwrap_or_else(|| "unknown cause".to_owned());
    BumpError::new_err(format!("internal error in bumpwgpu, please report it: {cause}"))
}

/// The pool of this process. The threads of a pool do not survive a fork, so a forked child builds
/// its own: a parent's pool would never run anything again.
fn pool() -> PyResult<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut slot = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((owner, pool)) = &*slot
        && *owner == process
    {
        return Ok(Arc::clone(pool));
    }
    let built = ThreadPoolBuilder::new()
        .stack_size(8 << 20)
        .thread_name(|at| format!("bumpwgpu-{at}"))
        .build()
        .map_err(|error| BumpError::new_err(format!("cannot start worker threads: {error}")))?;
    let built = Arc::new(built);
    if let Some(inherited) = slot.replace((process, Arc::clone(&built))) {
        std::mem::forget(inherited);
    }
    Ok(built)
}

/// Runs `work` without the GIL and returns its result or the Python exception it stands for.
///
/// `progress` is called as `progress(done, total)` on the calling thread. An exception from it or
/// from a signal handler (Ctrl-C) sets the cancel flag, waits for the work to stop, and is raised.
pub fn run<T, E, F>(py: Python<'_>, progress: Option<&Bound<'_, PyAny>>, work: F) -> PyResult<T>
where
    T: Send,
    E: Raise + Send,
    F: FnOnce(&Task) -> Result<T, E> + Send,
{
    let pool = pool()?;
    let progress = progress.map(|callback| callback.clone().unbind());
    let task = Task::default();
    let mut reported = 0;
    let mut outcome = None;
    let mut stopped: Option<PyErr> = None;
    py.detach(|| {
        pool.in_place_scope(|scope| {
            let (finish, finished) = sync_channel::<()>(1);
            let (slot, shared) = (&mut outcome, &task);
            scope.spawn(move |_| {
                *slot = Some(catch_unwind(AssertUnwindSafe(|| work(shared))));
                drop(finish);
            });
            while finished.recv_timeout(POLL) == Err(RecvTimeoutError::Timeout) {
                if stopped.is_none() {
                    stopped = Python::attach(|py| task.poll(py, progress.as_ref(), &mut reported)).err();
                    if stopped.is_some() {
                        task.cancel.store(true, Ordering::Relaxed);
                    }
                }
            }
        });
    });
    if let Some(error) = stopped {
        return Err(error);
    }
    match outcome {
        Some(Ok(Ok(value))) => {
            task.poll(py, progress.as_ref(), &mut reported)?;
            Ok(value)
        }
        Some(Ok(Err(error))) => Err(error.raise()),
        Some(Err(_)) | None => Err(panic_error()),
    }
}
