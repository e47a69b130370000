//! Rendering, and marching on the device.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bake::{Image, Samples};
use glam::{DMat4, DVec3, Vec3};
use heightfield::OutputSet;
use heightfield::technique::Reads;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use render::{
    AovSet, Camera, Draw, HorizonShadows, Light, RenderError, Renderer, Request, Scene, SkipError, Skips,
    TechniqueChoice, Ticket,
};

use crate::errors::{Raise, classes};
use crate::field::Field;
use crate::march::{hits_to_dict, parse_outputs, parse_technique, provide};
use crate::mesh::PyMesh;
use crate::run::{Task, run};

/// A material; shared, never changed, so that what was uploaded for it is kept between renderings.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu", name = "Material")]
pub struct PyMaterial {
    inner: Arc<render::Material>,
}

#[pymethods]
impl PyMaterial {
    /// Takes an sRGB albedo `(H, W, 4)` and a normal map `(H, W, 3)` that holds `(n + 1) / 2`.
    #[new]
    fn new(
        field: &Field,
        albedo: Option<PyReadonlyArray3<'_, u8>>,
        normal: Option<PyReadonlyArray3<'_, f32>>,
        albedo_factor: [f32; 4],
        specular: f32,
        shininess: f32,
        double_sided: bool,
    ) -> PyResult<Self> {
        let image = |shape: &[usize], samples| {
            Image::new(shape[1], shape[0], shape[2], samples).map(Arc::new).map_err(Raise::raise)
        };
        let albedo =
            albedo.map(|array| image(array.shape(), Samples::U8(array.as_slice()?.to_vec()))).transpose()?;
        let normal =
            normal.map(|array| image(array.shape(), Samples::F32(array.as_slice()?.to_vec()))).transpose()?;
        Ok(Self {
            inner: Arc::new(render::Material {
                albedo,
                normal,
                albedo_factor,
                specular,
                shininess,
                double_sided,
                ..render::Material::new(field.shared())
            }),
        })
    }
}

/// A technique that renders, from its name and parameter values.
fn parse_choice(name: &str, parameters: &[(String, f64)]) -> PyResult<TechniqueChoice> {
    match TechniqueChoice::named(name).map_err(Raise::raise)? {
        TechniqueChoice::Search(_) => Ok(TechniqueChoice::Search(parse_technique(name, parameters)?)),
        plain if parameters.is_empty() => Ok(plain),
        _ => Err(PyValueError::new_err(format!("technique {name:?} has no parameters"))),
    }
}

/// `(eye, target, up, vertical field of view in degrees)`.
type CameraArg = ([f64; 3], [f64; 3], [f64; 3], f64);
/// `(directional, direction or position, colour, intensity)`.
type LightArg = (bool, [f64; 3], [f32; 3], f32);

fn parse_light((directional, vector, color, intensity): LightArg) -> Light {
    if directional {
        let direction: Vec3 = DVec3::from(vector).as_vec3();
        Light::Directional { direction, color, intensity }
    } else {
        Light::Point { position: DVec3::from(vector), color, intensity }
    }
}

/// `(mesh, first triangle, end, material, world_from_object by columns)`.
type DrawArg<'py> = (Bound<'py, PyMesh>, u32, u32, Bound<'py, PyMaterial>, [f64; 16]);

