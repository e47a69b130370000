"""Bakes under stress: against formulas in double precision, brute force, and symmetries."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._map_info import MAPS
from ._stress_cases import WRAPS
from ._stress_mips import MIP_MAPS, mip_checks
from ._stress_rows import Check, failed, row
from ._stress_sky import SKY_MAPS, bounded, sky_checks, sky_texels
from ._stress_surface import folded, padded, surface
from .errors import BumpWarning
from .heightmap import HeightMap

__all__ = ["bake_checks", "cones"]

Bake = Callable[..., Any]
Heights = NDArray[np.float64]

#: Maps whose values a shift of a repeating map moves along and does not change.
_SHIFTING = ("normal", "normal_xy", "relief", "cone", "curvature", "horizon", "ao", "bent_normal")
#: Their first channel points along x, so that mirroring the map turns its sign.
_SIGNED = ("normal", "normal_xy", "relief", "bent_normal")
#: Scales of the relief a map is baked at, mesh units.
_SCALES = (1e-6, 0.1, 1e6)
_EPSILON = 2.0**-24
_TAPS = {
    "sobel3": ((1, 2, 1), 4.0),
    "scharr": ((3, 10, 3), 16.0),
    "prewitt": ((1, 1, 1), 3.0),
    "bilinear": ((1, 6, 1), 8.0),
    "central": ((0, 1, 0), 1.0),
}


def bake_checks(
    bake: Bake, name: str, heights: NDArray[np.float32], case: str
) -> Iterator[tuple[str, Check]]:
    """Bakes one map from heights in several ways; yields the case and what was found."""
    for wrap in WRAPS:
        # Pyramids and cones are of the heights alone.
        for scale in (0.1,) if name in ("pyramid", "cone", "relaxed_cone", "distance") else _SCALES:
            source = HeightMap(heights, scale=scale, wrap=wrap)
            label = f"{case}, {wrap}, scale {scale:g}"
            try:
                made = _bake(bake, source, name)
            except Exception as error:  # a fault in what is tested must become a line in the table
                yield label, failed("runs", f"{type(error).__name__}: {error}")
                continue
            for check in _of_one(bake, name, source, made):
                yield label, check


def _bake(bake: Bake, source: HeightMap, name: str, **options: Any) -> list[NDArray[np.float64]]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BumpWarning)
        made = bake(source, (name,), **options)[name]
    return [np.asarray(layer, np.float64) for layer in (made if isinstance(made, tuple | list) else (made,))]


def _of_one(bake: Bake, name: str, source: HeightMap, made: list[NDArray[np.float64]]) -> Iterator[Check]:
    yield _check("finite", [~np.isfinite(layer) for layer in made], "values", 0.0, np.sum)
    yield _range(name, made)
    if name in ("normal", "relief", "bent_normal", "normal_mips"):
        shortest = _lengths(name, made)
        yield _check("unit length", [np.abs(length - 1.0) for length in shortest], "length", 1e-5)
    if name in ("normal", "normal_xy", "relief"):
        yield from _normals(bake, name, source)
    if name in ("cone", "relaxed_cone"):
        yield cones(name, source, made[0])
    if name == "pyramid":
        yield from _pyramid(source, made)
    if name == "distance":
        yield _distances(source, made[0])
    if name == "curvature":
        yield _curvatures(source, made[0])
    if name in MIP_MAPS:
        yield from mip_checks(name, made, _true_normals(source, *_TAPS["sobel3"]), _lost(source))
    limit = 0.0
    if name in SKY_MAPS and source.scale == 0.1:
        normals = _true_normals(source, *_TAPS["sobel3"])
        for check, limit in sky_checks(name, source, made[0], normals):  # noqa: B007
            yield check
    if name in ("horizon", "ao") and np.ptp(source.array) == 0.0:
        flat = 1.0 if name == "ao" else 0.0
        yield _check("flat ground", [np.abs(layer - flat) for layer in made], "value", 1e-6)
    if name in _SHIFTING and source.scale == 0.1:
        yield from _symmetries(bake, name, source, made[0], limit)


def _range(name: str, made: list[NDArray[np.float64]]) -> Check:
    beyond = []
    for layer in made:
        parts = layer[..., None] if len(MAPS[name].channels) == 1 else layer
        for at, channel in enumerate(MAPS[name].channels):
            if channel.range is not None:
                low, high = channel.range
                beyond.append(np.maximum(parts[..., at] - high, low - parts[..., at]))
    # Directions may be longer than 1 by their rounding.
    slack = 1e-6 if name in (*_SIGNED, "normal_mips") else 0.0
    return _check("in range", beyond or [np.zeros(1)], "value", slack)


def _lengths(name: str, made: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    layers = made[:1] if name == "normal_mips" else made
    return [np.linalg.norm(layer[..., :3], axis=-1) for layer in layers]


def _normals(bake: Bake, name: str, source: HeightMap) -> Iterator[Check]:
    """Angle to what each kernel's formula gives in double precision, degrees, beyond that of rounding."""
    for kernel, taps in _TAPS.items():
        made = _bake(bake, source, name, kernel=kernel)[0]
        truth = _true_normals(source, *taps)
        if name == "normal_xy":
            z = np.sqrt(np.maximum(1.0 - (made**2).sum(axis=-1), 0.0))
            made = np.concatenate([made, z[..., None]], axis=-1)
        ours = made[..., :3]
        # Near the horizon z is small, and with x and y alone it cannot be told sharply.
        limit = 0.05 if name == "normal_xy" else 1e-3
        chord = np.linalg.norm(ours - truth, axis=-1)
        angle = np.degrees(2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))
        if name == "normal_xy":
            angle = np.where(
                truth[..., 2] > 0.02, angle, np.degrees(np.linalg.norm((ours - truth)[..., :2], axis=-1))
            )
        rounding = np.degrees(_lost(source) * truth[..., 2] ** 2)
        yield _check(f"formula, {kernel}", [np.maximum(angle - rounding, 0.0)], "degrees", limit)
    yield from _whole_numbers(bake, name, source)


