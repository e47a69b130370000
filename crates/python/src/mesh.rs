//! The mesh as Python holds it.

use std::path::PathBuf;
use std::sync::Arc;

use mesh::{FrameMethod, ImageSource, MaterialSource, MeshError};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::Raise;
use crate::run::run;

/// A triangle mesh; shared, never changed.
#[pyclass(frozen, module = "bumpwgpu._bumpwgpu", name = "Mesh")]
pub struct PyMesh {
    inner: Arc<mesh::Mesh>,
}

impl PyMesh {
    /// The mesh itself.
    pub fn shared(&self) -> Arc<mesh::Mesh> {
        Arc::clone(&self.inner)
    }

    fn build(py: Python<'_>, make: impl FnOnce() -> Result<mesh::Mesh, MeshError> + Send) -> PyResult<Self> {
        Ok(Self { inner: Arc::new(run(py, None, |_| make())?) })
    }
}

/// A C-contiguous `(N, W)` array as rows.
fn rows<const W: usize, T: numpy::Element + Copy>(
    array: &PyReadonlyArray2<'_, T>,
    name: &str,
) -> PyResult<Vec<[T; W]>> {
    let shape = array.shape();
    if shape[1] != W {
        let message = format!("{name} must have shape (N, {W}), got ({}, {})", shape[0], shape[1]);
        return Err(PyValueError::new_err(message));
    }
    Ok(array.as_slice()?.as_chunks::<W>().0.to_vec())
}

/// A C-contiguous `(N, W)` array as vectors.
fn vectors<const W: usize, V: From<[f32; W]>>(
    array: &PyReadonlyArray2<'_, f32>,
    name: &str,
) -> PyResult<Vec<V>> {
    Ok(rows::<W, f32>(array, name)?.into_iter().map(V::from).collect())
}

/// Vectors as an `(N, W)` array.
fn array<'py, const W: usize, T: numpy::Element>(
    py: Python<'py>,
    values: impl ExactSizeIterator<Item = [T; W]>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let count = values.len();
    PyArray1::from_vec(py, values.flatten().collect()).reshape([count, W])
}

fn image_source<'py>(py: Python<'py>, source: Option<&ImageSource>) -> PyResult<Option<Bound<'py, PyAny>>> {
    Ok(match source {
        None => None,
        Some(ImageSource::File(path)) => Some(path.into_pyobject(py)?.into_any()),
        Some(ImageSource::Encoded(bytes)) => Some(PyBytes::new(py, bytes).into_any()),
    })
}

fn material<'py>(py: Python<'py>, source: &MaterialSource) -> PyResult<Bound<'py, PyDict>> {
    let entry = PyDict::new(py);
    entry.set_item("name", &source.name)?;
    entry.set_item("albedo", image_source(py, source.albedo.as_ref())?)?;
    entry.set_item("normal", image_source(py, source.normal.as_ref())?)?;
    entry.set_item("bump", image_source(py, source.bump.as_ref())?)?;
    entry.set_item("displacement", image_source(py, source.displacement.as_ref())?)?;
    entry.set_item("albedo_factor", source.albedo_factor)?;
    entry.set_item("specular", source.specular)?;
    entry.set_item("shininess", source.shininess)?;
    entry.set_item("bump_scale", source.bump_scale)?;
    entry.set_item("displacement_scale", source.displacement_scale)?;
    entry.set_item("normal_scale", source.normal_scale)?;
    Ok(entry)
}

