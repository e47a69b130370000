//! Borrowed or shared.

use std::ops::Deref;
use std::sync::Arc;

/// Something that a scene borrows, or holds together with others so that it may outlive its maker.
#[derive(Debug)]
pub enum Held<'a, T> {
    /// Lives elsewhere.
    Borrowed(&'a T),
    /// Lives as long as anyone holds it.
    Shared(Arc<T>),
}

impl<T> Clone for Held<'_, T> {
    fn clone(&self) -> Self {
        match self {
            Self::Borrowed(held) => Self::Borrowed(held),
            Self::Shared(held) => Self::Shared(Arc::clone(held)),
        }
    }
}

impl<T> Deref for Held<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        match self {
            Self::Borrowed(held) => held,
            Self::Shared(held) => held,
        }
    }
}

impl<'a, T> From<&'a T> for Held<'a, T> {
    fn from(held: &'a T) -> Self {
        Self::Borrowed(held)
    }
}

impl<T> From<Arc<T>> for Held<'_, T> {
    fn from(held: Arc<T>) -> Self {
        Self::Shared(held)
    }
}
