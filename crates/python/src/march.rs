//! Marching batches of rays, and the registry of techniques.

use std::sync::atomic::{AtomicBool, Ordering};

use heightfield::technique::Reads;
use heightfield::{
    HeightField, HeightFieldError, Hits, HitsMut, MarchOptions, OutputSet, RayArray, Technique,
};
use numpy::ndarray::Dimension;
use numpy::{
    Element, PyArray, PyArray1, PyArrayMethods, PyReadonlyArray2, PyReadwriteArray, PyReadwriteArray1,
    PyReadwriteArray2, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::Raise;
use crate::field::Field;
use crate::run::{Task, run};

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
    for plain in &render::PLAIN_TECHNIQUES {
        add(plain.name, plain.summary, plain.source, plain.displaces, false, Vec::new())?;
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

/// Set from one Python thread to stop a march that another one waits for.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu")]
#[derive(Default)]
pub struct Cancel {
    flag: AtomicBool,
}

#[pymethods]
impl Cancel {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Asks the march to stop.
    fn set(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }
}

/// Arrays of the caller's that the results go to.
struct Places<'py> {
    t: Option<PyReadwriteArray1<'py, f32>>,
    uv: Option<PyReadwriteArray2<'py, f32>>,
    z: Option<PyReadwriteArray1<'py, f32>>,
    normal: Option<PyReadwriteArray2<'py, f32>>,
    steps: Option<PyReadwriteArray1<'py, u32>>,
    status: Option<PyReadwriteArray1<'py, u8>>,
}

impl<'py> Places<'py> {
    /// Borrows the arrays of a dict; each is C-contiguous and writable, and none overlaps another.
    fn borrow(out: &Bound<'py, PyDict>) -> PyResult<Self> {
        fn place<'py, T: Element, D: Dimension>(
            out: &Bound<'py, PyDict>,
            name: &str,
        ) -> PyResult<Option<PyReadwriteArray<'py, T, D>>> {
            let Some(value) = out.get_item(name)? else { return Ok(None) };
            let array = value.cast_into::<PyArray<T, D>>()?;
            let refuse =
                |error| PyValueError::new_err(format!("out[{name:?}] cannot be written to: {error}"));
            Ok(Some(array.try_readwrite().map_err(refuse)?))
        }
        Ok(Self {
            t: place(out, "t")?,
            uv: place(out, "uv")?,
            z: place(out, "z")?,
            normal: place(out, "normal")?,
            steps: place(out, "steps")?,
            status: place(out, "status")?,
        })
    }

    fn slices(&mut self) -> PyResult<HitsMut<'_>> {
        fn slice<'a, T: Element, D: Dimension>(
            array: &'a mut Option<PyReadwriteArray<'_, T, D>>,
        ) -> PyResult<Option<&'a mut [T]>> {
            Ok(array.as_mut().map(|array| array.as_slice_mut()).transpose()?)
        }
        Ok(HitsMut {
            t: slice(&mut self.t)?,
            uv: slice(&mut self.uv)?,
            z: slice(&mut self.z)?,
            normal: slice(&mut self.normal)?,
            steps: slice(&mut self.steps)?,
            status: slice(&mut self.status)?,
        })
    }
}

/// Names a ray by its place in the whole batch, of which these rays are the part from `first` on.
fn in_batch(error: HeightFieldError, first: usize) -> HeightFieldError {
    match error {
        HeightFieldError::RayNotFinite { index, what } => {
            HeightFieldError::RayNotFinite { index: index + first, what }
        }
        HeightFieldError::RayZeroDirection { index } => {
            HeightFieldError::RayZeroDirection { index: index + first }
        }
        other => other,
    }
}

/// Bakes the maps that a search reads, unless the field has them; can be interrupted.
pub fn provide(task: &Task, field: &HeightField, reads: Reads) -> Result<(), bake::BakeError> {
    bake::provide_for(field, reads, bake::Progress::new(&mut |done, total| task.advance(done, total)))
}

/// Marches on the CPU, into the arrays of `out`: output names to arrays of N rows.
///
/// `first` is the number of rays before these, for messages.
#[pyfunction]
#[pyo3(signature = (field, origins, directions, technique, parameters, out, from_surface, first=0, cancel=None))]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn march<'py>(
    py: Python<'py>,
    field: &Field,
    origins: Rays<'py>,
    directions: Rays<'py>,
    technique: &str,
    parameters: Vec<(String, f64)>,
    out: &Bound<'py, PyDict>,
    from_surface: bool,
    first: usize,
    cancel: Option<&Cancel>,
) -> PyResult<()> {
    let technique = parse_technique(technique, &parameters)?;
    let field = field.shared();
    let (origins, directions) = (origins.view("origins")?, directions.view("directions")?);
    let mut places = Places::borrow(out)?;
    let places = places.slices()?;
    let flag = cancel.map(|cancel| &cancel.flag);
    run(py, None, |task| {
        let cancel = Some(flag.unwrap_or(task.cancel_flag()));
        provide(task, &field, technique.info.reads)?;
        let options = MarchOptions { outputs: OutputSet::NONE, from_surface, cancel };
        heightfield::march_into(&field, &technique, origins, directions, &options, places)
            .map_err(|error| bake::BakeError::from(in_batch(error, first)))
    })
}
