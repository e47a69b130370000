"""Rays and maps that break searches and bakes: what the stability suite is made of."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._stress_surface import surface
from .heightmap import HeightMap, Wrap

__all__ = ["ANGLES", "OFFSETS", "RayCase", "hard_maps", "picture_maps", "ray_cases", "shadow_cases"]

#: Angles from the normal, degrees.
ANGLES = (0.0, 45.0, 70.0, 85.0, 89.0, 89.9, 89.99)
#: Distances of rays from the origin, tiles.
OFFSETS = (0.0, 1.0, 16.0, 1e3, 1e4, 1e5, 1e6)
#: Scales of the relief, mesh units; seen at 60 degrees from the normal.
SCALES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
WRAPS: tuple[Wrap, ...] = ("repeat", "clamp", "mirror")
_SIDE = 32
#: Angles of cameras, degrees from the normal; their pixels, and texels of what they see. Searches may bundle
#: the rays of a camera, which takes this many.
CAMERA_ANGLES = (45.0, 80.0)
_PIXELS, _SEEN = (64, 32), 64
#: A camera that bundles must not look past posts with, which stand alone: its pixels, texels, posts, and
#: texels between rays on the lid. Eight by eight rays are then as wide as a bound of power-of-two width just
#: holds.
_BUNDLES, _FOREST, _POSTS, _APART = (256, 64), 128, 60, 0.9
#: Angles of lights, degrees from the normal.
LIGHT_ANGLES = (45.0, 70.0, 85.0)


@dataclass(frozen=True)
class RayCase:
    """Rays on a map: origins and directions (N, 3) float64 that are exact in `dtype`."""

    group: str
    name: str
    height_map: HeightMap
    origins: NDArray[np.float64]
    directions: NDArray[np.float64]
    #: Angle or offset, for plots.
    at: float | None = None
    #: What march is given.
    dtype: type[np.floating[Any]] = np.float32


def ray_cases(seed: int, rays: int) -> Iterator[RayCase]:
    """All cases, easy ones first."""
    rng = np.random.default_rng(seed)
    rough = _rough(rng)
    for wrap in WRAPS:
        here = HeightMap(rough, scale=0.1, wrap=wrap)
        for angle in ANGLES:
            origins, directions = _rays(rng, rays, _run(0.1, angle))
            yield _single("grazing", f"{angle:g} degrees, {wrap}", here, origins, directions, angle)
    tiled = HeightMap(rough, scale=0.1)
    for offset in OFFSETS:
        origins, directions = _rays(rng, rays, _run(0.1, 75.0))
        sides = rng.choice([-1.0, 1.0], (rays, 2))
        origins[:, :2] += np.round(offset * rng.uniform(0.5, 1.0, (rays, 2))) * sides
        yield RayCase("offset", f"{offset:g} tiles, f64", tiled, origins, directions, offset, np.float64)
        yield _single("offset", f"{offset:g} tiles, f32", tiled, origins, directions, offset)
    for scale in SCALES:
        relief = HeightMap(rough, scale=scale)
        origins, directions = _rays(rng, rays, _run(scale, 60.0))
        yield _single("scale", f"{scale:g}", relief, origins, directions)
    for name, heights in hard_maps(seed).items():
        for wrap in WRAPS:
            hard = HeightMap(heights, scale=0.1, wrap=wrap)
            origins, directions = _rays(rng, max(rays // 2, 1), _run(0.1, 80.0))
            yield _single("map", f"{name}, {wrap}", hard, origins, directions)
    yield from _border_cases(rng, rays, tiled)
    for power in (-60, -20, 20, 60):
        origins, directions = _rays(rng, rays, _run(0.1, 60.0))
        factor = 2.0**power
        yield _single("length", f"2^{power}", tiled, origins, directions * factor)
    origins, directions = _rays(rng, rays, 0.5)
    origins -= directions * rng.uniform(1.0, 1000.0, (rays, 1))
    yield _single("far start", "up to 1000 heights above", tiled, origins, directions)
    seen = _rough(rng, _SEEN)
    for wrap in WRAPS:
        here = HeightMap(seen, scale=0.1, wrap=wrap)
        for angle in CAMERA_ANGLES:
            rows = _camera(_PIXELS, 0.5 / _SEEN, _run(0.1, angle))
            yield _single("camera", f"{angle:g} degrees, {wrap}", here, *rows)
    posts = np.zeros((_FOREST, _FOREST), np.float32)
    posts[tuple(rng.integers(0, _FOREST, (2, _POSTS)))] = rng.uniform(0.1, 0.9, _POSTS)
    rows = _camera(_BUNDLES, _APART / _FOREST, _run(0.1, 25.0))
    yield _single("bundles", "among posts", HeightMap(posts, scale=0.1), *rows)


def shadow_cases(seed: int, rays: int) -> Iterator[RayCase]:
    """Rays from points of a rough surface up to lights."""
    rng = np.random.default_rng(seed + 3)
    rough = _rough(rng)
    for wrap in WRAPS:
        here = HeightMap(rough, scale=0.1, wrap=wrap)
        for angle in LIGHT_ANGLES:
            origins, directions = _rays(rng, 8 * rays, _run(0.1, angle))
            origins[:, :2] = origins[:, :2].astype(np.float32)
            origins[:, 2] = surface(here, origins[:, 0], origins[:, 1])
            yield _single("shadow", f"light at {angle:g}, {wrap}", here, origins, -directions)


def picture_maps(seed: int) -> dict[str, HeightMap]:
    """A rough surface in every wrap, to be drawn."""
    rough = _rough(np.random.default_rng(seed + 4))
    return {wrap: HeightMap(rough, scale=0.1, wrap=wrap) for wrap in WRAPS}


def hard_maps(seed: int) -> dict[str, NDArray[np.float32]]:
    """Maps of one level, with a single feature, of the least and largest numbers, and of one row."""
    rng = np.random.default_rng(seed + 1)
    y, x = np.mgrid[0:_SIDE, 0:_SIDE]
    spike = np.zeros((_SIDE, _SIDE))
    spike[7, 19] = 1.0
    pit = 1.0 - spike
    tiny = float(np.float32(1e-41))
    maps: dict[str, Any] = {
        "flat 0": np.zeros((4, 4)),
        "flat 0.5": np.full((5, 3), 0.5),
        "flat 1": np.ones((3, 5)),
        "spike": spike,
        "pit": pit,
        "checkerboard": (x + y) % 2,
        "step": (x >= _SIDE // 2) * 1.0,
        "denormal": rng.choice([0.0, tiny, 3.0 * tiny], (8, 8)),
        "extremes": rng.choice([0.0, tiny, 1e-30, 1.0 - 2.0**-24, 1.0], (8, 8)),
        "ramp of ulps": 0.5 + np.arange(64).reshape(8, 8) * 2.0**-24,
        "1 x 1": np.array([[0.3]]),
        "1 x N": rng.random((1, 17)),
        "N x 1": rng.random((19, 1)),
        "odd": rng.random((13, 7)),
    }
    return {name: np.ascontiguousarray(heights, np.float32) for name, heights in maps.items()}


def _rough(rng: np.random.Generator, side: int = _SIDE) -> NDArray[np.float32]:
    """Slopes, walls, and posts of one texel."""
    y, x = np.mgrid[0:side, 0:side] / side
    heights = 0.4 + 0.25 * np.sin(2 * np.pi * (x + 2 * y)) + 0.1 * rng.random((side, side))
    heights[12:20, 5:14] = 0.15
    heights[rng.integers(0, side, 9), rng.integers(0, side, 9)] = 1.0
    rough: NDArray[np.float32] = np.clip(heights, 0.0, 1.0).astype(np.float32)
    return rough


def _run(scale: float, angle: float) -> float:
    """Tiles that a ray crosses between the lid and the floor."""
    return scale * math.tan(math.radians(angle))


def _rays(
    rng: np.random.Generator, count: int, run: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    origins = np.concatenate([rng.random((count, 2)), np.ones((count, 1))], axis=1)
    turn = rng.random(count) * 2 * np.pi
    # Some along the axes and diagonals, where walks stall.
    eighths = rng.random(count) < 0.2
    turn[eighths] = np.round(turn[eighths] / (np.pi / 4)) * (np.pi / 4)
    flat = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    flat[np.abs(flat) < 1e-9] = 0.0
    return origins, np.concatenate([run * flat, -np.ones((count, 1))], axis=1)


def _camera(
    size: tuple[int, int], apart: float, run: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The rays of a camera, row by row, so many tiles apart on the lid and twice as many on the floor."""
    width, height = size
    x, y = (part.ravel() for part in np.meshgrid(np.arange(width), np.arange(height)))
    ways = np.stack([x - 0.5 * width, y - 0.5 * height, np.zeros(len(x))], axis=1) * apart
    directions = ways + run * np.array([0.8, -0.6, 0.0]) - np.array([0.0, 0.0, 1.0])
    return np.tile([0.3, 0.6, 2.0], (len(x), 1)), directions


