"""Tangent frames under stress: degenerate, mirrored, tiny, huge and needle-shaped charts."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._stress_rows import Check, row
from .errors import BumpWarning

__all__ = ["frame_cases", "frame_checks"]

Case = tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]

#: Degrees between a tangent and dP/du of a triangle that has it. Methods with a frame for each triangle keep
#: to it but for 32 bits: measured 0.04, and 6.7 for the one whose frame is turned from the face to the smooth
#: normal. Those that mix neighbours differ by what neighbours do, here 14, and those that take the tangent
#: across the bitangent by half the shear besides, here 54: but by no quarter of a turn. "axis" does not look
#: at UVs.
MOST_TURNED = {
    "dietrich": 0.1, "split": 0.1, "derivative": 10.0, "mikktspace": 30.0, "averaged": 30.0, "edge": 70.0,
    "uv_gradient": 70.0,
}  # fmt: skip
#: Up to which of these a method has a frame for each triangle.
_OWN = 10.0
#: Charts whose neighbours have nothing to do with each other.
_TORN = ("random UVs", "some UVs equal")
#: Share of a square on its longest edge below which the area of a triangle in UV says nothing in 32 bits.
_LEAST_AREA = 1e-5


def frame_cases(seed: int) -> dict[str, Case]:
    """Positions, triangles and UVs by name."""
    rng = np.random.default_rng(seed + 2)
    flat, faces, uv = _grid(5)
    bumpy = flat + np.stack([np.zeros(len(flat))] * 2 + [0.2 * rng.random(len(flat))], axis=1)
    mirrored = np.where(uv[:, :1] > 0.5, np.stack([1.0 - uv[:, 0], uv[:, 1]], axis=1), uv)
    needle = flat * np.array([1.0, 1e-5, 1.0])
    return {
        "regular": (bumpy, faces, uv),
        "mirrored": (bumpy, faces, mirrored),
        "all UVs equal": (bumpy, faces, np.full_like(uv, 0.25)),
        "UVs on a line": (bumpy, faces, np.stack([uv[:, 0], np.zeros(len(uv))], axis=1)),
        "some UVs equal": (bumpy, faces, np.where(rng.random((len(uv), 1)) < 0.3, 0.5, uv)),
        "needle triangles": (needle, faces, uv),
        "needle UVs": (bumpy, faces, uv * np.array([1.0, 1e-5])),
        "tiny mesh": (bumpy * 1e-6, faces, uv),
        "huge mesh": (bumpy * 1e6, faces, uv),
        "far from the origin": (bumpy + 1e4, faces, uv),
        "huge UVs": (bumpy, faces, uv * 1e6),
        "tiny UVs": (bumpy, faces, uv * 1e-6),
        "UVs far away": (bumpy, faces, uv + 1000.0),
        "random UVs": (bumpy, faces, rng.random(uv.shape)),
        "sheared UVs": (bumpy, faces, uv @ np.array([[1.0, 0.0], [0.999, 0.01]])),
    }


def _grid(side: int) -> Case:
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    positions = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    at = np.arange(side * side).reshape(side, side)
    lower = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, :-1]], axis=-1).reshape(-1, 3)
    upper = np.stack([at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 3)
    return positions, np.concatenate([lower, upper]), np.stack([x.ravel(), 1.0 - y.ravel()], axis=1)


def frame_checks(tangents: Callable[..., Any], method: str, name: str, case: Case) -> Iterator[Check]:
    """Frames of one method on one mesh: finite, of unit length, upright, of the right hand."""
    positions, faces, uv = case
    normals = _vertex_normals(positions, faces)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", BumpWarning)
            made = tangents(positions, faces, uv, normals, method)
    except Exception as error:  # a fault in what is tested must become a line in the table
        yield _row("runs", np.array([np.inf]), "errors", 0.0, f"{type(error).__name__}: {error}")
        return
    found = np.asarray(made.tangents, np.float64)
    yield _row("finite", (~np.isfinite(found)).any(axis=1).astype(float), "vertices", 0.0)
    length = np.linalg.norm(found[:, :3], axis=1)
    yield _row("unit length", np.abs(length - 1.0), "length", 1e-4)
    upright = np.abs((found[:, :3] * normals[np.asarray(made.source)]).sum(axis=1))
    yield _row("upright", np.degrees(np.arcsin(np.clip(upright, 0.0, 1.0))), "degrees", 0.05)
    yield _row("handedness is 1 or -1", np.abs(np.abs(found[:, 3]) - 1.0), "value", 0.0)
    yield from _turned(method, name, case, normals, made)
    yield _condition(positions, faces, uv)


def _turned(method: str, name: str, case: Case, normals: NDArray[np.float64], made: Any) -> Iterator[Check]:
    """Whether tangents point along u and frames are of the hand of their charts, corner by corner.

    Against dP/du of each triangle with an area in UV, laid into the tangent plane of its corners.
    """
    positions, faces, uv = case
    along, area = _spans(positions, faces, uv)
    known = np.abs(area) > _LEAST_AREA
    if method not in MOST_TURNED or not known.any():
        return
    corners = np.asarray(made.indices, np.int64)[known]
    frames, up = np.asarray(made.tangents, np.float64)[corners], normals[np.asarray(made.source)[corners]]
    # With v down, charts that are not mirrored run clockwise.
    wrong = frames[..., 3] != -np.sign(area[known])[:, None]
    yield _row("hand of the chart", wrong.any(axis=1).astype(float), "triangles", 0.0, what="triangle")
    flat = along[known][:, None, :]
    flat = flat - up * (flat * up).sum(axis=-1, keepdims=True)
    flat /= np.maximum(np.linalg.norm(flat, axis=-1, keepdims=True), 1e-300)
    # Sharp for small angles too.
    apart = np.linalg.norm(frames[..., :3] - flat, axis=-1)
    angle = np.degrees(2.0 * np.arcsin(np.clip(0.5 * apart, 0.0, 1.0)))
    most = MOST_TURNED[method]
    if name in _TORN and most > _OWN:
        most = np.inf
    yield _row("along u", angle.max(axis=1), "degrees", most, what="triangle")


def _spans(
    positions: NDArray[np.float64], faces: NDArray[np.int64], uv: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """dP/du of each triangle, of any length, and its area in UV over that of a square on its longest edge."""
    a, b, c = (faces[:, corner] for corner in range(3))
    (du, dv), (eu, ev) = (uv[b] - uv[a]).T, (uv[c] - uv[a]).T
    along = (positions[b] - positions[a]) * ev[:, None] - (positions[c] - positions[a]) * dv[:, None]
    longest = np.maximum(np.maximum(du * du + dv * dv, eu * eu + ev * ev), 1e-300)
    area = du * ev - dv * eu
    return along * np.sign(area)[:, None], area / longest


def _vertex_normals(positions: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    a, b, c = (positions[faces[:, corner]] for corner in range(3))
    face = np.cross(b - a, c - a)
    face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-300)
    normals = np.zeros_like(positions)
    for corner in range(3):
        np.add.at(normals, faces[:, corner], face)
    normals[np.linalg.norm(normals, axis=1) == 0.0] = (0.0, 0.0, 1.0)
    unit: NDArray[np.float64] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return unit


def _condition(positions: NDArray[np.float64], faces: NDArray[np.int64], uv: NDArray[np.float64]) -> Check:
    """Largest condition number of the frames dP/du, dP/dv of the triangles: reported, not judged."""
    a, b, c = (faces[:, corner] for corner in range(3))
    edges = np.stack([positions[b] - positions[a], positions[c] - positions[a]], axis=-1)
    turned = np.stack([uv[b] - uv[a], uv[c] - uv[a]], axis=-1)
    flat = np.abs(np.linalg.det(turned)) > 0.0
    if not flat.any():
        return _row("condition number", np.array([np.inf]), "ratio", np.inf, "no triangle has an area in UV")
    spans = np.linalg.svd(edges[flat] @ np.linalg.inv(turned[flat]), compute_uv=False)
    with np.errstate(divide="ignore"):
        return _row("condition number", spans[:, 0] / spans[:, 1], "ratio", np.inf, what="triangle")


def _row(
    name: str,
    values: NDArray[np.float64],
    unit: str,
    limit: float,
    where: str | None = None,
    what: str = "vertex",
) -> Check:
    values = np.where(np.isnan(values), np.inf, values)
    at = int(values.argmax())
    worst = float(values[at])
    place = f"{what} {at}" if where is None and worst > 0.0 else (where or "")
    return row(name, worst, unit, limit, place)