fn parse_draw((mesh, first, end, material, world_from_object): &DrawArg<'_>) -> Draw<'static> {
    Draw {
        triangles: *first..*end,
        world_from_object: DMat4::from_cols_array(world_from_object),
        ..Draw::new(mesh.get().shared(), Arc::clone(&material.get().inner))
    }
}

fn parse_camera((eye, target, up, fov_y): CameraArg) -> Camera {
    Camera { eye: eye.into(), target: target.into(), up: up.into(), fov_y: fov_y.to_radians() }
}

/// A picture under way.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu", name = "Ticket")]
pub struct PyTicket(Ticket);

/// A scene on the device: runs of triangles with what is asked of their pictures.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu", name = "Renderer")]
pub struct PyRenderer {
    inner: Mutex<Option<Renderer<'static>>>,
    reads: Option<Reads>,
}

#[pymethods]
impl PyRenderer {
    /// `horizon`: azimuths and softness (radians) of shadows from a horizon map.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
    fn new(
        py: Python<'_>,
        draws: Vec<DrawArg<'_>>,
        camera: CameraArg,
        lights: Vec<LightArg>,
        ambient: [f32; 3],
        background: [f32; 4],
        technique: &str,
        parameters: Vec<(String, f64)>,
        size: [u32; 2],
        shadows: Option<bool>,
        horizon: Option<(u32, f32)>,
        silhouettes: bool,
        samples: u32,
        specular_aa: bool,
        aovs: Vec<String>,
        skips: Vec<String>,
        skip_error: (f32, f32),
    ) -> PyResult<Self> {
        let technique = parse_choice(technique, &parameters)?;
        let aovs = aovs.iter().try_fold(AovSet::NONE, |set, name| {
            let known = || AovSet::NAMED.map(|(name, _)| name).join(", ");
            AovSet::named(name)
                .map(|aov| set | aov)
                .ok_or_else(|| PyValueError::new_err(format!("unknown output {name:?}; known: {}", known())))
        })?;
        let skips = skips.iter().try_fold(Skips::NONE, |set, name| {
            Skips::named(name)
                .map(|skip| set | skip)
                .ok_or_else(|| PyValueError::new_err(format!("unknown kind of work to skip {name:?}")))
        })?;
        let scene = Scene {
            draws: draws.iter().map(parse_draw).collect(),
            camera: parse_camera(camera),
            lights: lights.into_iter().map(parse_light).collect(),
            ambient,
            background,
        };
        let horizon = horizon.map(|(azimuths, softness)| HorizonShadows { azimuths, softness });
        let plain = Request::new(technique, size[0], size[1]);
        let (texels, pixels) = skip_error;
        let skip_error = SkipError { texels, pixels };
        let request =
            Request { shadows, horizon, silhouettes, samples, specular_aa, aovs, skips, skip_error, ..plain };
        let made = run(py, None, |_| Renderer::new(render::device()?, scene, request))?;
        let reads = match &technique {
            TechniqueChoice::Search(technique) => Some(technique.info.reads),
            TechniqueChoice::Plain(_) => None,
        };
        Ok(Self { inner: Mutex::new(Some(made)), reads })
    }

    /// A picture of one view: a dict with `color`, `aovs`, `stats` and `warnings`.
    fn render<'py>(&self, py: Python<'py>, camera: CameraArg) -> PyResult<Bound<'py, PyDict>> {
        let frame = self.with(py, |renderer, task| {
            let ticket = self.begin(renderer, task, camera)?;
            renderer.finish(ticket)
        })?;
        frame_to_dict(py, frame)
    }

    /// Has the device draw a view.
    fn start(&self, py: Python<'_>, camera: CameraArg) -> PyResult<PyTicket> {
        self.with(py, |renderer, task| self.begin(renderer, task, camera)).map(PyTicket)
    }

    /// Waits for a picture that was started.
    fn finish<'py>(&self, py: Python<'py>, ticket: &PyTicket) -> PyResult<Bound<'py, PyDict>> {
        let ticket = ticket.0;
        let frame = self.with(py, |renderer, _| renderer.finish(ticket))?;
        frame_to_dict(py, frame)
    }

    /// Gives a picture up that was started.
    fn abandon(&self, ticket: &PyTicket) {
        if let Some(renderer) = self.lock().as_mut() {
            renderer.abandon(ticket.0);
        }
    }

    /// Frees what the scene takes on the device.
    fn close(&self, py: Python<'_>) {
        py.detach(|| drop(self.lock().take()));
    }

    /// Whether it has been closed.
    #[getter]
    fn closed(&self) -> bool {
        self.lock().is_none()
    }
}

impl PyRenderer {
    fn lock(&self) -> MutexGuard<'_, Option<Renderer<'static>>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Renderer<'static>, &Task) -> Result<T, RenderError> + Send,
    ) -> PyResult<T> {
        // The lock is taken without the interpreter's: another thread may hold it while it needs that.
        let done =
            run(py, None, |task| self.lock().as_mut().map(|renderer| work(renderer, task)).transpose())?;
        done.ok_or_else(|| classes::RenderError::new_err("the renderer is closed"))
    }

    /// Bakes what the search reads of draws that come into view, where it can be interrupted, and starts.
    fn begin(
        &self,
        renderer: &mut Renderer<'_>,
        task: &Task,
        camera: CameraArg,
    ) -> Result<Ticket, RenderError> {
        let camera = parse_camera(camera);
        camera.validate()?;
        if let Some(reads) = self.reads {
            for field in renderer.fields_to_prepare(&camera) {
                provide(task, &field, reads)?;
            }
        }
        renderer.start(camera)
    }
}