def _whole_numbers(bake: Bake, name: str, source: HeightMap) -> Iterator[Check]:
    """Numbers of files: which is off by more than half of one, besides what 32 bits are off by before."""
    truth = _true_normals(source, *_TAPS["sobel3"])[..., : 2 if name == "normal_xy" else 3]
    for bits in (8, 16):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", BumpWarning)
            made = np.asarray(bake(source, (name,), dtype=f"uint{bits}")[name])
        most = 2.0**bits - 1.0
        slack = 0.5 * most * (np.radians(1e-3) + _lost(source))
        off = [np.abs(made[..., : truth.shape[-1]] - (0.5 + 0.5 * truth) * most)]
        if name == "relief":
            off.append(np.abs(made[..., 3] - source.array.astype(np.float64) * most))
        yield _check(f"numbers of {bits} bits", off, "numbers", 0.5 + slack)


def _lost(source: HeightMap) -> float:
    """Slope that eight roundings of sums below 2 to 32 bits amount to: what steep reliefs make of them."""
    rows, columns = source.shape
    steepest = source.scale * max(columns / source.tile_size[0], rows / source.tile_size[1])
    return 8.0 * _EPSILON * float(steepest)


def _true_normals(source: HeightMap, smoothing: tuple[int, int, int], total: float) -> Heights:
    heights = padded(source)
    rows, columns = source.shape
    near = {
        (i, j): heights[1 + j : 1 + j + rows, 1 + i : 1 + i + columns] for i in (-1, 0, 1) for j in (-1, 0, 1)
    }
    across = sum(smoothing[j + 1] * (near[1, j] - near[-1, j]) for j in (-1, 0, 1)) / (2.0 * total)
    downwards = sum(smoothing[i + 1] * (near[i, 1] - near[i, -1]) for i in (-1, 0, 1)) / (2.0 * total)
    wide, tall = source.tile_size
    x = -np.float64(np.float32(source.scale)) * across * columns / wide
    # Green points up the image, and rows count down it.
    y = np.float64(np.float32(source.scale)) * downwards * rows / tall
    normals = np.stack(np.broadcast_arrays(x, y, 1.0), axis=-1)
    unit: Heights = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    return unit


