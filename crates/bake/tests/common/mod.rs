//! Helpers of the integration tests.
#![allow(dead_code, missing_docs, clippy::unwrap_used)] // each test binary uses some of them

pub mod tiff;
pub mod walk;

use std::path::{Path, PathBuf};

use bake::{Image, read_image};

/// The root of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A file or folder of real test data, or `None`, said aloud, when the data is not there.
pub fn data(path: &str) -> Option<PathBuf> {
    let folder =
        std::env::var_os("BUMPWGPU_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from);
    let path = folder.join(path);
    if !path.exists() {
        eprintln!("skipped: {} is absent", path.display());
        return None;
    }
    Some(path)
}

/// An image of the real test data.
pub fn data_image(path: &str) -> Option<Image> {
    data(path).map(|path| read_image(&path).unwrap())
}

/// A repeatable noise in 0..1.
pub fn noise(n: usize, seed: u64) -> Vec<f32> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    (0..n)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1_u64 << 24) as f32
        })
        .collect()
}

/// Angle between two vectors, in degrees.
pub fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let length = |v: [f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    (dot / (length(a) * length(b))).clamp(-1.0, 1.0).acos().to_degrees()
}
