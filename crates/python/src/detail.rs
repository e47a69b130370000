//! Maps baked from meshes.

use bake::maps::{FROM_MESH, HEIGHT, TANGENTS};
use bake::{Grid, MapInfo, Plan};
use heightfield::Wrap;
use mesh::{DetailOptions, NormalSpace, SkyOptions};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, ndarray::IxDyn};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::baking::describe;
use crate::errors::Raise;
use crate::mesh::PyMesh;
use crate::run::run;

/// Bytes of working memory that a triangle of the detailed mesh needs: its share of the tree, and of
/// what the tree is made from.
const TRIANGLE_BYTES: u128 = 160;

/// Everything known about each map that only a mesh gives.
#[pyfunction]
pub fn mesh_map_registry(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    for info in FROM_MESH {
        list.append(describe(py, info)?)?;
    }
    Ok(list)
}

/// What is wanted from a detailed mesh.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Wanted {
    normal: bool,
    height: bool,
    ao: bool,
    size: (usize, usize),
    front: Option<f32>,
    rear: Option<f32>,
    samples: usize,
    padding: usize,
    object_space: bool,
    green_down: bool,
    back_faces: bool,
    rays: u32,
    distance: Option<f32>,
    seed: u64,
}

impl Wanted {
    fn options(&self) -> DetailOptions {
        let (width, height) = self.size;
        let sky = SkyOptions { rays: self.rays, distance: self.distance, seed: self.seed };
        DetailOptions {
            width,
            height,
            front: self.front,
            rear: self.rear,
            grid: self.samples,
            padding: self.padding,
            space: if self.object_space { NormalSpace::Object } else { NormalSpace::Tangent },
            green_down: self.green_down,
            back_faces: self.back_faces,
            normal: self.normal,
            heights: self.height,
            sky: self.ao.then_some(sky),
        }
    }
}

/// Fails unless the machine can hold `channels` floats a texel and `besides` bytes.
fn check_memory(
    info: &'static MapInfo,
    size: (usize, usize),
    channels: usize,
    besides: u128,
) -> PyResult<()> {
    let grid = Grid { width: size.0, height: size.1, wrap: Wrap::Clamp };
    // The description has one number of channels; the rest counts as working memory.
    let more =
        channels.saturating_sub(info.channels.len()) as u128 * grid.texels() * size_of::<f32>() as u128;
    let flags = grid.texels() * 6;
    Plan::single(grid).working(more + flags + besides).check(info).map_err(Raise::raise)
}

fn array<'py>(
    py: Python<'py>,
    (width, height): (usize, usize),
    channels: usize,
    texels: Vec<f32>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let shape: &[usize] = if channels == 1 { &[height, width] } else { &[height, width, channels] };
    PyArray1::from_vec(py, texels).reshape(IxDyn(shape))
}

/// Bakes a detailed mesh onto a plain one: the maps by name, and the report.
#[pyfunction]
pub fn bake_detail<'py>(
    py: Python<'py>,
    plain: &PyMesh,
    detail: &PyMesh,
    cage: Option<&PyMesh>,
    wanted: Wanted,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let (plain, detail, cage) = (plain.shared(), detail.shared(), cage.map(PyMesh::shared));
    let options = wanted.options();
    let channels = 3 * usize::from(wanted.normal) + usize::from(wanted.height) + usize::from(wanted.ao);
    check_memory(&HEIGHT, wanted.size, channels, detail.indices.len() as u128 * TRIANGLE_BYTES)?;
    let baked = run(py, progress, |task| {
        let mut report = |done: usize, total: usize| task.advance(done, total);
        mesh::bake_detail(&plain, &detail, cage.as_deref(), &options, &mut report)
    })?;
    let maps = PyDict::new(py);
    for (name, channels, texels) in
        [("normal", 3, baked.normal), ("height", 1, baked.heights), ("ao", 1, baked.ao)]
    {
        if let Some(texels) = texels {
            maps.set_item(name, array(py, wanted.size, channels, texels)?)?;
        }
    }
    let found = baked.report;
    let report = PyDict::new(py);
    report.set_item("front", found.front)?;
    report.set_item("rear", found.rear)?;
    report.set_item("met", found.met)?;
    report.set_item("texels", found.texels)?;
    report.set_item("rays", found.rays)?;
    report.set_item("missed", found.missed)?;
    report.set_item("averted", found.averted)?;
    report.set_item("empty", found.empty)?;
    report.set_item("overlapping", found.overlapping)?;
    report.set_item("warnings", found.warnings)?;
    Ok((maps, report))
}

/// The tangent frame of a mesh as a map.
#[pyfunction]
pub fn bake_tangents<'py>(
    py: Python<'py>,
    mesh: &PyMesh,
    size: (usize, usize),
    padding: usize,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let mesh = mesh.shared();
    check_memory(&TANGENTS, size, 4, 0)?;
    let texels = run(py, progress, |task| {
        let mut report = |done: usize, total: usize| task.advance(done, total);
        ::mesh::tangent_map(&mesh, size.0, size.1, padding, &mut report)
    })?;
    array(py, size, 4, texels)
}