def _curvatures(source: HeightMap, made: NDArray[np.float64]) -> Check:
    """Against the shape operator of the quadric through each texel and its neighbours.

    In roundings to 32 bits of the curvatures, and to 64 of what they are the difference of.
    """
    heights = padded(source) * np.float64(np.float32(source.scale))
    rows, columns = source.shape
    near = {
        (i, j): heights[1 + j : 1 + j + rows, 1 + i : 1 + i + columns] for i in (-1, 0, 1) for j in (-1, 0, 1)
    }
    wide, tall = (side / texels for side, texels in zip(source.tile_size, (columns, rows), strict=True))
    p, q = (near[1, 0] - near[-1, 0]) / (2 * wide), (near[0, 1] - near[0, -1]) / (2 * tall)
    xx = (near[1, 0] - 2 * near[0, 0] + near[-1, 0]) / wide**2
    yy = (near[0, 1] - 2 * near[0, 0] + near[0, -1]) / tall**2
    xy = (near[1, 1] - near[-1, 1] - near[1, -1] + near[-1, -1]) / (4 * wide * tall)
    # I^-1 II of the first and second fundamental forms; bumps count as positive.
    area = 1 + p**2 + q**2
    first = np.stack([np.stack([1 + q**2, -p * q], -1), np.stack([-p * q, 1 + p**2], -1)], -1)
    second = -np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -1)
    shape = first @ second / area[..., None, None] ** 1.5
    truth = np.stack([np.trace(shape, axis1=-2, axis2=-1) / 2, (xx * yy - xy**2) / area**2], -1)
    largest = [
        (np.abs(first) @ np.abs(second)).sum((-2, -1)) / area**1.5,
        (np.abs(xx * yy) + xy**2) / area**2,
    ]
    # Sums of three heights cancel down to roundings of the heights, which were divided by texels squared.
    noise = 16 * np.finfo(np.float64).eps * np.abs(heights).max() / min(wide, tall) ** 2
    sides = (1 + p**2 + 1 + q**2) / area**1.5
    lost = [noise * sides, noise * (np.abs(xx) + np.abs(yy) + 2 * np.abs(xy) + noise) / area**2]
    allowed = 2 * _EPSILON * np.abs(truth) + 1e-14 * np.stack(largest, -1) + np.stack(lost, -1)
    # The least number of 32 bits.
    allowed += 2.0**-149
    return _check("formula", [np.abs(made - truth) / allowed], "roundings", 1.0)


def cones(name: str, source: HeightMap, ratios: NDArray[np.float64]) -> Check:
    """How far the surface reaches into cones that stand on points less than a texel from their centres.

    A cone of the map must be empty, a relaxed one may hold the surface only where that rises as the way
    leads out: a ray that entered there cannot come out again.
    """
    rng = np.random.default_rng(5)
    rows, columns = source.shape
    # Of large maps some texels, looked at closely near by and up to one and a half tiles away.
    texels = rng.permutation(rows * columns)[:256]
    row, column = np.unravel_index(texels, (rows, columns))
    turn = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
    near, far = np.linspace(0.0, 4.0 / max(rows, columns), 49)[1:], np.linspace(0.0, 1.5, 97)[1:]
    reach = np.unique(np.concatenate([near, far]))
    ratio = np.maximum(ratios[row, column][:, None], 1e-30)
    worst = np.zeros((rows, columns))
    for _ in range(2):
        u = (column + 0.5 + rng.uniform(-1.0, 1.0, len(column))) / columns
        v = (row + 0.5 + rng.uniform(-1.0, 1.0, len(row))) / rows
        low = surface(source, u, v)
        for angle in turn:
            away = np.cos(angle), np.sin(angle)
            along = surface(source, u[:, None] + away[0] * reach, v[:, None] + away[1] * reach)
            inside = along - low[:, None] - reach / ratio
            if name == "relaxed_cone":
                # Where it falls at the very place, whatever it does on the way to the next.
                on = reach + 1e-4 / max(rows, columns)
                falls = surface(source, u[:, None] + away[0] * on, v[:, None] + away[1] * on) < along
                inside = np.where(falls, inside, 0.0)
            worst[row, column] = np.maximum(worst[row, column], inside.max(axis=1))
    if name == "cone":
        worst[row, column] = np.maximum(worst[row, column], _touching(source, ratio[:, 0], row, column))
    return _check("conservative", [worst], "heights", 1e-6)


def _touching(
    source: HeightMap, ratio: Heights, row: NDArray[np.int64], column: NDArray[np.int64]
) -> NDArray[np.float64]:
    """How far texels reach into cones that stand on the texel and on its eight neighbours.

    Peaks are where cones touch, so a cone that is too wide by a little shows here first.
    """
    rows, columns = source.shape
    near = np.arange(-12, 13)
    dy, dx = (part.ravel() for part in np.meshgrid(near, near, indexing="ij"))
    apart = np.hypot(dx / columns, dy / rows)
    worst = np.full(len(row), -np.inf)
    heights = source.array.astype(np.float64)

    def height(y: NDArray[np.int64], x: NDArray[np.int64]) -> Heights:
        return heights[folded(y, rows, source.wrap), folded(x, columns, source.wrap)]

    for down, right in itertools.product((-1, 0, 1), repeat=2):
        y, x = row + down, column + right
        target = height(y[:, None] + dy, x[:, None] + dx)
        inside = target - height(y, x)[:, None] - apart / ratio[:, None]
        worst = np.maximum(worst, inside.max(axis=1))
    return worst


