"""Searches under stress: hits before an independent judge, and symmetries that every search must keep."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._stress_cases import RayCase
from ._stress_rows import Check, failed, row
from .errors import BumpWarning
from .heightmap import HeightMap
from .techniques import Technique

__all__ = ["GUARANTEED", "march_checks"]

#: Searches that promise the first hit of the bilinear surface.
GUARANTEED = ("cone", "relaxed_cone", "distance", "exact")
EPSILON = float(np.finfo(np.float32).eps) / 2
#: Backward error of a promised hit: height off the surface over what rounding the ray to 32 bits does.
MOST_ULPS = 24.0
#: Depth of a dive below the surface, heights, that a search which promises the first hit may pass over:
#: 32 bits cannot tell shallower ones from a near pass.
MOST_SKIPPED = 1e-4
#: Texels between lid and floor up to which a promised hit must be found; beyond, "unconverged" will do. The
#: device's searches take fewer steps, lest a driver lose patience.
MOST_TEXELS = {"cpu": 1 << 20, "gpu": 1 << 15}
#: Share of rays that a symmetry may change: those that rounding moves across an edge.
MOST_CHANGED = 0.02

March = Callable[..., Any]


def march_checks(march: March, technique: Technique, case: RayCase, device: str) -> Iterator[Check]:
    """Runs one search on one case; yields what was found."""
    try:
        hits = _run(march, technique, case.height_map, case.origins, case.directions, case.dtype, device)
    except Exception as error:  # a fault in what is tested must become a line in the table
        yield failed("runs", f"{type(error).__name__}: {error}")
        return
    t, status, z = (np.asarray(getattr(hits, name), np.float64) for name in ("t", "status", "z"))
    guaranteed = technique.name in GUARANTEED
    yield _answers(case, t, status, MOST_TEXELS[device] if guaranteed else 0)
    found = (status == 0) & np.isfinite(t)
    outside = np.where(found, np.maximum(z - 1.0, -z), 0.0)
    yield _worst(case, "inside the relief", outside, "heights", 4 * EPSILON)
    along = case.origins[:, 2] + np.where(found, t, 0.0) * case.directions[:, 2]
    scale = np.abs(case.origins[:, 2]) + np.abs(np.where(found, t, 0.0) * case.directions[:, 2]) + 1.0
    yield _worst(case, "on the ray", np.where(found, np.abs(z - along) / (scale * EPSILON), 0.0), "ulps", 8.0)
    if guaranteed:
        yield from _judged(case, t, status)
    elif case.name.startswith("flat 0.5"):
        yield _worst(
            case, "flat ground", np.where(found, np.abs(along - 0.5), 0.0), "heights", _flat_limit(technique)
        )
    yield from _symmetries(march, technique, case, t, device)


def _run(
    march: March,
    technique: Technique,
    height_map: HeightMap,
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
    dtype: Any,
    device: str,
) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BumpWarning)
        return march(
            height_map,
            origins.astype(dtype),
            directions.astype(dtype),
            technique,
            device=device,
            outputs=("t", "z", "status"),
        )


def _answers(case: RayCase, t: NDArray[Any], status: NDArray[Any], most_texels: int) -> Check:
    """Whether each answer is one: a hit with a place, or none without; none given up within some texels."""
    bad = ~np.isin(status, (0, 1, 2)) | ((status == 0) != np.isfinite(t)) | np.isnan(t)
    rows, columns = case.height_map.shape
    run = np.hypot(case.directions[:, 0] * columns, case.directions[:, 1] * rows)
    bad |= (status == 2) & (run / np.abs(case.directions[:, 2]) < most_texels)
    check = _worst(case, "answers", bad.astype(float), "rays", 0.0)
    return {**check, "worst": float(bad.sum())}


def _judged(case: RayCase, t: NDArray[np.float64], status: NDArray[np.float64]) -> Iterator[Check]:
    """Against the judge, which shares no code with the searches."""
    truth, gap, skipped, rate = _bumpwgpu.judge(
        case.height_map.array,
        case.height_map.wrap,
        np.ascontiguousarray(case.origins),
        np.ascontiguousarray(case.directions),
        t,
    )
    known = ~np.isnan(truth)
    finite = np.isfinite(t)
    # What rounding origin, direction and t to 32 bits does to the height over the surface.
    unit = EPSILON * (1.0 + np.abs(np.where(finite, t, 0.0)) * rate)
    ulps = np.where(known & finite, np.abs(gap) / unit, 0.0)
    yield _worst(case, "on the surface", ulps, "ulps", MOST_ULPS)
    deep = np.where(known & (status != 2), skipped - MOST_ULPS * unit, 0.0)
    yield _worst(case, "nothing skipped", np.maximum(deep, 0.0), "heights", MOST_SKIPPED)
    rows, columns = case.height_map.shape
    run = np.hypot(case.directions[:, 0] * columns, case.directions[:, 1] * rows)
    both = known & finite & np.isfinite(truth)
    texels = np.where(both, np.abs(t - np.where(both, truth, 0.0)) * run, 0.0)
    median = float(np.median(texels[both])) if both.any() else 0.0
    yield {**_worst(case, "error", texels, "texels", np.inf), "median": median}


def _flat_limit(technique: Technique) -> float:
    """How far off flat ground at half height a search may end, by its own recipe."""
    values = technique.parameters
    layers = values.get("linear", values.get("steps", values.get("min_steps", 1)))
    rounding = 8.0 * EPSILON
    if technique.name == "relief":
        return 2.0 ** -values["refine"] / layers + rounding
    if technique.name == "binary":
        return 2.0 ** -values["steps"] + rounding
    if technique.name in ("pom", "interval", "parallax"):
        return rounding
    if technique.name.startswith("steep"):
        # The last of growing layers is the thickest.
        return (4.0 if technique.name == "steep_exponential" else 1.0) / layers + rounding
    return 0.5


def _symmetries(
    march: March, technique: Technique, case: RayCase, t: NDArray[np.float64], device: str
) -> Iterator[Check]:
    heights = case.height_map
    if case.group in ("grazing", "map") and heights.wrap in ("repeat", "mirror"):
        shift = np.array([6.0, -4.0, 0.0])
        yield _same(march, technique, case, t, device, "whole tiles", heights, case.origins + shift, None)
    if case.group in ("grazing", "map"):
        turned = HeightMap(
            heights.array[:, ::-1].copy(),
            scale=heights.scale,
            base=heights.base,
            tile_size=heights.tile_size,
            wrap=heights.wrap,
        )
        flip = np.array([-1.0, 1.0, 1.0])
        origins = case.origins * flip + np.array([1.0, 0.0, 0.0])
        yield _same(march, technique, case, t, device, "mirrored", turned, origins, case.directions * flip)
    if case.group == "length":
        yield _same(
            march, technique, case, t * 8.0, device, "longer rays", heights, None, case.directions / 8.0
        )
    if case.group == "offset" and case.dtype is np.float32:
        yield _same(march, technique, case, t, device, "f64 input", heights, None, None)


def _same(
    march: March,
    technique: Technique,
    case: RayCase,
    t: NDArray[np.float64],
    device: str,
    name: str,
    height_map: HeightMap,
    origins: NDArray[np.float64] | None,
    directions: NDArray[np.float64] | None,
) -> Check:
    """Share of rays for which an equal question has another answer, by a hundredth of a texel."""
    start = case.origins if origins is None else origins
    along = case.directions if directions is None else directions
    try:
        other = _run(march, technique, height_map, start, along, np.float64, device)
    except Exception as error:  # as above
        return failed(name, f"{type(error).__name__}: {error}")
    again = np.asarray(other.t, np.float64)
    rows, columns = case.height_map.shape
    run = np.hypot(along[:, 0] * columns, along[:, 1] * rows) + np.abs(along[:, 2])
    both = np.isfinite(t) & np.isfinite(again)
    with np.errstate(invalid="ignore"):
        change = np.where(both, np.abs(t - again) * run, (np.isfinite(t) != np.isfinite(again)) * 1e9)
    # Grazing rays cross many texels in one step of 32-bit rounding.
    allowed = 0.01 + 64.0 * EPSILON * np.where(both, np.abs(t) * run, 0.0)
    changed = change > allowed
    check = _worst(case, name, np.where(changed, change, 0.0), "share of rays", MOST_CHANGED)
    return {**check, "worst": float(changed.mean()), "passed": bool(changed.mean() <= MOST_CHANGED)}


def _worst(case: RayCase, name: str, values: NDArray[np.float64], unit: str, limit: float) -> Check:
    values = np.where(np.isnan(values), np.inf, values)
    at = int(values.argmax())
    worst = float(values[at])
    where = ""
    if worst > 0.0:
        origin, direction = case.origins[at], case.directions[at]
        place = ", ".join(f"{part:.9g}" for part in origin)
        way = ", ".join(f"{part:.9g}" for part in direction)
        where = f"ray {at}: ({place}) + t ({way})"
    return row(name, worst, unit, limit, where)
