//! What can go wrong in a comparison.

use bake::BakeError;
use heightfield::HeightFieldError;
use thiserror::Error;

/// Errors of this crate.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// The map, a technique or a ray is not valid.
    #[error(transparent)]
    HeightField(#[from] HeightFieldError),
    /// A setting of the comparison makes no sense.
    #[error("{name} is {value}; {expected}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it should be.
        expected: String,
    },
    /// Arrays that belong together differ in length.
    #[error("{what}: expected {expected} values for {rays} rays, got {got}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Rays measured.
        rays: usize,
        /// Values needed.
        expected: usize,
        /// Values given.
        got: usize,
    },
    /// A map that a technique reads could not be baked.
    #[error("{0}")]
    Bake(String),
    /// The device could not march.
    #[error("device: {0}")]
    Device(String),
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
}

impl CompareError {
    pub(crate) fn setting(name: &'static str, value: impl ToString, expected: impl Into<String>) -> Self {
        Self::Setting { name, value: value.to_string(), expected: expected.into() }
    }
}

impl From<BakeError> for CompareError {
    fn from(error: BakeError) -> Self {
        match error {
            BakeError::HeightField(error) => Self::HeightField(error),
            BakeError::Interrupted => Self::Interrupted,
            error => Self::Bake(error.to_string()),
        }
    }
}
