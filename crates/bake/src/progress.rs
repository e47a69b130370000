//! Progress reports and cancellation.

use crate::BakeError;

/// Tells a caller how far a bake is and lets the caller stop it.
///
/// The callback gets `(done, total)` in rows and answers whether to go on. It runs on the thread
/// that asked for the bake, between batches of rows, with `done` never falling; the last call has
/// `done == total`.
#[derive(Default)]
pub struct Progress<'a> {
    callback: Option<&'a mut dyn FnMut(usize, usize) -> bool>,
    last: (usize, usize),
}

impl<'a> Progress<'a> {
    /// Reports to `callback`, which returns `false` to stop.
    pub fn new(callback: &'a mut dyn FnMut(usize, usize) -> bool) -> Self {
        Self { callback: Some(callback), last: (0, 0) }
    }

    /// Reports to nobody.
    pub fn none() -> Self {
        Self::default()
    }

    /// Reports `done` of `total`.
    ///
    /// # Errors
    /// [`BakeError::Interrupted`] when the caller asked to stop.
    pub fn report(&mut self, done: usize, total: usize) -> Result<(), BakeError> {
        self.last = (done, total);
        let go_on = self.callback.as_mut().is_none_or(|callback| callback(done, total));
        if go_on { Ok(()) } else { Err(BakeError::Interrupted) }
    }

    /// Asks whether to go on, without having come further.
    ///
    /// # Errors
    /// [`BakeError::Interrupted`] when the caller asked to stop.
    pub fn check(&mut self) -> Result<(), BakeError> {
        let (done, total) = self.last;
        self.report(done, total)
    }
}
