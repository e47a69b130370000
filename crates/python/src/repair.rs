//! Repairs of height and normal maps, and what is wrong with them.

use bake::repair::{self, Against, Axes, Check, Curl, Derivative, Reading};
use bake::{BakeError, Convention, Progress};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::Raise;
use crate::field::{Field, parse_wrap};
use crate::run::run;

/// Names of what the slopes of a normal map may stand for.
#[pyfunction]
pub fn derivatives() -> Vec<&'static str> {
    Derivative::NAMES.to_vec()
}

/// The step between the levels of `(H, W)` heights, or None.
#[pyfunction]
pub fn quantum(py: Python<'_>, heights: PyReadonlyArray2<'_, f32>) -> PyResult<Option<f64>> {
    let texels = heights.as_slice()?;
    run(py, None, |_| Ok::<_, BakeError>(repair::quantum(texels)))
}

/// Smooth heights within half a quantum of the field's.
#[pyfunction]
pub fn dequantise<'py>(
    py: Python<'py>,
    field: &Field,
    quantum: f64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let field = field.shared();
    let smooth = run(py, progress, |task| {
        let mut report = |done, total| task.advance(done, total);
        repair::dequantise(&field, quantum, Progress::new(&mut report))
    })?;
    PyArray1::from_vec(py, smooth).reshape([field.height(), field.width()])
}

/// The seams of a map across x and y.
#[pyfunction]
pub fn seams<'py>(py: Python<'py>, field: &Field) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let field = field.shared();
    let found = run(py, None, |_| Ok::<_, BakeError>([0, 1].map(|axis| repair::seam(&field, axis))))?;
    found
        .iter()
        .map(|seam| {
            let entry = PyDict::new(py);
            entry.set_item("step", seam.step)?;
            entry.set_item("inner_step", seam.inner_step)?;
            entry.set_item("ratio", seam.ratio)?;
            entry.set_item("local", seam.local)?;
            entry.set_item("rank", seam.rank)?;
            entry.set_item("bend", seam.bend)?;
            entry.set_item("inner_bend", seam.inner_bend)?;
            entry.set_item("bend_ratio", seam.bend_ratio)?;
            entry.set_item("bend_rank", seam.bend_rank)?;
            entry.set_item("worst", seam.worst)?;
            entry.set_item("verdict", seam.verdict.name())?;
            Ok(entry)
        })
        .collect()
}

/// Heights of `(H, W, 3)` normals in 0..1, and a dictionary of scale and residuals.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn integrate_normals<'py>(
    py: Python<'py>,
    normals: PyReadonlyArray3<'py, f32>,
    convention: &str,
    wrap: &str,
    tile_size: [f32; 2],
    derivative: &str,
    steepest: f64,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyArray2<f32>>, Bound<'py, PyDict>)> {
    let reading = Reading {
        convention: Convention::named(convention).map_err(Raise::raise)?,
        wrap: parse_wrap(wrap)?,
        tile_size,
        derivative: Derivative::named(derivative).map_err(Raise::raise)?,
        steepest,
    };
    let [height, width] = [normals.shape()[0], normals.shape()[1]];
    let texels = normals.as_slice()?;
    let found = run(py, progress, |task| {
        let mut report = |done, total| task.advance(done, total);
        repair::integrate(texels, width, height, &reading, Progress::new(&mut report))
    })?;
    let about = PyDict::new(py);
    about.set_item("scale", found.scale)?;
    about.set_item("mean_slope", found.mean_slope)?;
    about.set_item("residual", found.residual)?;
    about.set_item("mean_error", found.mean_error)?;
    about.set_item("clipped", found.clipped)?;
    Ok((PyArray1::from_vec(py, found.heights).reshape([height, width])?, about))
}

/// What is known of `(H, W, 3)` normals as stored, and of the heights beside them.
#[pyfunction]
pub fn check_normals<'py>(
    py: Python<'py>,
    normals: PyReadonlyArray3<'py, f32>,
    wrap: &str,
    heights: Option<&Field>,
) -> PyResult<Bound<'py, PyDict>> {
    let wrap = parse_wrap(wrap)?;
    let heights = heights.map(Field::shared);
    let [height, width] = [normals.shape()[0], normals.shape()[1]];
    let texels = normals.as_slice()?;
    let check = run(py, None, |task| {
        let mut report = |done, total| task.advance(done, total);
        repair::check_normals(texels, width, height, wrap, heights.as_deref(), Progress::new(&mut report))
    })?;
    describe(py, &check)
}

fn describe<'py>(py: Python<'py>, check: &Check) -> PyResult<Bound<'py, PyDict>> {
    let entry = PyDict::new(py);
    let (axes, confidence) = check.axes().unzip();
    set_axes(&entry, axes)?;
    entry.set_item("confidence", confidence.unwrap_or(0.0))?;
    entry.set_item("mean_length", check.lengths.mean)?;
    entry.set_item("length_range", (check.lengths.least, check.lengths.most))?;
    entry.set_item("not_unit", check.lengths.off)?;
    entry.set_item("inward", check.lengths.inward)?;
    entry.set_item("curl", check.curl.map(|curl| curl_entry(py, &curl)).transpose()?)?;
    entry.set_item("heights", check.against.map(|with| against_entry(py, &with)).transpose()?)?;
    Ok(entry)
}

fn set_axes(entry: &Bound<'_, PyDict>, axes: Option<Axes>) -> PyResult<()> {
    entry.set_item("convention", axes.map(|axes| axes.convention.name()))?;
    entry.set_item("swapped", axes.map(|axes| axes.swapped))
}

fn curl_entry<'py>(py: Python<'py>, curl: &Curl) -> PyResult<Bound<'py, PyDict>> {
    let entry = PyDict::new(py);
    set_axes(&entry, Some(curl.best))?;
    entry.set_item("share", curl.share)?;
    entry.set_item("confidence", curl.confidence)?;
    entry.set_item("votes", curl.votes)?;
    entry.set_item("decides", curl.decides())?;
    Ok(entry)
}

fn against_entry<'py>(py: Python<'py>, with: &Against) -> PyResult<Bound<'py, PyDict>> {
    let entry = PyDict::new(py);
    set_axes(&entry, Some(with.best))?;
    entry.set_item("correlation", with.correlation)?;
    entry.set_item("inverted", with.inverted)?;
    entry.set_item("confidence", with.confidence)?;
    entry.set_item("decides", with.decides())?;
    entry.set_item("scale", with.scale)?;
    entry.set_item("mean_error", with.mean_error)?;
    entry.set_item("flat_error", with.flat_error)?;
    Ok(entry)
}
