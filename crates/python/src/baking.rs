//! Baking maps and saving them.

use std::path::PathBuf;

use bake::{BakeError, BakeOptions, Baked, Convention, FileFormat, Kernel, Layer, Map, Progress};
use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::field::Field;
use crate::run::run;

/// Names of the maps with what they hold, and of the slope kernels.
#[pyfunction]
pub fn bake_names() -> (Vec<(&'static str, &'static str)>, Vec<&'static str>) {
    let maps = Map::ALL.iter().map(|map| (map.name(), map.summary())).collect();
    (maps, Kernel::ALL.iter().map(|kernel| kernel.name()).collect())
}

/// Bakes one map: its layers as `(H, W, C)` arrays. Only a pyramid has more than one.
///
/// `progress(done, total)` counts rows from `first` to `first + height` of `total`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn bake_map<'py>(
    py: Python<'py>,
    field: &Field,
    map: &str,
    kernel: &str,
    convention: &str,
    progress: Option<&Bound<'py, PyAny>>,
    first: usize,
    total: usize,
) -> PyResult<Vec<Bound<'py, PyArray3<f32>>>> {
    let map = Map::named(map).map_err(Raise::raise)?;
    let options = BakeOptions {
        kernel: Kernel::named(kernel).map_err(Raise::raise)?,
        convention: Convention::named(convention).map_err(Raise::raise)?,
    };
    let field = field.shared();
    let baked = run(py, progress, |task| {
        let rows = field.height();
        let mut report = |done: usize, of: usize| task.advance(first + done * rows / of.max(1), total);
        bake::bake(&field, field.extent(), map, options, Progress::new(&mut report))
    })?;
    let channels = map.ranges().len();
    baked
        .layers
        .into_iter()
        .map(|layer| PyArray1::from_vec(py, layer.texels).reshape([layer.height, layer.width, channels]))
        .collect()
}

/// Writes the layers of a map into a folder and returns the files made.
#[pyfunction]
pub fn save_map(
    py: Python<'_>,
    map: &str,
    layers: Vec<PyReadonlyArray3<'_, f32>>,
    folder: PathBuf,
    prefix: &str,
    format: &str,
    bits: u8,
) -> PyResult<Vec<PathBuf>> {
    let map = Map::named(map).map_err(Raise::raise)?;
    let channels = map.ranges().len();
    let layers = layers
        .iter()
        .map(|array| match *array.shape() {
            [height, width, found] if found == channels => {
                Ok(Layer { width, height, texels: array.as_slice()?.to_vec() })
            }
            ref shape => Err(PyValueError::new_err(format!(
                "map {:?} must have shape (H, W, {channels}), got {shape:?}",
                map.name()
            ))),
        })
        .collect::<PyResult<_>>()?;
    let baked = Baked { map, layers };
    run(py, None, |_| match (format, bits) {
        ("exr", _) => bake::save(&baked, &folder, prefix, FileFormat::Exr),
        ("png", 16) => bake::save(&baked, &folder, prefix, FileFormat::Png16),
        ("png", _) => bake::save(&baked, &folder, prefix, FileFormat::Png8),
        _ => Err(BakeError::Unwritable {
            what: map.name().to_owned(),
            format: format.to_owned(),
            problem: "png and exr are written".to_owned(),
        }),
    })
}
