//! Baking maps and saving them.

use std::path::PathBuf;

use bake::encode::{Depth, Range, Sample};
use bake::maps::REGISTRY;
use bake::{
    BakeError, Baked, Encoded, EncodedLayer, FileFormat, Form, Grid, HeightSettings, Kind, Layer, Map,
    MapInfo, Options, Progress, Samples, Span, StreamRequest, Texels, Value, Values, bake_cached,
};
use heightfield::{Extent, Wrap};
use numpy::ndarray::IxDyn;
use numpy::{
    Element, PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::Raise;
use crate::field::{Field, parse_wrap};
use crate::run::{Task, run};

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
    entry.set_item("by_rows", Map::named(info.name).is_ok_and(Map::is_by_rows))?;
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

/// The shape of the array of a `[width, height, depth]` layer: `(D, H, W, C)` without depth outside
/// stacks and without channels where there is but one.
fn shape(info: &MapInfo, [width, height, depth]: [usize; 3]) -> Vec<usize> {
    let depth = matches!(info.form, Form::Stack { .. }).then_some(depth);
    let channels = Some(info.channels.len()).filter(|&channels| channels > 1);
    depth.into_iter().chain([height, width]).chain(channels).collect()
}

/// Layers as arrays, and what the ends of each channel's range are.
type Made<'py> = (Vec<Bound<'py, PyAny>>, Vec<(f32, f32)>);

/// Bakes one map: its layers as arrays of that type. Only pyramids have more than one. Costly maps
/// come out of the cache where it has them.
///
/// `progress(done, total)` counts rows from `first` to `first + height` of `total`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn bake_map<'py>(
    py: Python<'py>,
    field: &Field,
    map: &str,
    options: Vec<(String, Setting)>,
    dtype: &str,
    progress: Option<&Bound<'py, PyAny>>,
    first: usize,
    total: usize,
) -> PyResult<Made<'py>> {
    let map = Map::named(map).map_err(Raise::raise)?;
    let options = parse_options(&map.info, options)?;
    let depth = parse_depth(dtype)?;
    let field = field.shared();
    let ends = |ranges: &[Range]| ranges.iter().map(|range| (range.low, range.high)).collect();
    let baked = run(py, progress, |task| {
        let mut report = part_of(task, field.height(), first, total);
        bake_cached(&field, map, &options, Progress::new(&mut report))
    })?;
    let Some(depth) = depth else {
        let ranges = ends(&baked.ranges());
        let arrays = baked.layers.into_iter().map(|layer| {
            let shape = shape(&map.info, [layer.width, layer.height, layer.depth]);
            Ok(PyArray1::from_vec(py, layer.texels).reshape(IxDyn(&shape))?.into_any())
        });
        return Ok((arrays.collect::<PyResult<_>>()?, ranges));
    };
    let encoded = run(py, None, |_| Ok::<_, BakeError>(baked.encoded(depth)))?;
    let ranges = ends(&encoded.ranges);
    let arrays = encoded.layers.into_iter().map(|layer| {
        let shape = IxDyn(&shape(&map.info, [layer.width, layer.height, layer.depth]));
        Ok(match layer.samples {
            Samples::U8(samples) => PyArray1::from_vec(py, samples).reshape(shape)?.into_any(),
            Samples::U16(samples) => PyArray1::from_vec(py, samples).reshape(shape)?.into_any(),
            Samples::F32(samples) => PyArray1::from_vec(py, samples).reshape(shape)?.into_any(),
        })
    });
    Ok((arrays.collect::<PyResult<_>>()?, ranges))
}

/// Reports a part of a job: `rows` of `total`, after `first` others.
fn part_of(task: &Task, rows: usize, first: usize, total: usize) -> impl FnMut(usize, usize) -> bool + '_ {
    move |done, of| task.advance(first + done * rows / of.max(1), total)
}

