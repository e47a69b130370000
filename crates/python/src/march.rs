//! Marching batches of rays, and the registry of techniques.

use heightfield::{Hits, MarchOptions, OutputSet, RayArray, Technique};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::Raise;
use crate::field::Field;
use crate::run::run;

/// `(N, 3)` C-contiguous rays, float32 or float64, used where they lie.
#[derive(FromPyObject)]
pub enum Rays<'py> {
    /// Single precision.
    F32(PyReadonlyArray2<'py, f32>),
    /// Double precision, marched without rounding to single.
    F64(PyReadonlyArray2<'py, f64>),
}

impl Rays<'_> {
    fn view(&self, name: &str) -> PyResult<RayArray<'_>> {
        let (shape, rays) = match self {
            Self::F32(array) => (array.shape(), RayArray::F32(array.as_slice()?)),
            Self::F64(array) => (array.shape(), RayArray::F64(array.as_slice()?)),
        };
        if shape[1] != 3 {
            let (n, m) = (shape[0], shape[1]);
            return Err(PyValueError::new_err(format!("{name} must have shape (N, 3), got ({n}, {m})")));
        }
        Ok(rays)
    }
}

/// A technique from its name and parameter values.
pub fn parse_technique(name: &str, parameters: &[(String, f64)]) -> PyResult<Technique> {
    parameters
        .iter()
        .try_fold(Technique::named(name), |technique, (name, value)| Ok(technique?.with(name, *value)))
        .and_then(|technique| technique)
        .map_err(Raise::raise)
}

/// Everything known about each technique: shading ones first, then the registry of searches.
#[pyfunction]
pub fn techniques(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    let add = |name, summary, source, casts_shadows, marches, parameters: Vec<_>| {
        let entry = PyDict::new(py);
        entry.set_item("name", name)?;
        entry.set_item("summary", summary)?;
        entry.set_item("source", source)?;
        entry.set_item("casts_shadows", casts_shadows)?;
        entry.set_item("marches", marches)?;
        entry.set_item("parameters", parameters)?;
        list.append(entry)
    };
    for (name, summary) in render::PLAIN_TECHNIQUES {
        add(name, summary, "", false, false, Vec::new())?;
    }
    for info in Technique::all() {
        let parameters = info
            .parameters
            .iter()
            .map(|p| (p.name, p.summary, p.default as i64, p.min as i64, p.max as i64))
            .collect();
        add(info.name, info.summary, info.source, info.casts_shadows, true, parameters)?;
    }
    Ok(list)
}

/// The output set of these names; `ValueError` for an unknown one.
pub fn parse_outputs(names: &[String]) -> PyResult<OutputSet> {
    names.iter().try_fold(OutputSet::NONE, |set, name| match OutputSet::named(name) {
        Some(output) => Ok(set | output),
        None => Err(PyValueError::new_err(format!(
            "unknown output {name:?}; known: t, uv, z, normal, steps, status"
        ))),
    })
}

/// Hands the arrays over to NumPy without copying them.
pub fn hits_to_dict(py: Python<'_>, hits: Hits) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    let rows = |values: Vec<f32>, width: usize| {
        let n = values.len() / width;
        PyArray1::from_vec(py, values).reshape([n, width])
    };
    if let Some(t) = hits.t {
        dict.set_item("t", PyArray1::from_vec(py, t))?;
    }
    if let Some(uv) = hits.uv {
        dict.set_item("uv", rows(uv, 2)?)?;
    }
    if let Some(z) = hits.z {
        dict.set_item("z", PyArray1::from_vec(py, z))?;
    }
    if let Some(normal) = hits.normal {
        dict.set_item("normal", rows(normal, 3)?)?;
    }
    if let Some(steps) = hits.steps {
        dict.set_item("steps", PyArray1::from_vec(py, steps))?;
    }
    if let Some(status) = hits.status {
        dict.set_item("status", PyArray1::from_vec(py, status))?;
    }
    Ok(dict)
}

/// Marches on the CPU.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn march<'py>(
    py: Python<'py>,
    field: &Field,
    origins: Rays<'py>,
    directions: Rays<'py>,
    technique: &str,
    parameters: Vec<(String, f64)>,
    outputs: Vec<String>,
    from_surface: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let technique = parse_technique(technique, &parameters)?;
    let outputs = parse_outputs(&outputs)?;
    let field = field.shared();
    let (origins, directions) = (origins.view("origins")?, directions.view("directions")?);
    let hits = run(py, None, |task| {
        let options = MarchOptions { outputs, from_surface, cancel: Some(task.cancel_flag()) };
        heightfield::march(&field, &technique, origins, directions, &options)
    })?;
    hits_to_dict(py, hits)
}
