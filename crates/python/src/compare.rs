//! Comparing techniques: run time and error on height maps, errors of rendered pixels.

use std::sync::{Arc, Mutex, PoisonError};

use compare::pareto::{Candidate, contenders, front, rivals, ties};
use compare::picture::View;
use compare::recommend::{Budget, Entry, recommend};
use compare::{
    Dropped, Format, Metrics, Plan, RayErrors, Rays, Reference, Region, Reported, Row, Setting, Timing, sweep,
};
use heightfield::{HeightField, Hits, Technique};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::errors::{CompareError, Raise};
use crate::field::Field;
use crate::march::parse_technique;
use crate::run::run;

impl Raise for compare::CompareError {
    fn raise(self) -> PyErr {
        match self {
            Self::HeightField(error) => error.raise(),
            Self::Setting { .. } | Self::Length { .. } => PyValueError::new_err(self.to_string()),
            _ => CompareError::new_err(self.to_string()),
        }
    }
}

/// Name and parameter values of a technique, and the formats of heights and cones.
type Chosen = (String, Vec<(String, f64)>, String, String);

fn parse_setting((name, values, heights, cones): &Chosen) -> PyResult<Setting> {
    let plain = Setting::from(parse_technique(name, values)?);
    let [heights, cones] = [heights, cones].map(|format| Format::named(format).map_err(Raise::raise));
    Ok(plain.stored(heights?, cones?))
}

/// The device as the comparison sees it.
struct DeviceRunner(Arc<render::Device>);

impl DeviceRunner {
    fn new() -> Result<Self, String> {
        render::device().map(Self).map_err(|error| error.to_string())
    }
}

impl compare::DeviceMarch for DeviceRunner {
    fn march(&self, field: &HeightField, technique: &Technique, rays: &Rays) -> Result<(Hits, f64), String> {
        render::march(&self.0, field, technique, &rays.origins, &rays.directions)
            .map(|found| (found.hits, found.device_seconds))
            .map_err(|error| error.to_string())
    }
}

/// Passes progress on with a word about what is being done.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu")]
struct Reporter {
    callback: Py<PyAny>,
    text: Arc<Mutex<String>>,
}

#[pymethods]
impl Reporter {
    fn __call__(&self, py: Python<'_>, done: usize, total: usize) -> PyResult<()> {
        let text = self.text.lock().unwrap_or_else(PoisonError::into_inner).clone();
        self.callback.call1(py, (done, total, text)).map(drop)
    }
}

/// Compares techniques on a height map: one dict for each setting and elevation, and one for all elevations
/// together; one for each setting that was dropped after a first look; and why there is no device, if there
/// is none. No settings stands for the adaptive sweep. `device` is "cpu", "gpu", or "auto": a device if
/// there is one.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn compare_planar<'py>(
    py: Python<'py>,
    field: &Field,
    settings: Vec<Chosen>,
    elevations: Vec<f64>,
    rays: usize,
    repeats: usize,
    seed: u64,
    device: &str,
    progress: Option<Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyList>, Bound<'py, PyList>, Option<String>)> {
    let adaptive = settings.is_empty();
    let settings = if adaptive {
        sweep::defaults().map_err(Raise::raise)?.into_iter().map(Setting::from).collect()
    } else {
        settings.iter().map(parse_setting).collect::<PyResult<_>>()?
    };
    let plan = Plan { settings, elevations_deg: elevations, rays, repeats, seed };
    let field = field.shared();
    let text = Arc::new(Mutex::new(String::new()));
    let reporter = match progress {
        None => None,
        Some(callback) => {
            let reporter = Reporter { callback: callback.unbind(), text: Arc::clone(&text) };
            Some(Bound::new(py, reporter)?.into_any())
        }
    };
    let (rows, dropped, problem) = run(py, reporter.as_ref(), |task| {
        let (device, problem) = match device {
            "cpu" => (None, None),
            wanted => match DeviceRunner::new() {
                Ok(device) => (Some(device), None),
                Err(problem) if wanted == "auto" => (None, Some(problem)),
                Err(problem) => return Err(compare::CompareError::Device(problem)),
            },
        };
        let device = device.as_ref().map(|device| device as &dyn compare::DeviceMarch);
        let mut tell = |done: usize, total: usize, now: &str| {
            now.clone_into(&mut text.lock().unwrap_or_else(PoisonError::into_inner));
            task.advance(done, total)
        };
        let (rows, dropped) = if adaptive {
            compare::compare_adaptively(&field, &plan, device, &mut tell)?
        } else {
            (compare::compare(&field, &plan, device, &mut tell)?, Vec::new())
        };
        Ok((rows, dropped, problem))
    })?;
    let list = PyList::empty(py);
    for row in rows {
        list.append(row_to_dict(py, &row)?)?;
    }
    let left_out = PyList::empty(py);
    for setting in dropped {
        left_out.append(dropped_to_dict(py, &setting)?)?;
    }
    Ok((list, left_out, problem))
}

