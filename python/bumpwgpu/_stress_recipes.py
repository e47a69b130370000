"""Searches that promise no first hit, under stress: each before its own recipe in double precision.

What such a search reports may be far from the surface, but it is not arbitrary: the recipe says where it
looks and what it makes of that. Here the recipes are written down once more, for all rays side by side, on a
surface of the suite's own.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._stress_cases import RayCase
from ._stress_surface import gradients, surface
from .heightmap import HeightMap
from .techniques import Technique

__all__ = ["RECIPES", "Recipe", "follow", "samples_to_light"]

Numbers = NDArray[np.float64]

#: Searches whose recipe is known here: those that read heights alone.
RECIPES = (
    "parallax", "parallax_limited", "steep", "steep_linear", "steep_exponential", "binary", "relief", "pom",
    "interval",
)  # fmt: skip
_EPSILON = 2.0**-24
#: Roundings to 32 bits in a height over the surface: of the place, four products and their sums; and as many
#: texels as the place itself may be off by, in its own roundings.
_HEIGHT_ULPS, _PLACE_ULPS = 8.0, 4.0


class Recipe(NamedTuple):
    """What a recipe finds: t (N,), and by how much roundings to 32 bits may move it."""

    t: Numbers
    allowed: Numbers


class _Rays:
    """Rays from the lid, or where they start, to the floor, or up to the lid: 0 and 1."""

    def __init__(self, source: HeightMap, origins: Numbers, directions: Numbers) -> None:
        self.source = source
        down = -directions[:, 2]
        falls = down > 0.0
        self.first = np.where(falls, np.maximum((origins[:, 2] - 1.0) / down, 0.0), 0.0)
        self.length = np.where(falls, origins[:, 2], origins[:, 2] - 1.0) / down - self.first
        self.start = origins + self.first[:, None] * directions
        self.delta = self.length[:, None] * directions

    def rounding(self, tau: Numbers) -> Numbers:
        """What roundings make of a height over the surface at (N,) places, as steep as it is there."""
        size = np.array(self.source.shape[::-1])
        x, y = ((self.start[:, :2] + self.delta[:, :2] * tau[:, None]) * size - 0.5).T
        slopes = np.abs(np.stack(gradients(self.source, x, y), axis=-1))
        texels = (np.abs(self.delta[:, :2]) + 1.0) * size
        return np.asarray(_EPSILON * (_HEIGHT_ULPS + _PLACE_ULPS * (slopes * texels).sum(axis=1)))

    def gap(self, tau: Numbers) -> Numbers:
        """Height over the surface, of (N,) or (N, K) places along the rays."""
        part = (slice(None), *[None] * (tau.ndim - 1))
        x, y, z = (self.start[:, k][part] + self.delta[:, k][part] * tau for k in range(3))
        return np.asarray(z - surface(self.source, x, y))


def follow(technique: Technique, case: RayCase) -> Iterator[Recipe]:
    """Follows rays that go down by the recipe of one of `RECIPES`.

    Where the number of layers hangs on a rounding there are two right answers.
    """
    rays = _Rays(case.height_map, case.origins, case.directions)
    for way in (0.0,) if "min_steps" not in technique.parameters else (-1.0, 1.0):
        yield _followed(technique, rays, way)


def _followed(technique: Technique, rays: _Rays, way: float) -> Recipe:
    if technique.name.startswith("parallax"):
        tau, doubt = _one_step(technique.name, rays)
    elif technique.name == "binary":
        ends = np.zeros(len(rays.length)), np.ones(len(rays.length))
        tau, doubt = _halved(rays, *ends, technique.parameters["steps"])
    else:
        tau, doubt = _layered(technique, rays, way)
    # The answer itself is rounded, and is a sum.
    unit = 4.0 * _EPSILON * (1.0 + rays.first / rays.length)
    return Recipe(rays.first + tau * rays.length, (unit + doubt) * rays.length)


def samples_to_light(
    technique: Technique, source: HeightMap, origins: Numbers, directions: Numbers
) -> Numbers:
    """The least height over the surface of what a recipe looks at on the ways up to a light, (N,).

    What starts below the surface is lifted onto it, and ends where it would have ended.
    """
    rays = _Rays(source, origins, directions)
    if technique.name == "binary":
        tau = np.tile(0.5 ** np.arange(1.0, 1.0 + min(technique.parameters["steps"], 8)), (len(origins), 1))
    else:
        counts = _counts(technique, rays, 0.0)[:, None]
        tau = np.minimum(np.arange(1.0, counts.max() + 1.0) / counts, 1.0)
    lift = np.maximum(-rays.gap(np.zeros(len(origins))), 0.0)[:, None]
    return np.asarray((rays.gap(tau) + lift * (1.0 - tau)).min(axis=1))


def _cosines(rays: _Rays) -> Numbers:
    """Between rays and the normal, in mesh units."""
    tile, scale = rays.source.tile_size, rays.source.scale
    mesh = rays.delta * np.array([*tile, scale])
    return np.asarray(np.abs(mesh[:, 2]) / np.linalg.norm(mesh, axis=1))


def _one_step(name: str, rays: _Rays) -> tuple[Numbers, Numbers]:
    """Kaneko et al. 2001: the height under the place where the ray passes the mesh. Welsh 2004: by the
    cosine.
    """
    base = rays.source.base
    fall = -rays.delta[:, 2]
    tau = (rays.start[:, 2] - base) / fall
    height = rays.start[:, 2] + rays.delta[:, 2] * tau - rays.gap(tau)
    if name == "parallax_limited":
        height = base + (height - base) * _cosines(rays)
    return np.maximum((rays.start[:, 2] - height) / fall, 0.0), rays.rounding(tau) / fall


def _counts(technique: Technique, rays: _Rays, way: float) -> Numbers:
    """Layers of each ray; where they depend on the view, as rounding that way makes them."""
    values = technique.parameters
    if "min_steps" not in values:
        return np.full(len(rays.length), float(values.get("linear", values.get("steps", 0))))
    least, most, cosines = values["min_steps"], values["max_steps"], _cosines(rays)
    if technique.name == "steep_exponential":
        count = most * (least / most) ** cosines
    else:
        count = most + (least - most) * cosines
    return np.asarray(np.maximum(np.ceil(count * (1.0 + way * 16.0 * _EPSILON)), 1.0))


def _layered(technique: Technique, rays: _Rays, way: float) -> tuple[Numbers, Numbers]:
    """The first of equal layers that ends on or below the surface, and what is made of it and the last."""
    counts = _counts(technique, rays, way)
    layers = np.arange(1.0, counts.max() + 1.0)
    tau = np.minimum(layers / counts[:, None], 1.0)
    # The floor is below whatever the rounding.
    under = (rays.gap(tau) <= 0.0) | (layers >= counts[:, None])
    each = np.arange(len(tau))
    first = under.argmax(axis=1)
    below = tau[each, first]
    above = np.where(first > 0, tau[each, np.maximum(first - 1, 0)], 0.0)
    if technique.name.startswith("steep"):
        return below, np.zeros(len(below))
    if technique.name == "relief":
        return _halved(rays, above, below, technique.parameters["refine"], middle=True)
    return _chords(rays, above, below, technique.parameters.get("refine", 0))


def _halved(
    rays: _Rays, above: Numbers, below: Numbers, steps: int, middle: bool = False
) -> tuple[Numbers, Numbers]:
    """Policarpo, Oliveira and Comba 2005."""
    for _ in range(steps):
        half = 0.5 * (above + below)
        under = rays.gap(half) <= 0.0
        above, below = np.where(under, above, half), np.where(under, half, below)
    return (0.5 * (above + below) if middle else below), np.zeros(len(below))


def _chords(rays: _Rays, above: Numbers, below: Numbers, steps: int) -> tuple[Numbers, Numbers]:
    """Tatarchuk 2006: where the chord meets the surface. Risser, Shah and Pattanaik 2007: again and again."""
    over, under = np.maximum(rays.gap(above), 0.0), np.minimum(rays.gap(below), 0.0)
    doubt = np.zeros(len(above))

    def chord() -> Numbers:
        drop = over - under
        return np.where(drop > 0.0, above + (below - above) * over / np.maximum(drop, 1e-300), below)

    for left in range(steps, -1, -1):
        # Two heights that are off move the end of their chord by their share of its drop, never off the
        # chord.
        ends = rays.rounding(above) + rays.rounding(below)
        lost = (below - above) * np.minimum(ends / np.maximum(over - under, 1e-300), 1.0)
        doubt = np.maximum(doubt, lost)
        tau = chord()
        if left == 0:
            break
        gap = rays.gap(tau)
        sunk = gap <= 0.0
        above, over = np.where(sunk, above, tau), np.where(sunk, over, gap)
        below, under = np.where(sunk, tau, below), np.where(sunk, gap, under)
    return tau, doubt