/// Bakes one map that is made by rows, straight from the heights where they lie: finite numbers in 0..1.
///
/// `progress` as for `bake_map`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn bake_rows<'py>(
    py: Python<'py>,
    heights: PyReadonlyArray2<'py, f32>,
    wrap: &str,
    extent: (f32, f32, [f32; 2]),
    map: &str,
    options: Vec<(String, Setting)>,
    dtype: &str,
    progress: Option<&Bound<'py, PyAny>>,
    first: usize,
    total: usize,
) -> PyResult<Made<'py>> {
    let map = Map::named(map).map_err(Raise::raise)?;
    let options = parse_options(&map.info, options)?;
    let [height, width] = [heights.shape()[0], heights.shape()[1]];
    let texels =
        Texels::new(heights.as_slice()?, [width, height], parse_wrap(wrap)?).map_err(Raise::raise)?;
    let extent = Extent { scale: extent.0, base: extent.1, tile_size: extent.2 };
    let job = RowJob { py, texels: &texels, extent, map, options: &options, progress, first, total };
    let array = match parse_depth(dtype)? {
        None => job.run::<f32>()?,
        Some(Depth::U8) => job.run::<u8>()?,
        Some(Depth::U16) => job.run::<u16>()?,
    };
    let ranges = map.info.channels.iter().map(|channel| match channel.span {
        Span::Fixed(range) => (range.low, range.high),
        Span::Found(_) => (f32::MIN, f32::MAX),
    });
    Ok((vec![array], ranges.collect()))
}

/// One map to be baked by rows, with where its progress goes.
struct RowJob<'a, 'py> {
    py: Python<'py>,
    texels: &'a Texels<'a>,
    extent: Extent,
    map: &'static Map,
    options: &'a Options,
    progress: Option<&'a Bound<'py, PyAny>>,
    first: usize,
    total: usize,
}

impl<'py> RowJob<'_, 'py> {
    /// Bakes straight into an array of NumPy's, whose large arrays take the system fewest steps.
    fn run<S: Sample + Element>(&self) -> PyResult<Bound<'py, PyAny>> {
        let Self { texels, extent, map, options, first, total, .. } = *self;
        let grid = texels.grid();
        bake::maps::check_memory(map, grid, options, size_of::<S>()).map_err(Raise::raise)?;
        let array =
            PyArrayDyn::<S>::zeros(self.py, IxDyn(&shape(&map.info, [grid.width, grid.height, 1])), false);
        {
            let mut view = array.readwrite();
            let out = view.as_slice_mut()?;
            run(self.py, self.progress, |task| {
                let mut report = part_of(task, grid.height, first, total);
                bake::bake_rows(texels, &extent, map, options, out, Progress::new(&mut report))
            })?;
        }
        Ok(array.into_any())
    }
}

fn parse_depth(dtype: &str) -> PyResult<Option<Depth>> {
    match dtype {
        "float32" => Ok(None),
        "uint8" => Ok(Some(Depth::U8)),
        "uint16" => Ok(Some(Depth::U16)),
        _ => Err(PyValueError::new_err(format!("dtype must be float32, uint8 or uint16, got {dtype:?}"))),
    }
}

