//! Repairs: what people ask for when a map arrives damaged or of unknown make.
//!
//! * [`dequantise()`]: 8-bit stair steps to smooth heights.
//! * [`integrate()`]: heights from a normal map.
//! * [`check_normals`]: green channel, axes and lengths of normals, against heights if there are any.
//! * [`seam`]: whether a map tiles.

mod check;
mod dequantise;
mod evidence;
mod fourier;
mod grid;
mod integrate;
mod plate;
mod seams;

pub use check::{Axes, Check, Curl, Lengths, check_normals};
pub use dequantise::{dequantise, quantum};
pub use evidence::Against;
pub use integrate::{Derivative, Integrated, Reading, integrate};
pub use seams::{Seam, Verdict, seam};

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