/// Metrics of one setting on seeded rays at all these elevations together, without any timing.
#[pyfunction]
pub fn compare_verify<'py>(
    py: Python<'py>,
    field: &Field,
    setting: Chosen,
    elevations: Vec<f64>,
    rays: usize,
    seed: u64,
) -> PyResult<Bound<'py, PyDict>> {
    let settings = vec![parse_setting(&setting)?];
    let plan = Plan { settings, elevations_deg: elevations, rays, repeats: 1, seed };
    let field = field.shared();
    let found = run(py, None, |task| {
        compare::verify(&field, &plan, &mut |done, total, _| task.advance(done, total))
    })?;
    let dict = PyDict::new(py);
    for metrics in &found {
        set_metrics(&dict, metrics)?;
    }
    Ok(dict)
}

/// Bytes of texture that a setting reads.
#[pyfunction]
pub fn compare_memory(field: &Field, setting: Chosen) -> PyResult<usize> {
    Ok(parse_setting(&setting)?.memory_bytes(&field.shared()))
}

fn set_setting(dict: &Bound<'_, PyDict>, setting: &Setting) -> PyResult<()> {
    dict.set_item("technique", setting.technique.info.name)?;
    let parameters = PyDict::new(dict.py());
    for (name, value) in setting.technique.settings() {
        parameters.set_item(name, value as i64)?;
    }
    dict.set_item("parameters", parameters)?;
    dict.set_item("heights_format", setting.heights.name())?;
    dict.set_item("cones_format", setting.reads_cones().then(|| setting.cones.name()))?;
    dict.set_item("label", setting.to_string())
}

fn dropped_to_dict<'py>(py: Python<'py>, dropped: &Dropped) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    set_setting(&dict, &dropped.setting)?;
    dict.set_item("time_ns_per_ray", dropped.time_ns)?;
    dict.set_item("uv_error_p99_texels", dropped.uv_error_p99_texels)?;
    dict.set_item("failure_rate", dropped.failure_rate)?;
    Ok(dict)
}

fn row_to_dict<'py>(py: Python<'py>, row: &Row) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    set_setting(&dict, &row.setting)?;
    dict.set_item("memory_bytes", row.memory_bytes)?;
    dict.set_item("elevation", row.elevation_deg)?;
    set_timing(&dict, "cpu", Some(&row.cpu))?;
    set_timing(&dict, "device", row.device.as_ref())?;
    set_metrics(&dict, &row.metrics)?;
    dict.set_item("device_difference_p99_texels", row.device_difference.map(|d| d.uv_p99_texels))?;
    dict.set_item("device_difference_hit_rate", row.device_difference.map(|d| d.status_rate))?;
    let regions = PyDict::new(py);
    for (region, metrics) in &row.regions {
        let part = PyDict::new(py);
        set_metrics(&part, metrics)?;
        regions.set_item(region.name(), part)?;
    }
    dict.set_item("regions", regions)?;
    Ok(dict)
}

fn set_timing(dict: &Bound<'_, PyDict>, what: &str, timing: Option<&Timing>) -> PyResult<()> {
    dict.set_item(format!("time_{what}_ns_per_ray"), timing.map(|t| t.median_ns))?;
    dict.set_item(format!("time_{what}_ns_per_ray_low"), timing.map(|t| t.low_ns))?;
    dict.set_item(format!("time_{what}_ns_per_ray_high"), timing.map(|t| t.high_ns))
}

