//! Image files as NumPy arrays.

use std::path::PathBuf;

use bake::{BakeError, Image, Samples};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2, PyReadonlyArrayDyn};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::run::run;

/// `(H, W, C)` samples, channel names, and what a reader of heights should know.
type Decoded<'py> = (Bound<'py, PyAny>, Vec<String>, Vec<String>);

fn decoded(py: Python<'_>, image: Image) -> PyResult<Decoded<'_>> {
    let shape = [image.height, image.width, image.channels];
    let samples = match image.samples {
        Samples::U8(samples) => PyArray1::from_vec(py, samples).reshape(shape)?.into_any(),
        Samples::U16(samples) => PyArray1::from_vec(py, samples).reshape(shape)?.into_any(),
        Samples::F32(samples) => PyArray1::from_vec(py, samples).reshape(shape)?.into_any(),
    };
    Ok((samples, image.names, image.warnings))
}

/// Reads an image file.
#[pyfunction]
pub fn read_image(py: Python<'_>, path: PathBuf) -> PyResult<Decoded<'_>> {
    let image = run(py, None, |_| bake::read_image(&path))?;
    decoded(py, image)
}

/// Decodes an image file held in memory.
#[pyfunction]
pub fn decode_image<'py>(py: Python<'py>, data: &[u8]) -> PyResult<Decoded<'py>> {
    let image = run(py, None, |_| bake::decode_image(data))?;
    decoded(py, image)
}

/// The number of bits really present in C-contiguous samples.
#[pyfunction]
pub fn effective_bits(py: Python<'_>, samples: &Bound<'_, PyAny>) -> PyResult<u32> {
    let samples = if let Ok(array) = samples.extract::<PyReadonlyArrayDyn<'_, u8>>() {
        Samples::U8(array.as_slice()?.to_vec())
    } else if let Ok(array) = samples.extract::<PyReadonlyArrayDyn<'_, u16>>() {
        Samples::U16(array.as_slice()?.to_vec())
    } else if let Ok(array) = samples.extract::<PyReadonlyArrayDyn<'_, f32>>() {
        Samples::F32(array.as_slice()?.to_vec())
    } else {
        return Err(PyTypeError::new_err("samples must be uint8, uint16 or float32"));
    };
    run(py, None, |_| Ok::<_, BakeError>(bake::effective_bits(&samples)))
}

/// The smallest and the largest of C-contiguous floats; None when some are not finite.
#[pyfunction]
pub fn finite_span(py: Python<'_>, plane: PyReadonlyArray2<'_, f32>) -> PyResult<Option<(f32, f32)>> {
    let plane = plane.as_slice()?;
    run(py, None, |_| Ok::<_, BakeError>(bake::finite_span(plane)))
}