/// A layer as Python has it.
#[derive(FromPyObject)]
pub enum LayerArray<'py> {
    /// Floats.
    F32(PyReadonlyArrayDyn<'py, f32>),
    /// 8-bit integers.
    U8(PyReadonlyArrayDyn<'py, u8>),
    /// 16-bit integers.
    U16(PyReadonlyArrayDyn<'py, u16>),
}

impl LayerArray<'_> {
    fn layer(&self, info: &MapInfo) -> PyResult<EncodedLayer> {
        let (found, samples) = match self {
            Self::F32(array) => (array.shape(), Samples::F32(array.as_slice()?.to_vec())),
            Self::U8(array) => (array.shape(), Samples::U8(array.as_slice()?.to_vec())),
            Self::U16(array) => (array.shape(), Samples::U16(array.as_slice()?.to_vec())),
        };
        let stack = usize::from(matches!(info.form, Form::Stack { .. }));
        let depth = if stack == 1 { found.first().copied().unwrap_or(0) } else { 1 };
        let (height, width) = match found.get(stack..) {
            Some(&[height, width, ..]) => (height, width),
            _ => (0, 0),
        };
        if found != shape(info, [width, height, depth]).as_slice() || found.contains(&0) {
            return Err(PyValueError::new_err(format!("map {:?} cannot have shape {found:?}", info.name)));
        }
        Ok(EncodedLayer { width, height, depth, samples })
    }
}

/// File, index of the layer, index of the slice, name of the only channel.
type File = (PathBuf, usize, usize, Option<&'static str>);

/// Files, and the ends of each channel's range.
type Saved = (Vec<File>, Vec<(f32, f32)>);

/// Writes the layers of a map into a folder; returns the files made and the ends of each channel's
/// range. `ranges` are those of integers.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn save_map(
    py: Python<'_>,
    map: &str,
    layers: Vec<LayerArray<'_>>,
    ranges: Vec<(f32, f32)>,
    folder: PathBuf,
    prefix: &str,
    format: &str,
    bits: u8,
) -> PyResult<Saved> {
    let info = bake::maps::about(map).map_err(Raise::raise)?;
    let format = FileFormat::named(format, bits).map_err(Raise::raise)?;
    let layers = layers.iter().map(|array| array.layer(info)).collect::<PyResult<Vec<_>>>()?;
    let (files, ranges) = run(py, None, |task| {
        let mut report = |done, total| task.advance(done, total);
        let progress = Progress::new(&mut report);
        if layers.iter().all(|layer| matches!(layer.samples, Samples::F32(_))) {
            let layers = layers.into_iter().map(|EncodedLayer { width, height, depth, samples }| {
                let texels = if let Samples::F32(texels) = samples { texels } else { Vec::new() };
                Layer { width, height, depth, texels }
            });
            let baked = Baked { info, options: info.defaults(), layers: layers.collect() };
            return Ok::<_, BakeError>((
                bake::save(&baked, &folder, prefix, format, progress)?,
                baked.ranges(),
            ));
        }
        let ranges = info.channels.iter().zip(&ranges).map(|(channel, &(low, high))| {
            let (Span::Fixed(Range { rounding, .. }) | Span::Found(rounding)) = channel.span;
            Range { low, high, rounding }
        });
        let encoded = Encoded { info, options: info.defaults(), ranges: ranges.collect(), layers };
        Ok((bake::save(&encoded, &folder, prefix, format, progress)?, encoded.ranges))
    })?;
    let files = files.into_iter().map(|file| (file.path, file.layer, file.slice, file.channel));
    Ok((files.collect(), ranges.iter().map(|range| (range.low, range.high)).collect()))
}

/// What becomes of the numbers of a file: channel, "natural", "auto" or two numbers, inverted.
type Reading = (Option<usize>, Option<(f64, f64)>, bool, bool);

/// Bakes a map of a file into a file by rows; returns width, height, heights clipped and range.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn bake_file(
    py: Python<'_>,
    source: PathBuf,
    target: PathBuf,
    map: &str,
    options: Vec<(String, Setting)>,
    dtype: &str,
    wrap: &str,
    extent: (f32, f32, [f32; 2]),
    reading: Reading,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(usize, usize, usize, [f64; 2])> {
    let map = Map::named(map).map_err(Raise::raise)?;
    let options = parse_options(&map.info, options)?;
    let depth = parse_depth(dtype)?;
    let (channel, span, auto, invert) = reading;
    let values = match span {
        Some((low, high)) => Values::Span([low, high]),
        None if auto => Values::Auto,
        None => Values::Natural,
    };
    let request = StreamRequest {
        map,
        options: &options,
        wrap: parse_wrap(wrap)?,
        extent: Extent { scale: extent.0, base: extent.1, tile_size: extent.2 },
        settings: HeightSettings { channel, values, invert },
    };
    let found = run(py, progress, |task| {
        let mut report = |done, total| task.advance(done, total);
        bake::bake_file(&source, &target, depth, &request, Progress::new(&mut report))
    })?;
    Ok((found.width, found.height, found.clipped, found.range))
}
