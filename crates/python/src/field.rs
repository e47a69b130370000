//! The height field as Python holds it, and the settings that travel with it.

use std::sync::Arc;

use heightfield::{Extent, HeightField, Wrap};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::run::run;

/// Heights with bilinear interpolation; shared, never changed.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu")]
pub struct Field {
    inner: Arc<HeightField>,
}

impl Field {
    /// The height field itself.
    pub fn shared(&self) -> Arc<HeightField> {
        Arc::clone(&self.inner)
    }
}

#[pymethods]
impl Field {
    /// Takes `(H, W)` float32 heights in 0..1 and `(scale, base, (tile width, tile height))`.
    #[new]
    fn new(
        py: Python<'_>,
        heights: PyReadonlyArray2<'_, f32>,
        wrap: &str,
        extent: (f32, f32, [f32; 2]),
    ) -> PyResult<Self> {
        let wrap = parse_wrap(wrap)?;
        let extent = Extent { scale: extent.0, base: extent.1, tile_size: extent.2 };
        let [height, width] = [heights.shape()[0], heights.shape()[1]];
        let texels = heights.as_slice()?;
        let inner = run(py, None, |_| HeightField::new(texels, width, height, wrap)?.with_extent(extent))?;
        Ok(Self { inner: Arc::new(inner) })
    }
}

/// The wrap mode of that name.
pub fn parse_wrap(wrap: &str) -> PyResult<Wrap> {
    match wrap {
        "repeat" => Ok(Wrap::Repeat),
        "clamp" => Ok(Wrap::Clamp),
        "mirror" => Ok(Wrap::Mirror),
        _ => Err(PyValueError::new_err(format!("wrap must be 'repeat', 'clamp' or 'mirror', got {wrap:?}"))),
    }
}