fn frame_to_dict(py: Python<'_>, frame: render::Frame) -> PyResult<Bound<'_, PyDict>> {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let aovs = PyDict::new(py);
    let plane = |name: &str, values: Option<Vec<f32>>, channels: usize| -> PyResult<()> {
        match values {
            None => Ok(()),
            Some(values) if channels == 1 => {
                aovs.set_item(name, PyArray1::from_vec(py, values).reshape([height, width])?)
            }
            Some(values) => {
                aovs.set_item(name, PyArray1::from_vec(py, values).reshape([height, width, channels])?)
            }
        }
    };
    let from = frame.aovs;
    plane("uv", from.uv, 2)?;
    plane("depth", from.depth, 1)?;
    plane("position", from.position, 3)?;
    plane("normal", from.normal, 3)?;
    plane("height", from.height, 1)?;
    plane("steps", from.steps.map(|steps| steps.into_iter().map(|s| s as f32).collect()), 1)?;
    plane("shadow", from.shadow, 1)?;
    plane("mask", from.mask.map(|mask| mask.into_iter().map(f32::from).collect()), 1)?;
    plane("ray_start", from.ray_start, 3)?;
    plane("ray_delta", from.ray_delta, 3)?;
    plane("skip", from.skip.map(|codes| codes.into_iter().map(|code| code as f32).collect()), 1)?;
    let s = frame.stats;
    let stats = PyDict::new(py);
    stats.set_item("prepare_ms", s.prepare_ms)?;
    stats.set_item("compile_ms", s.compile_ms)?;
    stats.set_item("draw_ms", s.draw_ms)?;
    stats.set_item("device_clock", s.device_clock)?;
    stats.set_item("readback_ms", s.readback_ms)?;
    stats.set_item("total_ms", s.total_ms)?;
    stats.set_item("maps_baked", s.maps_baked)?;
    stats.set_item("pipelines_compiled", s.pipelines_compiled)?;
    stats.set_item("bytes_uploaded", s.bytes_uploaded)?;
    stats.set_item("triangles_drawn", s.triangles_drawn)?;
    stats.set_item("triangles_culled", s.triangles_culled)?;
    stats.set_item("pixels_covered", s.pixels_covered)?;
    stats.set_item("pixels_marched", s.pixels_marched)?;
    stats.set_item("pixels_skipped", s.pixels_covered.saturating_sub(s.pixels_marched))?;
    stats.set_item("pixels_unconverged", s.pixels_unconverged)?;
    stats.set_item("steps", s.steps)?;
    stats.set_item("shadow_rays", s.shadow_rays)?;
    let skipped = PyDict::new(py);
    for (name, count) in s.skipped.iter() {
        skipped.set_item(name, count)?;
    }
    stats.set_item("skipped", skipped)?;
    let dict = PyDict::new(py);
    dict.set_item("color", PyArray1::from_vec(py, frame.color).reshape([height, width, 4])?)?;
    dict.set_item("aovs", aovs)?;
    dict.set_item("stats", stats)?;
    dict.set_item("warnings", frame.warnings)?;
    Ok(dict)
}

/// Names of the additional outputs.
#[pyfunction]
pub fn aov_names() -> Vec<&'static str> {
    AovSet::NAMED.map(|(name, _)| name).to_vec()
}

/// What stands for each kind in the output "skip".
#[pyfunction]
pub fn skip_codes() -> Vec<(&'static str, u32)> {
    let kinds = Skips::NAMED.into_iter().filter(|(_, kind)| Skips::IN_PIXELS.contains(*kind));
    kinds.map(|(name, kind)| (name, kind.bits())).chain([("normal", Skips::ON_MESH)]).collect()
}

/// Names of the kinds of work that a rendering may leave out.
#[pyfunction]
pub fn skip_names() -> Vec<&'static str> {
    Skips::NAMED.map(|(name, _)| name).to_vec()
}

/// Marches on the device: the outputs, and the seconds it took there.
#[pyfunction]
pub fn march_gpu<'py>(
    py: Python<'py>,
    field: &Field,
    origins: PyReadonlyArray2<'py, f32>,
    directions: PyReadonlyArray2<'py, f32>,
    technique: &str,
    parameters: Vec<(String, f64)>,
    outputs: Vec<String>,
) -> PyResult<(Bound<'py, PyDict>, f64)> {
    let technique = parse_technique(technique, &parameters)?;
    let wanted = parse_outputs(&outputs)?;
    let field = field.shared();
    let (origins, directions) = (origins.as_slice()?, directions.as_slice()?);
    let found = run(py, None, |task| {
        let device = render::device()?;
        provide(task, &field, technique.info.reads)?;
        render::march(&device, &field, &technique, origins, directions)
    })?;
    // The device answers everything at once; what was not asked for is dropped here.
    let mut hits = found.hits;
    hits.t.take_if(|_| !wanted.contains(OutputSet::T));
    hits.uv.take_if(|_| !wanted.contains(OutputSet::UV));
    hits.z.take_if(|_| !wanted.contains(OutputSet::Z));
    hits.normal.take_if(|_| !wanted.contains(OutputSet::NORMAL));
    hits.steps.take_if(|_| !wanted.contains(OutputSet::STEPS));
    hits.status.take_if(|_| !wanted.contains(OutputSet::STATUS));
    Ok((hits_to_dict(py, hits)?, found.device_seconds))
}

/// Name, driver, driver version and kind of every Vulkan device, the preferred one first.
#[pyfunction]
pub fn adapters(py: Python<'_>) -> PyResult<Vec<(String, String, String, &'static str)>> {
    let found = run(py, None, |_| Ok::<_, std::convert::Infallible>(render::adapters()))?;
    Ok(found.into_iter().map(|info| (info.name, info.driver, info.driver_info, info.kind)).collect())
}