/// `(tangents (M, 4), indices (T, 3), source (M,))`.
type SplitArrays<'py> =
    (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<u32>>, Bound<'py, PyArray1<u32>>, Vec<String>);

#[pymethods]
impl PyMesh {
    /// Reads OBJ, glTF or GLB.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::build(py, || mesh::Mesh::open(path))
    }

    /// A rectangle facing +Z.
    #[staticmethod]
    fn rectangle(py: Python<'_>, width: f32, height: f32) -> PyResult<Self> {
        Self::build(py, || mesh::Mesh::rectangle(width, height))
    }

    /// A cube.
    #[staticmethod]
    fn cube(py: Python<'_>, size: f32) -> PyResult<Self> {
        Self::build(py, || mesh::Mesh::cube(size))
    }

    /// A sphere.
    #[staticmethod]
    fn sphere(py: Python<'_>, radius: f32, segments: u32) -> PyResult<Self> {
        Self::build(py, || mesh::Mesh::sphere(radius, segments))
    }

    /// A torus.
    #[staticmethod]
    fn torus(
        py: Python<'_>,
        major: f32,
        minor: f32,
        major_segments: u32,
        minor_segments: u32,
    ) -> PyResult<Self> {
        Self::build(py, || mesh::Mesh::torus(major, minor, major_segments, minor_segments))
    }

    /// A mesh from plain arrays.
    #[staticmethod]
    fn from_arrays(
        py: Python<'_>,
        positions: PyReadonlyArray2<'_, f32>,
        indices: PyReadonlyArray2<'_, u32>,
        uvs: PyReadonlyArray2<'_, f32>,
        normals: Option<PyReadonlyArray2<'_, f32>>,
        tangents: Option<PyReadonlyArray2<'_, f32>>,
    ) -> PyResult<Self> {
        let positions = rows(&positions, "positions")?;
        let indices = rows(&indices, "indices")?;
        let uvs = rows(&uvs, "uvs")?;
        let normals = normals.map(|n| rows(&n, "normals")).transpose()?;
        let tangents = tangents.map(|t| rows(&t, "tangents")).transpose()?;
        Self::build(py, || {
            mesh::Mesh::from_arrays(&positions, &indices, &uvs, normals.as_deref(), tangents.as_deref())
        })
    }

    /// `(V, 3)` positions.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        array(py, self.inner.positions.iter().map(|p| p.to_array()))
    }

    /// `(V, 3)` unit normals.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        array(py, self.inner.normals.iter().map(|n| n.to_array()))
    }

    /// `(V, 2)` texture coordinates.
    #[getter]
    fn uvs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        array(py, self.inner.uvs.iter().map(|t| t.to_array()))
    }

    /// `(T, 3)` triangles.
    #[getter]
    fn indices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u32>>> {
        array(py, self.inner.indices.iter().copied())
    }

    /// `(V, 4)` tangents.
    #[getter]
    fn stored_tangents<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        array(py, self.inner.tangents.iter().map(|t| t.to_array()))
    }

    /// `(V, 3)` derivatives along u.
    #[getter]
    fn dpdu<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        array(py, self.inner.dpdu.iter().map(|d| d.to_array()))
    }

    /// `(V, 3)` derivatives along v.
    #[getter]
    fn dpdv<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        array(py, self.inner.dpdv.iter().map(|d| d.to_array()))
    }

    /// What was repaired or left out.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner.warnings.clone()
    }

    /// `(name, first triangle, end triangle, material index)` of each part.
    #[getter]
    fn parts(&self) -> Vec<(String, u32, u32, Option<usize>)> {
        let parts = self.inner.parts.iter();
        parts
            .map(|part| (part.name.clone(), part.triangles.start, part.triangles.end, part.material))
            .collect()
    }

    /// The materials as the file describes them.
    #[getter]
    fn materials<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.inner.materials.iter().map(|source| material(py, source)).collect()
    }

    /// Number of vertices and of triangles.
    #[getter]
    fn counts(&self) -> (usize, usize) {
        (self.inner.positions.len(), self.inner.indices.len())
    }

    /// Smallest and largest corner of the bounding box.
    #[getter]
    fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let (low, high) = self.inner.bounds();
        (low.to_array(), high.to_array())
    }

    /// Tangents by a method, with the vertices it splits.
    fn tangents<'py>(&self, py: Python<'py>, method: &str) -> PyResult<SplitArrays<'py>> {
        let method = FrameMethod::named(method).map_err(Raise::raise)?;
        let mesh = self.shared();
        let split = run(py, None, |_| mesh.tangents(method))?;
        Ok((
            array(py, split.tangents.iter().map(|t| t.to_array()))?,
            array(py, split.indices.iter().copied())?,
            PyArray1::from_vec(py, split.source),
            split.warnings,
        ))
    }
}

/// Tangents for plain arrays: triangles `(F, 3)` or quads `(F, 4)`, which come back as they came.
#[pyfunction]
pub fn tangents<'py>(
    py: Python<'py>,
    positions: PyReadonlyArray2<'py, f32>,
    indices: PyReadonlyArray2<'py, u32>,
    uvs: PyReadonlyArray2<'py, f32>,
    normals: Option<PyReadonlyArray2<'py, f32>>,
    method: &str,
    weld: bool,
) -> PyResult<SplitArrays<'py>> {
    let method = FrameMethod::named(method).map_err(Raise::raise)?;
    let mut arrays = mesh::arrays::Arrays {
        positions: vectors(&positions, "positions")?,
        normals: normals.map(|n| vectors(&n, "normals")).transpose()?,
        uvs: vectors(&uvs, "uvs")?,
        ..Default::default()
    };
    let mut quads = Vec::new();
    let is_quads = indices.shape()[1] == 4;
    if is_quads {
        (arrays.indices, quads) = mesh::frame::triangles_of_quads(&rows(&indices, "indices")?);
    } else {
        arrays.indices = rows(&indices, "indices")?;
    }
    let split = run(py, None, |_| mesh::frame::tangents_of_arrays(method, arrays, &quads, weld))?;
    let faces = if is_quads {
        array(py, mesh::frame::quads_of_triangles(&split.indices).into_iter())?
    } else {
        array(py, split.indices.into_iter())?
    };
    Ok((
        array(py, split.tangents.iter().map(|t| t.to_array()))?,
        faces,
        PyArray1::from_vec(py, split.source),
        split.warnings,
    ))
}

/// Name, summary, guarantee and source of each tangent method.
#[pyfunction]
pub fn tangent_methods() -> Vec<[&'static str; 4]> {
    let methods = FrameMethod::all().iter();
    methods.map(|m| [m.name(), m.summary(), m.guarantee(), m.source()]).collect()
}
