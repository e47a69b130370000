//! The independent judge of hits, for the stress suite.

use compare::judge::Judge;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::field::parse_wrap;
use crate::run::run;

type Column<'py> = Bound<'py, PyArray1<f64>>;

/// Judges `(N,)` reported ray parameters (not finite: no hit) of `(N, 3)` rays that go down on `(H, W)`
/// heights, without any code of the searches. Four `(N,)` arrays: true ray parameter (NaN: too many cells to
/// tell), height of the reported point above the surface, depth of what was skipped before it, and the height
/// change a unit of the ray parameter there.
#[pyfunction]
pub fn judge<'py>(
    py: Python<'py>,
    heights: PyReadonlyArray2<'py, f32>,
    wrap: &str,
    origins: PyReadonlyArray2<'py, f64>,
    directions: PyReadonlyArray2<'py, f64>,
    reported: PyReadonlyArray1<'py, f64>,
) -> PyResult<(Column<'py>, Column<'py>, Column<'py>, Column<'py>)> {
    let wrap = parse_wrap(wrap)?;
    let [height, width] = [heights.shape()[0], heights.shape()[1]];
    let rays = reported.len();
    if origins.shape() != [rays, 3] || directions.shape() != [rays, 3] || width * height == 0 {
        return Err(PyValueError::new_err(format!(
            "{rays} results on {height} x {width} heights, but rays {:?} and {:?}",
            origins.shape(),
            directions.shape()
        )));
    }
    let judge = Judge { texels: heights.as_slice()?, width, height, wrap };
    let (o, d, t) = (origins.as_slice()?, directions.as_slice()?, reported.as_slice()?);
    let verdicts = run(py, None, |_| Ok::<_, compare::CompareError>(judge.verdicts(o, d, t)))?;
    let column = |pick: fn(&compare::judge::Verdict) -> f64| {
        PyArray1::from_vec(py, verdicts.iter().map(pick).collect())
    };
    Ok((column(|v| v.t), column(|v| v.gap), column(|v| v.skipped), column(|v| v.rate)))
}
