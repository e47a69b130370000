//! Repairs: what people ask for when a map arrives damaged or of unknown make.
//!
//! * [`mod@dequantise`]: 8-bit stair steps to smooth heights.

mod dequantise;
mod grid;
mod plate;

pub use dequantise::{REACH, dequantise, quantum};

use crate::BakeError;
use crate::memory::available_memory;

/// Work below this many bytes always starts.
const SMALL: u128 = 1 << 28;

/// Makes sure that there is memory for some work.
fn require(what: &str, bytes: u128) -> Result<(), BakeError> {
    let available = available_memory().map_or(u128::from(u64::MAX), u128::from);
    if bytes > SMALL && bytes > available {
        return Err(BakeError::Memory { what: what.to_owned(), bytes, available });
    }
    Ok(())
}
