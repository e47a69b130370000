"""Mip chains under stress: every level against averages in double precision of slopes and normals."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ._map_info import MAPS
from ._stress_rows import Check, row

__all__ = ["MIP_MAPS", "mip_checks"]

Numbers = NDArray[np.float64]

MIP_MAPS = ("moments", "normal_mips", "toksvig")
_EPSILON = 2.0**-24
#: Roundings to 32 bits of a mean: of slopes or normals, their product, and sums along both axes.
MOST_ROUNDINGS = 16.0


def mip_checks(name: str, made: list[Numbers], normals: Numbers, lost: float) -> Iterator[Check]:
    """What was found, in roundings of what was averaged, beyond what slopes had lost before.

    Parameters
    ----------
    name : str
        One of `MIP_MAPS`.
    made : list of array
        The levels, the finest first.
    normals : (H, W, 3) array
        Unit normals of the surface.
    lost : float
        What 32-bit differences of heights lose of slopes.
    """
    # Where slopes are steep, what is lost across them turns the normal most.
    beyond = lost * normals[..., 2:]
    if name == "moments":
        x, y = normals[..., 0] / normals[..., 2], normals[..., 1] / normals[..., 2]
        finest = np.stack([x, y, x * x, x * y, y * y], axis=-1)
        wide, tall = 2.0 * np.abs(x) + lost, 2.0 * np.abs(y) + lost
        beyond = lost * np.stack([np.ones_like(x), np.ones_like(x), wide, 0.5 * (wide + tall), tall], axis=-1)
    else:
        finest = normals
    worst, where = 0.0, ""
    for level, layer in enumerate(made):
        sides = [(old, max(1, old >> level)) for old in finest.shape[:2]]
        if [new for _, new in sides] != list(layer.shape[:2]):
            worst, where = np.inf, f"level {level} has {layer.shape[1]} x {layer.shape[0]} texels"
            break
        means, sizes, spread = (_average(part, sides) for part in (finest, np.abs(finest), beyond))
        off = _off(name, level, layer, means, sizes, spread)
        at = np.unravel_index(int(off.argmax()), off.shape)
        if off[at] > worst:
            worst, where = float(off[at]), f"level {level}, at {tuple(int(part) for part in at)}"
    yield row("averages", worst, "roundings", MOST_ROUNDINGS, where)


def _off(name: str, level: int, layer: Numbers, means: Numbers, sizes: Numbers, spread: Numbers) -> Numbers:
    """How far a level is off, in roundings."""
    if name == "moments":
        # Slopes are those of normals of 32 bits: steep ones lose as much as their length, squared.
        steep = 1.0 + sizes[..., 2:3] + sizes[..., 4:5]
        unit = _EPSILON * np.where(np.arange(5) < 2, np.sqrt(steep), steep) + 1e-300
        return np.maximum(np.abs(layer - means) - spread, 0.0) / unit
    length = np.linalg.norm(means, axis=-1, keepdims=True)
    if name == "normal_mips":
        # Of what all but cancels out no direction is left.
        known = length > 1e-3
        off = np.abs(layer - means / np.maximum(length, 1e-3)) * length
        return np.where(known, np.maximum(off - spread, 0.0), 0.0) / _EPSILON
    own = _roughness()
    if level == 0:
        return np.abs(layer - own) / _EPSILON
    length, spread = length[..., 0], spread[..., 0]
    power = 2.0 / own**2 - 2.0
    truth = np.sqrt(2.0 / (2.0 + 1.0 / (1.0 / power + (1.0 - length) / length)))
    # alpha^2 changes by twice as much as 1 / length.
    rate = 1.0 / (own * np.maximum(length, 1e-3) ** 2)
    off = np.maximum(np.abs(layer - truth) - spread * rate, 0.0) / (1.0 + rate)
    return np.where(length > 1e-3, off, 0.0) / _EPSILON


def _roughness() -> float:
    """What toksvig takes for the surface's own, as it is told to 32 bits."""
    option = next(option for option in MAPS["toksvig"].options if option.name == "roughness")
    return float(np.float32(option.default))


def _average(values: Numbers, sides: list[tuple[int, int]]) -> Numbers:
    """Means over equal areas: a texel on the border of two counts in both by its share."""
    down, right = (_shares(*side) for side in sides)
    return np.asarray(np.einsum("ab,bcd,ec->aed", down, values, right, optimize=True))


def _shares(old: int, new: int) -> Numbers:
    edges = np.arange(new + 1) * (old / new)
    low, high = edges[:-1, None], edges[1:, None]
    first = np.arange(old)
    return np.asarray(np.clip(np.minimum(high, first + 1) - np.maximum(low, first), 0.0, None) * (new / old))
