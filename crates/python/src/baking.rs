//! Baking maps and saving them.

use std::path::PathBuf;

use bake::encode::Range;
use bake::maps::REGISTRY;
use bake::{Baked, FileFormat, Form, Grid, Kind, Layer, Map, MapInfo, Options, Progress, Span, Value};
use heightfield::Wrap;
use numpy::{
    PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods, ndarray::IxDyn,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::Raise;
use crate::field::{Field, parse_wrap};
use crate::run::run;

/// Names and values of options; a boolean is looked for before numbers, which it also is.
#[derive(FromPyObject)]
pub enum Setting {
    /// True or False.
    Flag(bool),
    /// A whole number.
    Whole(i64),
    /// Any number.
    Number(f64),
    /// A name.
    Choice(String),
}

impl From<Setting> for Value {
    fn from(setting: Setting) -> Self {
        match setting {
            Setting::Flag(value) => Value::Flag(value),
            Setting::Whole(value) => Value::Whole(value),
            Setting::Number(value) => Value::Number(value),
            Setting::Choice(value) => Value::Choice(value),
        }
    }
}

fn parse_options(info: &MapInfo, settings: Vec<(String, Setting)>) -> PyResult<Options> {
    settings
        .into_iter()
        .try_fold(info.defaults(), |options, (name, value)| options.with(&name, value.into()))
        .map_err(Raise::raise)
}

/// Everything known about each map, from the registry.
#[pyfunction]
pub fn map_registry(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    for map in REGISTRY {
        list.append(describe(py, &map.info)?)?;
    }
    Ok(list)
}

pub(crate) fn describe<'py>(py: Python<'py>, info: &MapInfo) -> PyResult<Bound<'py, PyDict>> {
    let entry = PyDict::new(py);
    entry.set_item("name", info.name)?;
    entry.set_item("summary", info.summary)?;
    entry.set_item("source", info.source)?;
    entry.set_item("version", info.version)?;
    entry.set_item("costly", info.costly)?;
    let (form, axis) = match info.form {
        Form::Single => ("single", None),
        Form::Levels => ("levels", None),
        Form::Stack { axis } => ("stack", Some(axis)),
    };
    entry.set_item("form", form)?;
    entry.set_item("axis", axis)?;
    let channels: Vec<_> = info
        .channels
        .iter()
        .map(|channel| match channel.span {
            Span::Fixed(Range { low, high, rounding }) => (channel.name, Some((low, high)), rounding.name()),
            Span::Found(rounding) => (channel.name, None, rounding.name()),
        })
        .collect();
    entry.set_item("channels", channels)?;
    let options = PyList::empty(py);
    for option in info.options {
        let about = PyDict::new(py);
        about.set_item("name", option.name)?;
        about.set_item("summary", option.summary)?;
        match option.kind {
            Kind::Whole { default, min, max } => {
                about.set_item("kind", "whole")?;
                about.set_item("default", default)?;
                about.set_item("range", (min, max))?;
            }
            Kind::Number { default, min, max } => {
                about.set_item("kind", "number")?;
                about.set_item("default", default)?;
                about.set_item("range", (min, max))?;
            }
            Kind::Flag { default } => {
                about.set_item("kind", "flag")?;
                about.set_item("default", default)?;
            }
            Kind::Choice { default, choices } => {
                about.set_item("kind", "choice")?;
                about.set_item("default", default)?;
                about.set_item("choices", choices)?;
            }
        }
        options.append(about)?;
    }
    entry.set_item("options", options)?;
    Ok(entry)
}

/// Bytes of a map of a `width` x `height` height map, and those its bake needs besides.
#[pyfunction]
pub fn map_bytes(
    map: &str,
    options: Vec<(String, Setting)>,
    width: usize,
    height: usize,
    wrap: &str,
) -> PyResult<(u128, u128)> {
    let map = Map::named(map).map_err(Raise::raise)?;
    let options = parse_options(&map.info, options)?;
    let wrap: Wrap = parse_wrap(wrap)?;
    let plan = (map.plan)(Grid { width, height, wrap }, &options);
    Ok((plan.bytes(map.info.channels.len()), plan.working_bytes))
}

/// The shape of a layer's array: `(D, H, W, C)` without depth outside stacks and without channels
/// where there is but one.
fn shape(info: &MapInfo, layer: &Layer) -> Vec<usize> {
    let depth = matches!(info.form, Form::Stack { .. }).then_some(layer.depth);
    let channels = Some(info.channels.len()).filter(|&channels| channels > 1);
    depth.into_iter().chain([layer.height, layer.width]).chain(channels).collect()
}

/// Bakes one map: its layers as float32 arrays. Only pyramids have more than one.
///
/// `progress(done, total)` counts rows from `first` to `first + height` of `total`.
#[pyfunction]
pub fn bake_map<'py>(
    py: Python<'py>,
    field: &Field,
    map: &str,
    options: Vec<(String, Setting)>,
    progress: Option<&Bound<'py, PyAny>>,
    first: usize,
    total: usize,
) -> PyResult<Vec<Bound<'py, PyArrayDyn<f32>>>> {
    let map = Map::named(map).map_err(Raise::raise)?;
    let options = parse_options(&map.info, options)?;
    let field = field.shared();
    let baked = run(py, progress, |task| {
        let rows = field.height();
        let mut report = |done: usize, of: usize| task.advance(first + done * rows / of.max(1), total);
        bake::bake(&field, map, &options, Progress::new(&mut report))
    })?;
    baked
        .layers
        .into_iter()
        .map(|layer| {
            let shape = shape(baked.info, &layer);
            PyArray1::from_vec(py, layer.texels).reshape(IxDyn(&shape))
        })
        .collect()
}

/// Writes the layers of a map into a folder and returns the files made.
#[pyfunction]
pub fn save_map(
    py: Python<'_>,
    map: &str,
    layers: Vec<PyReadonlyArrayDyn<'_, f32>>,
    folder: PathBuf,
    prefix: &str,
    format: &str,
    bits: u8,
) -> PyResult<Vec<PathBuf>> {
    let info = bake::maps::about(map).map_err(Raise::raise)?;
    let format = FileFormat::named(format, bits).map_err(Raise::raise)?;
    let layers = layers.iter().map(|array| layer(info, array)).collect::<PyResult<_>>()?;
    let baked = Baked { info, options: info.defaults(), layers };
    run(py, None, |_| bake::save(&baked, &folder, prefix, format))
}

fn layer(info: &MapInfo, array: &PyReadonlyArrayDyn<'_, f32>) -> PyResult<Layer> {
    let found = array.shape();
    let depth = if matches!(info.form, Form::Stack { .. }) { found.first().copied() } else { Some(1) };
    let at = found.len().min(usize::from(matches!(info.form, Form::Stack { .. })));
    let (depth, height, width) = match (depth, &found[at..]) {
        (Some(depth), &[height, width, ..]) => (depth, height, width),
        _ => (0, 0, 0),
    };
    let layer = Layer { width, height, depth, texels: Vec::new() };
    if found != shape(info, &layer).as_slice() || found.contains(&0) {
        return Err(PyValueError::new_err(format!("map {:?} cannot have shape {found:?}", info.name)));
    }
    Ok(Layer { texels: array.as_slice()?.to_vec(), ..layer })
}
