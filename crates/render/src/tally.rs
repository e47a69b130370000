//! Counts of what is sent to the device and compiled, for `Stats`. Work for one picture is done on one thread, so that
//! a count for each thread tells pictures apart.

use std::cell::Cell;

/// What has been done on a thread so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Bytes of buffers and textures written.
    pub bytes: u64,
    /// Pipelines compiled.
    pub pipelines: u32,
}

thread_local! {
    static TALLY: Cell<Tally> = const { Cell::new(Tally { bytes: 0, pipelines: 0 }) };
}

/// Counts bytes written.
pub(crate) fn uploaded(bytes: u64) {
    TALLY.with(|tally| tally.set(Tally { bytes: tally.get().bytes + bytes, ..tally.get() }));
}

/// Counts a pipeline compiled.
pub(crate) fn compiled() {
    TALLY.with(|tally| tally.set(Tally { pipelines: tally.get().pipelines + 1, ..tally.get() }));
}

impl Tally {
    /// Of this thread.
    pub fn now() -> Self {
        TALLY.with(Cell::get)
    }
}
