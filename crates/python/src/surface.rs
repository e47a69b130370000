//! Surfaces in closed form, and their normals under a relief.

use glam::{DVec2, DVec3};
use mesh::generate::{SurfacePoint, sphere_point, torus_point};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use render::surface::{SurfaceFrame, perturb_blinn, perturb_exact, perturb_general, perturb_orthogonal};

use crate::run::run;

type Vectors<'py> = Bound<'py, PyArray2<f64>>;

fn vectors<'py>(py: Python<'py>, values: impl Iterator<Item = DVec3>) -> PyResult<Vectors<'py>> {
    let flat: Vec<f64> = values.flat_map(|v| v.to_array()).collect();
    let count = flat.len() / 3;
    PyArray1::from_vec(py, flat).reshape([count, 3])
}

fn rows<const W: usize>(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; W]>> {
    Ok(array.as_slice()?.as_chunks::<W>().0.to_vec())
}

/// Position, normal, `dP/du`, `dP/dv`, `dN/du` and `dN/dv` at `uv` (N, 2) of a sphere (its radius) or a
/// torus (both radii).
#[pyfunction]
pub fn surface_points<'py>(
    py: Python<'py>,
    shape: &str,
    radii: (f64, f64),
    uv: PyReadonlyArray2<'py, f64>,
) -> PyResult<[Vectors<'py>; 6]> {
    let torus = match shape {
        "sphere" => false,
        "torus" => true,
        _ => return Err(PyValueError::new_err(format!("unknown shape {shape:?}; known: sphere, torus"))),
    };
    let uv = rows::<2>(&uv)?;
    let points: Vec<SurfacePoint> = run(py, None, |_| {
        let point = |&[u, v]: &[f64; 2]| {
            if torus { torus_point(radii.0, radii.1, u, v) } else { sphere_point(radii.0, u, v) }
        };
        Ok::<_, std::convert::Infallible>(uv.iter().map(point).collect())
    })?;
    let make = |pick: fn(&SurfacePoint) -> DVec3| vectors(py, points.iter().map(pick));
    Ok([
        make(|p| p.position)?,
        make(|p| p.normal)?,
        make(|p| p.dpdu)?,
        make(|p| p.dpdv)?,
        make(|p| p.dndu)?,
        make(|p| p.dndv)?,
    ])
}

/// Bent normals by one of the formulas of `render::surface`; `bend` and `rise` count for `"exact"` alone.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one flat call from the Python facade")]
pub fn bend_normals<'py>(
    py: Python<'py>,
    formula: &str,
    normals: PyReadonlyArray2<'py, f64>,
    dpdu: PyReadonlyArray2<'py, f64>,
    dpdv: PyReadonlyArray2<'py, f64>,
    dndu: PyReadonlyArray2<'py, f64>,
    dndv: PyReadonlyArray2<'py, f64>,
    slopes: PyReadonlyArray2<'py, f64>,
    rise: PyReadonlyArray1<'py, f64>,
) -> PyResult<Vectors<'py>> {
    type Formula = fn(&SurfaceFrame, [DVec3; 2], DVec2, f64) -> DVec3;
    let formula: Formula = match formula {
        "orthogonal" => |frame, _, slope, _| perturb_orthogonal(frame, slope),
        "general" => |frame, _, slope, _| perturb_general(frame, slope),
        "blinn" => |frame, _, slope, _| perturb_blinn(frame, slope),
        "exact" => perturb_exact,
        _ => return Err(PyValueError::new_err(format!("unknown formula {formula:?}"))),
    };
    let (normals, dpdu, dpdv) = (rows::<3>(&normals)?, rows::<3>(&dpdu)?, rows::<3>(&dpdv)?);
    let (dndu, dndv, slopes) = (rows::<3>(&dndu)?, rows::<3>(&dndv)?, rows::<2>(&slopes)?);
    let rise = rise.as_slice()?;
    let count = normals.len();
    if [dpdu.len(), dpdv.len(), dndu.len(), dndv.len(), slopes.len(), rise.len()] != [count; 6] {
        return Err(PyValueError::new_err(format!("arrays of different lengths; {count} normals")));
    }
    let bent: Vec<DVec3> = run(py, None, |_| {
        let at = |i: usize| {
            let frame =
                SurfaceFrame { dpdu: dpdu[i].into(), dpdv: dpdv[i].into(), normal: normals[i].into() };
            formula(&frame, [dndu[i].into(), dndv[i].into()], slopes[i].into(), rise[i])
        };
        Ok::<_, std::convert::Infallible>((0..count).map(at).collect())
    })?;
    vectors(py, bent.into_iter())
}
