//! What the extension runs on.

use pyo3::prelude::*;

/// Worker threads that heavy work is spread over.
#[pyfunction]
pub fn threads(py: Python<'_>) -> PyResult<usize> {
    crate::run::run(py, None, |_| Ok::<_, std::convert::Infallible>(rayon::current_num_threads()))
}

/// The vector instructions that searches and bakes use: the best the processor has, or up to what `BUMPWGPU_SIMD`
/// allows.
#[pyfunction]
pub fn simd_level() -> &'static str {
    heightfield::lanes::Level::best().name()
}
