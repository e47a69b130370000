"""Normals of sphere and torus under a relief, against the displaced surface by differences of its points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw
from bumpwgpu import surfaces

Floats = NDArray[np.float64]
SCALE, BASE = 0.06, 1.0
SHAPES: dict[str, Callable[[Floats], surfaces.SurfacePoints]] = {
    "sphere": surfaces.sphere,
    "torus": surfaces.torus,
}


def waves(u: Floats, v: Floats) -> Floats:
    return np.asarray(0.5 + 0.35 * np.sin(6 * np.pi * u) * np.sin(8 * np.pi * v))


def waves_with_slopes(u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
    du = 0.35 * 6 * np.pi * np.cos(6 * np.pi * u) * np.sin(8 * np.pi * v)
    dv = 0.35 * 8 * np.pi * np.sin(6 * np.pi * u) * np.cos(8 * np.pi * v)
    return waves(u, v), du, dv


def places() -> Floats:
    rng = np.random.default_rng(3)
    return np.column_stack((rng.random(4000), rng.uniform(0.12, 0.88, 4000)))


def true_normals(shape: str, uv: Floats) -> Floats:
    """Cross product of central differences of the displaced points: knows no formula."""

    def displaced(at: Floats) -> Floats:
        points = SHAPES[shape](at)
        rise = SCALE * (waves(at[:, 0], at[:, 1]) - BASE)
        return np.asarray(points.position + rise[:, None] * points.normal)

    step = 1e-5
    right, down = np.array([[step, 0.0], [0.0, step]])
    along_u = displaced(uv + right) - displaced(uv - right)
    along_v = displaced(uv + down) - displaced(uv - down)
    cross = np.cross(along_v, along_u)
    return np.asarray(cross / np.linalg.norm(cross, axis=1, keepdims=True))


def degrees(a: Floats, b: Floats) -> Floats:
    apart, together = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    return np.asarray(np.degrees(2 * np.arctan2(apart, together)))


# The largest and the smallest mean error, degrees, on sphere and torus; measured values in docs/bump.md.
MEANS = {
    ("exact", "analytic"): (0.0, 1e-7),
    ("exact", "central"): (0.0, 1e-4),
    ("exact", "forward"): (0.005, 0.2),
    ("general", "central"): (0.4, 1.2),
    ("blinn", "central"): (0.4, 1.2),
    ("orthogonal", "central"): (0.4, 1.2),
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("formula", "differences"), MEANS)
def test_error_against_displacement(shape: str, formula: str, differences: str) -> None:
    uv = places()
    analytic = differences == "analytic"
    found = surfaces.bump_normals(
        SHAPES[shape](uv),
        uv,
        waves_with_slopes if analytic else waves,
        scale=SCALE,
        base=BASE,
        formula=formula,
        differences="central" if analytic else differences,
        step=1e-3 if differences == "forward" else 1e-5,
    )
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-12)
    angle = degrees(found, true_normals(shape, uv))
    low, high = MEANS[formula, differences]
    print(f"{shape} {formula} {differences}: mean {angle.mean():.6f}, max {angle.max():.4f}")
    # The reference itself is good to 1e-6 degrees.
    assert low <= angle.mean() <= high + 1e-6


def test_shear_tells_the_orthogonal_formula_from_the_general_one() -> None:
    """The plane z = 0.4 x - 0.2 y over a sheared map has one normal everywhere."""
    uv = places()

    def everywhere(*vector: float) -> Floats:
        return np.tile(np.array(vector), (len(uv), 1))

    zero = everywhere(0, 0, 0)
    axes = everywhere(1.5, 0.4, 0), everywhere(0.5, -0.7, 0)
    points = surfaces.SurfacePoints(zero, everywhere(0, 0, 1), *axes, zero, zero)

    def plane(u: Floats, v: Floats) -> Floats:
        return np.asarray(0.4 * (1.5 * u + 0.5 * v) - 0.2 * (0.4 * u - 0.7 * v))

    truth = everywhere(-0.4, 0.2, 1) / np.sqrt(1.2)
    for formula in surfaces.FORMULAS:
        angle = degrees(surfaces.bump_normals(points, uv, plane, scale=1.0, formula=formula), truth)
        assert (angle.max() < 1e-6) == (formula != "orthogonal")
        assert formula != "orthogonal" or angle.min() > 4


def test_points_are_those_of_the_meshes() -> None:
    for mesh, shape in ((bw.Mesh.sphere(0.5, 24), "sphere"), (bw.Mesh.torus(0.7, 0.3, 24, 12), "torus")):
        points = SHAPES[shape](mesh.uvs.astype(np.float64))
        np.testing.assert_allclose(points.position, mesh.positions, atol=1e-6)
        np.testing.assert_allclose(points.normal, mesh.normals, atol=1e-6)
        np.testing.assert_allclose(points.dpdv, mesh.dpdv, atol=1e-5)


def test_any_function_is_a_height_map() -> None:
    sampled = bw.HeightMap.from_function(waves, (64, 32), scale=0.2, wrap="mirror")
    assert sampled.shape == (32, 64)
    assert (sampled.scale, sampled.wrap) == (0.2, "mirror")
    u, v = (np.arange(64) + 0.5) / 64, (np.arange(32) + 0.5) / 32
    np.testing.assert_allclose(sampled.array, waves(u[None], v[:, None]), atol=1e-6)
    assert bw.HeightMap.from_function(lambda u, v: 0.25, 4).array.tolist() == [[0.25] * 4] * 4


UV = np.array([[0.5, 0.5]])
BALL: dict[str, Any] = {"points": None, "uv": UV, "height": waves}


def bend(**changes: Any) -> Callable[[], Any]:
    return lambda: surfaces.bump_normals(**{**BALL, "points": surfaces.sphere(UV), **changes})


REFUSED: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "formula": (bend(formula="nope"), ValueError, "exact"),
    "differences": (bend(differences="sideways"), ValueError, "central"),
    "step": (bend(step=0), ValueError, "positive"),
    "height": (bend(height=3), TypeError, "function"),
    "NaN": (bend(height=lambda u, v: u * np.nan), ValueError, "NaN"),
    "shape": (bend(height=lambda u, v: 0.5), ValueError, "one number a point"),
    "two": (bend(height=lambda u, v: (u, v)), ValueError, "2 arrays"),
    "uv": (bend(uv=np.zeros((2, 2))), ValueError, "1 points for 2"),
    "sphere": (lambda: surfaces.sphere(UV, 0), ValueError, "radius"),
    "sphere uv": (lambda: surfaces.sphere([[np.inf, 0]]), ValueError, "infinity"),
    "torus": (lambda: surfaces.torus([[0, 0, 0]]), ValueError, r"\(N, 2\)"),
    "no function": (lambda: bw.HeightMap.from_function("sin"), TypeError, "function"),  # type: ignore[arg-type]
    "range": (lambda: bw.HeightMap.from_function(lambda u, v: u + v), ValueError, "0..1"),
    "no plane": (lambda: bw.HeightMap.from_function(lambda u, v: np.zeros(3), 4), ValueError, "broadcast"),
    "hole": (lambda: bw.HeightMap.from_function(lambda u, v: u * np.nan, 4), ValueError, "NaN"),
    "text": (lambda: bw.HeightMap.from_function(lambda u, v: np.array("a"), 4), TypeError, "numbers"),
    "size": (lambda: bw.HeightMap.from_function(waves, 0), ValueError, "size"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    call, kind, message = REFUSED[name]
    with pytest.raises(kind, match=message):
        call()