def _border_cases(rng: np.random.Generator, rays: int, tiled: HeightMap) -> Iterator[RayCase]:
    """Rays on the lines between cells and through their corners, where differences cancel."""
    side = tiled.shape[0]
    lines = (rng.integers(0, side, (rays, 2)) + 0.5) / side
    for name, turn in (("along u", 0.0), ("along v", 0.5 * np.pi), ("diagonal", 0.25 * np.pi)):
        origins = np.concatenate([lines, np.ones((rays, 1))], axis=1)
        flat = np.round([math.cos(turn), math.sin(turn)], 12) * 0.75
        directions = np.tile([*flat, -1.0], (rays, 1))
        yield _single("cell border", name, tiled, origins, directions)
    nudged = lines + rng.choice([-1.0, 1.0], (rays, 2)) * 2.0**-24
    origins = np.concatenate([nudged, np.ones((rays, 1))], axis=1)
    directions = np.tile([0.75, 1e-30, -1.0], (rays, 1))
    yield _single("cell border", "an ulp beside", tiled, origins, directions)
    origins = np.concatenate([lines, np.ones((rays, 1))], axis=1)
    yield _single(
        "cell border", "straight down on texels", tiled, origins, np.tile([0.0, 0.0, -1.0], (rays, 1))
    )


def _single(
    group: str,
    name: str,
    height_map: HeightMap,
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
    at: float | None = None,
) -> RayCase:
    """A case of rays rounded to 32 bits."""
    start, along = (np.asarray(part, np.float32).astype(np.float64) for part in (origins, directions))
    return RayCase(group, name, height_map, start, along, at)