fn set_metrics(dict: &Bound<'_, PyDict>, m: &Metrics) -> PyResult<()> {
    dict.set_item("rays", m.rays)?;
    dict.set_item("uv_error_median_texels", m.uv_error_median_texels)?;
    dict.set_item("uv_error_p99_texels", m.uv_error_p99_texels)?;
    dict.set_item("uv_error_p99_bound_texels", m.uv_error_p99_bound_texels)?;
    dict.set_item("uv_error_max_texels", m.uv_error_max_texels)?;
    dict.set_item("share_above_1_texel", m.share_above_1_texel)?;
    dict.set_item("depth_error_p99", m.depth_error_p99)?;
    dict.set_item("depth_error_max", m.depth_error_max)?;
    dict.set_item("normal_error_median_deg", m.normal_error_median_deg)?;
    dict.set_item("normal_error_p99_deg", m.normal_error_p99_deg)?;
    dict.set_item("miss_rate", m.miss_rate)?;
    dict.set_item("false_hit_rate", m.false_hit_rate)?;
    dict.set_item("unconverged_rate", m.unconverged_rate)?;
    dict.set_item("nan_count", m.nan_count)?;
    dict.set_item("failure_rate", m.failure_rate())?;
    dict.set_item("failure_rate_bound", m.failure_rate_bound())?;
    dict.set_item("shadow_error_rate", m.shadow_error_rate)?;
    dict.set_item("steps_mean", m.steps_mean)
}

/// Pictures of a height map from one camera, with the exact answers of its pixels.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu")]
pub struct CompareView {
    field: Arc<HeightField>,
    view: View,
    size: [usize; 2],
}

#[pymethods]
impl CompareView {
    #[new]
    fn new(py: Python<'_>, field: &Field, width: usize, height: usize) -> PyResult<Self> {
        let field = field.shared();
        let size = [width, height];
        let view = run(py, None, |_| View::new(&field, size))?;
        Ok(Self { field, view, size })
    }

    /// `(H, W, 3)` uint8 sRGB, `(H, W)` float32 hit errors in texels, NaN without a hit, and `(H, W)`
    /// float32 height reads.
    fn picture<'py>(
        &self,
        py: Python<'py>,
        technique: &str,
        parameters: Vec<(String, f64)>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let technique = parse_technique(technique, &parameters)?;
        let made = run(py, None, |_| self.view.picture(&self.field, &technique))?;
        let [width, height] = self.size;
        let rgb = PyArray1::from_vec(py, made.rgb).reshape([height, width, 3])?;
        let error = PyArray1::from_vec(py, made.error_texels).reshape([height, width])?;
        let steps = PyArray1::from_vec(py, made.steps).reshape([height, width])?;
        Ok((rgb.into_any(), error.into_any(), steps.into_any()))
    }
}

/// Exact answers for the texture-space segments of rendered pixels.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu")]
pub struct SegmentReference {
    field: Arc<HeightField>,
    rays: Rays,
    reference: Reference,
}

#[pymethods]
impl SegmentReference {
    /// Takes `(N, 3)` float32 starts and deltas.
    #[new]
    fn new(
        py: Python<'_>,
        field: &Field,
        starts: PyReadonlyArray2<'_, f32>,
        deltas: PyReadonlyArray2<'_, f32>,
    ) -> PyResult<Self> {
        if starts.shape() != deltas.shape() || starts.shape()[1] != 3 {
            return Err(PyValueError::new_err(format!(
                "segments must be two arrays of shape (N, 3), got {:?} and {:?}",
                starts.shape(),
                deltas.shape()
            )));
        }
        let field = field.shared();
        let rays = Rays { origins: starts.as_slice()?.to_vec(), directions: deltas.as_slice()?.to_vec() };
        let reference = run(py, None, |_| {
            use heightfield::RayArray::F32;
            heightfield::march::validate(F32(&rays.origins), F32(&rays.directions))?;
            Ok::<_, compare::CompareError>(Reference::new(&field, &rays, &[]))
        })?;
        Ok(Self { field, rays, reference })
    }