def _pyramid(source: HeightMap, made: list[NDArray[np.float64]]) -> Iterator[Check]:
    """Levels hold the least and the greatest of the heights below them."""
    heights = source.array.astype(np.float64)
    top = made[-1].reshape(-1, 2)
    off = [np.abs(top[:, 0].min() - heights.min()), np.abs(top[:, 1].max() - heights.max())]
    yield _check("top level", [np.array(off)], "heights", 0.0)
    # Each cell's four corners lie between its two numbers.
    rows, columns = made[0].shape[:2]
    wrapped = padded(source)
    corners = [wrapped[1 + j : 1 + j + rows, 1 + i : 1 + i + columns] for j in (0, 1) for i in (0, 1)]
    if all(part.shape == (rows, columns) for part in corners):
        above = [part - made[0][..., 1] for part in corners]
        below = [made[0][..., 0] - part for part in corners]
        yield _check("holds the cells", [*above, *below], "heights", 0.0)


def _distances(source: HeightMap, made: NDArray[np.float64]) -> Check:
    """How much longer a distance is than one to a point of the surface, mesh units."""
    rng = np.random.default_rng(6)
    depth, rows, columns = made.shape
    count = 4096
    k, j, i = rng.integers(0, depth, count), rng.integers(0, rows, count), rng.integers(0, columns, count)
    z = (k + rng.random(count)) / depth
    u, v = (i + rng.random(count)) / columns, (j + rng.random(count)) / rows
    near = np.full(count, np.inf)
    wide, tall = source.tile_size
    for _ in range(160):
        size = 10.0 ** rng.uniform(-3.0, 0.0, count)
        a, b = u + rng.normal(size=count) * size, v + rng.normal(size=count) * size
        rise = source.scale * (surface(source, a, b) - z)
        near = np.minimum(near, np.sqrt(((a - u) * wide) ** 2 + ((b - v) * tall) ** 2 + rise**2))
    # Points below the surface are none that a search stands on.
    over = z > surface(source, u, v)
    longer = np.where(over, made[k, j, i] - near, 0.0)
    return _check("lower bound", [longer], "mesh units", 1e-6)


def _symmetries(
    bake: Bake, name: str, source: HeightMap, made: NDArray[np.float64], limit: float
) -> Iterator[Check]:
    if source.wrap == "repeat" and min(source.shape) > 2:
        moved = _with(source, np.roll(source.array, (2, 3), (0, 1)))
        again = _bake(bake, moved, name)[0]
        if name == "horizon":
            place = sky_texels(_true_normals(moved, *_TAPS["sobel3"]))
            yield bounded("shifted", moved, again, place)
        else:
            yield _compared(name, source, "shifted", np.roll(again, (-2, -3), (0, 1)), made, limit)
    if name != "horizon":
        turned = _bake(bake, _with(source, source.array[:, ::-1]), name)[0][:, ::-1]
        if name in _SIGNED:
            turned = turned.copy()
            turned[..., 0] *= -1.0
        yield _compared(name, source, "mirrored", turned, made, limit)


def _compared(
    name: str,
    source: HeightMap,
    check: str,
    again: NDArray[np.float64],
    made: NDArray[np.float64],
    limit: float,
) -> Check:
    """Two bakes of equal maps: the worst value, or the mean where values are samples."""
    difference = np.abs(again - made)
    if name in SKY_MAPS:
        # Sweeps meet the texels of a shifted map between others of their lines: beside a lone spike that
        # changes single values, while a fault at the edge changes all along it. Where two bakes are each
        # within a limit of the truth in the mean, they are within two of each other.
        row = _check(check, [difference], "mean value", limit)
        mean = float(difference[sky_texels(_true_normals(source, *_TAPS["sobel3"]))].mean())
        return {**row, "worst": mean, "passed": mean <= limit}
    if name == "cone":
        # The widest cone is one number whichever way it was found: four roundings of ratios up to 1.
        return _check(check, [difference], "ratio", 4.0 * _EPSILON)
    largest = float(np.abs(made[np.isfinite(made)]).max(initial=0.0))
    return _check(check, [difference], "value", 4e-6 * max(1.0, largest))


def _with(source: HeightMap, heights: NDArray[np.float32]) -> HeightMap:
    return HeightMap(
        np.ascontiguousarray(heights),
        scale=source.scale,
        base=source.base,
        tile_size=source.tile_size,
        wrap=source.wrap,
    )


def _check(
    name: str,
    values: list[Any],
    unit: str,
    limit: float,
    total: Callable[..., Any] | None = None,
) -> Check:
    """The worst of several arrays, and where it is."""
    worst, where = 0.0, ""
    for number, part in enumerate(values):
        array = np.asarray(part, np.float64)
        array = np.where(np.isnan(array), np.inf, array)
        value = float(array.max(initial=0.0)) if total is None else float(total(array))
        if value > worst:
            at = np.unravel_index(int(array.argmax()), array.shape)
            level = f"level {number}, " if len(values) > 1 else ""
            worst, where = value, level + f"at {tuple(int(part) for part in at)}"
    return row(name, worst, unit, limit, where)
