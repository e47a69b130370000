//! What the extension runs on.

use pyo3::prelude::*;

/// Worker threads that heavy work is spread over.
#[pyfunction]
pub fn threads(py: Python<'_>) -> PyResult<usize> {
    crate::run::run(py, None, |_| Ok::<_, std::convert::Infallible>(rayon::current_num_threads()))
}

/// The widest vector instructions of the processor.
#[pyfunction]
pub fn simd_level() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if std::arch::is_x86_feature_detected!("avx512f") {
            return "avx512";
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            return "avx2";
        }
        if std::arch::is_x86_feature_detected!("sse4.2") {
            return "sse4.2";
        }
        "sse2"
    }
    #[cfg(target_arch = "aarch64")]
    {
        "neon"
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    {
        "none"
    }
}
