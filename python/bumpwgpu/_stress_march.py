"""Searches under stress: hits before an independent judge, and symmetries that every search must keep."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._stress_cases import RayCase
from ._stress_recipes import RECIPES, follow
from ._stress_rows import Check, failed, row
from ._stress_surface import gradients
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

#: Roundings to 32 bits between t and uv: of t, the direction, the product, the origin and the sum, each seen
#: against the sum of their magnitudes; and one for the way back.
MOST_ULPS_UV = 6.0
#: Texels that rounding may move uv by before its normal is no longer looked at.
MOST_BLUR = 0.05
#: Degrees that a normal may be off besides: its three numbers have 24 bits, as have the differences of
#: heights it is made of.
MOST_DEGREES = 1e-3

March = Callable[..., Any]


def march_checks(march: March, technique: Technique, case: RayCase, device: str) -> Iterator[Check]:
    """Runs one search on one case; yields what was found."""
    try:
        hits = _run(march, technique, case.height_map, case.origins, case.directions, case.dtype, device)
        uv, normal = (np.asarray(getattr(hits, name), np.float64) for name in ("uv", "normal"))
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
    yield _places(case, np.where(found, t, 0.0), np.where(found[:, None], uv, case.origins[:, :2]))
    yield _normals(case, np.where(found[:, None], uv, 0.0), np.where(found[:, None], normal, np.nan))
    if guaranteed:
        yield from _judged(case, t, status)
    if technique.name in RECIPES:
        yield _by_recipe(march, technique, case, t, device)
    if not guaranteed and case.name.startswith("flat 0.5"):
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
            outputs=("t", "uv", "z", "normal", "status"),
        )


def _places(case: RayCase, t: NDArray[np.float64], uv: NDArray[np.float64]) -> Check:
    """Whether uv is the point of the ray at t, in roundings to 32 bits of what was added up."""
    run = t[:, None] * case.directions[:, :2]
    unit = EPSILON * (np.abs(case.origins[:, :2]) + np.abs(run) + np.abs(uv))
    off = np.abs(uv - (case.origins[:, :2] + run)) / np.maximum(unit, 1e-300)
    return _worst(case, "uv on the ray", off.max(axis=1), "ulps", MOST_ULPS_UV)


def _normals(case: RayCase, uv: NDArray[np.float64], normal: NDArray[np.float64]) -> Check:
    """Degrees between a normal and that of the bilinear surface at uv, or of a cell that rounding reaches."""
    rows, columns = case.height_map.shape
    size = np.array([columns, rows])
    at = uv * size - 0.5
    reach = 8.0 * EPSILON * (np.abs(uv) + np.abs(case.origins[:, :2]) + 1.0) * size
    best = np.full(len(uv), np.inf)
    for step in itertools.product((-1.0, 0.0, 1.0), repeat=2):
        x, y = (at + step * reach).T
        gradient = np.stack(gradients(case.height_map, x, y), axis=-1) * size
        truth = np.concatenate([-gradient, np.ones((len(uv), 1))], axis=-1)
        truth /= np.linalg.norm(truth, axis=-1, keepdims=True)
        chord = np.linalg.norm(normal - truth, axis=-1)
        best = np.fmin(best, np.degrees(2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0))))
    # Where a texel is not much more than what rounding reaches, uv says nothing about the cell.
    known = (reach.max(axis=1) < MOST_BLUR) & ~np.isnan(normal).all(axis=1)
    # Within a cell the slope changes by no more than the relief over the reach, on either axis.
    blur = np.degrees(2.0 * reach.max(axis=1) * size.max())
    return _worst(case, "normal", np.where(known, np.maximum(best - blur, 0.0), 0.0), "degrees", MOST_DEGREES)


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

    def judge(origins: NDArray[np.float64], directions: NDArray[np.float64], t: NDArray[np.float64]) -> Any:
        rays = np.ascontiguousarray(origins), np.ascontiguousarray(directions)
        return _bumpwgpu.judge(case.height_map.array, case.height_map.wrap, *rays, t)

    truth, gap, skipped, rate = judge(case.origins, case.directions, t)
    # Rounding may take a place over the side of its cell, and the height changes as fast as on the steeper
    # one.
    found = np.flatnonzero(np.isfinite(t))
    for beside in (1.0 - MOST_ULPS * EPSILON, 1.0 + MOST_ULPS * EPSILON):
        ways = case.directions[found]
        places = case.origins[found] + (t[found] * beside)[:, None] * ways
        rate[found] = np.fmax(rate[found], judge(places, ways, np.zeros(len(found)))[3])
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


def _by_recipe(
    march: March, technique: Technique, case: RayCase, t: NDArray[np.float64], device: str
) -> Check:
    """Share of rays whose answer is not that of the recipe in double precision."""
    change, changed = np.full(len(t), np.inf), np.ones(len(t), bool)
    for truth, allowed in follow(technique, case):
        off = np.where(np.isfinite(t), np.abs(t - truth), np.inf)
        change, changed = np.fmin(change, off), changed & (off > allowed)
    if changed.mean() > MOST_CHANGED:
        changed &= _well_posed(march, technique, case, t, device, allowed)
    check = _worst(case, "recipe", np.where(changed, change, 0.0), "share of rays", MOST_CHANGED)
    return {**check, "worst": float(changed.mean()), "passed": bool(changed.mean() <= MOST_CHANGED)}


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
    if case.group in ("grazing", "map"):
        # Who else is asked about must not matter: rays share lanes, bounds and blocks.
        yield _same(march, technique, case, t, device, "in reverse", heights, None, None, reverse=True)
    if case.group == "length":
        shorter = case.directions / 8.0
        yield _same(march, technique, case, t, device, "longer rays", heights, None, shorter, longer=8.0)
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
    reverse: bool = False,
    longer: float = 1.0,
) -> Check:
    """Share of rays for which an equal question has another answer, by a hundredth of a texel.

    `longer`: how many times t should be what it was.
    """
    start = case.origins if origins is None else origins
    along = case.directions if directions is None else directions
    order = slice(None, None, -1 if reverse else 1)
    # The same numbers again have to get the same answer, others may be rounded otherwise.
    dtype = case.dtype if reverse else np.float64
    most = 0.0 if reverse else MOST_CHANGED
    try:
        other = _run(march, technique, height_map, start[order], along[order], dtype, device)
    except Exception as error:  # as above
        return failed(name, f"{type(error).__name__}: {error}")
    again = np.asarray(other.t, np.float64)[order] / longer
    rows, columns = case.height_map.shape
    run = np.hypot(case.directions[:, 0] * columns, case.directions[:, 1] * rows)
    run += np.abs(case.directions[:, 2])
    both = np.isfinite(t) & np.isfinite(again)
    with np.errstate(invalid="ignore"):
        change = np.where(both, np.abs(t - again) * run, (np.isfinite(t) != np.isfinite(again)) * 1e9)
    # Grazing rays cross many texels in one step of 32-bit rounding.
    allowed = 0.01 + 64.0 * EPSILON * np.where(both, np.abs(t) * run, 0.0)
    changed = change > (0.0 if reverse else allowed)
    if changed.mean() > most and not reverse and technique.name not in GUARANTEED:
        # A search that promises no first hit may follow from its samples to another one when these move by a
        # rounding, and at the lowest angles each step is hundreds of texels long. Then the question itself
        # has no one answer in 32 bits: only rays count whose answer stays where it is under such moves.
        changed &= _well_posed(march, technique, case, t, device, 0.5 * allowed / run)
    check = _worst(case, name, np.where(changed, change, 0.0), "share of rays", most)
    return {**check, "worst": float(changed.mean()), "passed": bool(changed.mean() <= most)}


def _well_posed(
    march: March,
    technique: Technique,
    case: RayCase,
    t: NDArray[np.float64],
    device: str,
    allowed: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Rays whose t does not change by more than allowed when they move by two roundings of the places they
    pass.
    """
    passed = np.abs(case.origins[:, :2]) + np.abs(case.directions[:, :2] / case.directions[:, 2:])
    stays = np.ones(len(t), bool)
    for signs in itertools.product((-1.0, 1.0), repeat=2):
        origins = case.origins.copy()
        origins[:, :2] += 4.0 * EPSILON * passed * signs
        hits = _run(march, technique, case.height_map, origins, case.directions, np.float64, device)
        moved = np.asarray(hits.t, np.float64)
        both = np.isfinite(t) & np.isfinite(moved)
        with np.errstate(invalid="ignore"):
            change = np.where(both, np.abs(t - moved), (np.isfinite(t) != np.isfinite(moved)) * 1e300)
        stays &= change <= allowed
    return stays


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