    /// Whether the true hit of each segment lies beside an edge of the relief: `(N,)` bool.
    fn silhouettes<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        let edges = self.reference.regions.iter().map(|&region| region == Region::Silhouette);
        PyArray1::from_vec(py, edges.collect())
    }

    /// Metrics of these hits: for all of them, for each of `sets`, which are lists of the groups that
    /// `group` puts the segments in, and `(N,)` float32 hit errors in texels, NaN where nothing is truly hit.
    #[expect(clippy::type_complexity, reason = "three results, named in the facade")]
    fn measure<'py>(
        &self,
        py: Python<'py>,
        uv: PyReadonlyArray2<'py, f32>,
        z: PyReadonlyArray1<'py, f32>,
        status: PyReadonlyArray1<'py, u8>,
        group: PyReadonlyArray1<'py, u8>,
        sets: Vec<Vec<u32>>,
    ) -> PyResult<(Bound<'py, PyDict>, Vec<Bound<'py, PyDict>>, Bound<'py, PyArray1<f32>>)> {
        let (uv, z) = (uv.as_slice()?, z.as_slice()?);
        let reported =
            Reported { uv, z, t: None, normal: None, status: Some(status.as_slice()?), steps: None };
        let errors =
            run(py, None, |_| RayErrors::measure(&self.field, &self.rays, &self.reference, &reported))?;
        let truly: Vec<usize> = (0..self.rays.len()).filter(|&i| self.reference.truths[i].hit).collect();
        let group = group.as_slice()?;
        if group.len() != self.rays.len() {
            return Err(PyValueError::new_err(format!(
                "{} segments but {} groups",
                self.rays.len(),
                group.len()
            )));
        }
        let to_dict = |errors: &RayErrors| -> PyResult<_> {
            let dict = PyDict::new(py);
            set_metrics(&dict, &Metrics::of(&[errors]))?;
            Ok(dict)
        };
        let split = sets
            .iter()
            .map(|set| to_dict(&errors.select(|row| set.contains(&u32::from(group[truly[row]])))))
            .collect::<PyResult<Vec<_>>>()?;
        let mut texels = vec![f32::NAN; self.rays.len()];
        for (&i, &error) in truly.iter().zip(&errors.uv_texels) {
            texels[i] = error;
        }
        Ok((to_dict(&errors)?, split, PyArray1::from_vec(py, texels)))
    }
}

/// A measured setting: label, time per ray (least, median, upper quartile), p99 error in
/// texels, share of rays that fail, bytes of texture.
type Measured = (String, [f64; 3], f64, f64, f64);

fn timing([low_ns, median_ns, high_ns]: [f64; 3]) -> Timing {
    Timing { median_ns, low_ns, high_ns }
}

/// Indices of the settings on the Pareto front, by rising time, each with those whose time cannot be told from
/// its own and that are on the front too or would be, were the tie broken in their favour; and those of these that
/// may take its place. Settings that fail on more than `max_failure_rate` of the rays cannot be on it.
#[pyfunction]
pub fn compare_front(measured: Vec<Measured>, max_failure_rate: f64) -> Vec<(usize, Vec<usize>, Vec<usize>)> {
    let candidates: Vec<Candidate> = measured
        .into_iter()
        .map(|(_, time, error, failure_rate, memory)| Candidate {
            time: timing(time),
            error,
            memory,
            eligible: failure_rate <= max_failure_rate,
        })
        .collect();
    let kept = front(&candidates);
    let near = contenders(&candidates);
    kept.iter().map(|&i| (i, ties(&candidates, i, &near), rivals(&candidates, i, &near))).collect()
}

/// Index of the cheapest setting within the budget, if any, and why. The budget: p99 error in texels, share
/// of failing rays, nanoseconds a ray, bytes of texture.
#[pyfunction]
pub fn compare_recommend(measured: Vec<Measured>, budget: [f64; 4]) -> (Option<usize>, String) {
    let entries: Vec<Entry> = measured
        .into_iter()
        .map(|(label, time, error_texels, failure_rate, memory_bytes)| Entry {
            label,
            time: timing(time),
            error_texels,
            failure_rate,
            memory_bytes,
        })
        .collect();
    let [max_error_texels, max_failure_rate, max_time_ns, max_memory_bytes] = budget;
    let budget = Budget { max_error_texels, max_failure_rate, max_time_ns, max_memory_bytes };
    let advice = recommend(&entries, &budget);
    (advice.pick, advice.reason)
}
