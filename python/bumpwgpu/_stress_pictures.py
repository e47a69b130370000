"""Pictures under stress: what pixels of a relief show, and what of it lies in shadow, before a judge."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._stress_cases import picture_maps
from ._stress_march import GUARANTEED, MOST_SKIPPED
from ._stress_recipes import RECIPES, samples_to_light
from ._stress_rows import Check, failed, row
from ._stress_shadows import known_shadows
from ._stress_surface import padded, surface
from .errors import BumpWarning
from .heightmap import HeightMap
from .meshes import Mesh
from .scene import Camera, Light, Material
from .techniques import Technique

__all__ = ["picture_checks"]

Numbers = NDArray[np.float64]

_SIZE = (64, 48)
_TARGET, _FOV = np.array([0.3, 0.3, 0.0]), 40.0
_EYE = _TARGET + np.array([0.15, -0.5, 0.4])
#: Where light comes from: 68 degrees from the normal.
_TO_LIGHT = np.array([0.8, -0.3, 0.35])
#: Height that the way to a light may pass over or through the surface by before it counts: hits of pictures
#: are off by 1e-5, and their shadow rays start 1/65536 above them.
_BESIDE = 2e-4
#: Heights that what a pixel shows may be off the surface: places of 32 bits, 1.2 units from the camera, where
#: the surface climbs by up to a texel's worth in one of 32.
_MOST_OFF = 1e-4
#: Degrees that their normals may be off: slopes have 11 bits, twice rounded, and turn a normal most at 45
#: degrees.
_MOST_DEGREES = float(np.degrees(2.0**-11))


def picture_checks(
    render: Callable[..., Any], technique: Technique, seed: int
) -> Iterator[tuple[str, Check]]:
    """Draws a relief on a square with one technique; yields the case and what was found."""
    for name, source in picture_maps(seed).items():
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", BumpWarning)
                frame = render(
                    Mesh.quad(),
                    Material(height=source),
                    camera=Camera.look_at(tuple(_EYE), tuple(_TARGET), fov_y=_FOV),
                    lights=[Light.directional(tuple(-_TO_LIGHT))],
                    technique=technique,
                    size=_SIZE,
                    shadows=technique.casts_shadows,
                    skip_error=(0.0, 0.0),
                    aovs=("uv", "height", "normal", "shadow", "mask"),
                )
        except Exception as error:  # a fault in what is tested must become a line in the table
            yield name, failed("runs", f"{type(error).__name__}: {error}")
            continue
        shown = {name: np.asarray(value, np.float64) for name, value in frame.aovs.items()}
        for check in _of_one(technique, source, shown):
            yield name, check


def _of_one(technique: Technique, source: HeightMap, shown: dict[str, Numbers]) -> Iterator[Check]:
    origins, directions, inside = _rays(source)
    missing = inside & (shown["mask"].ravel() != 1.0)
    yield _worst("covered", missing.astype(float), "pixels", 0.0)
    kept = np.flatnonzero(inside & ~missing)
    origins, directions = origins[kept], directions[kept]
    uv, height = shown["uv"].reshape(-1, 2)[kept], shown["height"].ravel()[kept]
    t = (origins[:, 2] - height) / -directions[:, 2]
    aside = np.abs(uv - origins[:, :2] - t[:, None] * directions[:, :2]).max(axis=1)
    yield _worst("uv on the ray", aside * max(source.shape), "texels", _MOST_OFF, kept)
    if technique.name in GUARANTEED:
        _, gap, skipped, _ = _bumpwgpu.judge(source.array, source.wrap, origins, directions, t)
        yield _worst("on the surface", np.abs(gap), "heights", _MOST_OFF, kept)
        yield _worst("nothing skipped", skipped, "heights", MOST_SKIPPED, kept)
        yield _normals(source, uv, shown["normal"].reshape(-1, 3)[kept], kept)
    if technique.casts_shadows:
        # What faces away from the light needs no shadow.
        facing = shown["normal"].reshape(-1, 3)[kept] @ _TO_LIGHT > 1e-3
        places = np.concatenate([uv, height[:, None]], axis=1)[facing]
        yield from _shadows(technique, source, places, shown["shadow"].ravel()[kept][facing], kept[facing])


def _rays(source: HeightMap) -> tuple[Numbers, Numbers, NDArray[np.bool_]]:
    """Through the middles of all pixels, from the lid in texture space, and which of them meet the square
    well within its sides.
    """
    width, height = _SIZE
    forward = (_TARGET - _EYE) / np.linalg.norm(_TARGET - _EYE)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    tall = np.tan(np.radians(0.5 * _FOV))
    x, y = np.meshgrid(
        (np.arange(width) + 0.5) / width * 2.0 - 1.0, 1.0 - (np.arange(height) + 0.5) / height * 2.0
    )
    ways = forward + tall * (width / height * x.reshape(-1, 1) * right + y.reshape(-1, 1) * up)
    meets = _EYE + (-_EYE[2] / ways[:, 2:]) * ways
    inside = (np.abs(meets[:, :2]) < 0.49).all(axis=1) & (ways[:, 2] < 0.0)
    return _textured(meets, 1.0), _turned(source, ways), inside


def _textured(places: Numbers, z: float) -> Numbers:
    """Places of the square in texture space; v goes down."""
    return np.stack([places[:, 0] + 0.5, 0.5 - places[:, 1], np.full(len(places), z)], axis=1)


def _turned(source: HeightMap, ways: Numbers) -> Numbers:
    """Directions in texture space."""
    return np.ascontiguousarray(ways * np.array([1.0, -1.0, 1.0 / np.float64(np.float32(source.scale))]))


def _normals(source: HeightMap, uv: Numbers, normal: Numbers, kept: NDArray[np.intp]) -> Check:
    """Degrees between normals and those of central differences at texels, interpolated: the camera is so near
    that a pixel is less than a texel wide.
    """
    heights = padded(source, 2)
    slopes = np.stack(
        [heights[1:-1, 2:] - heights[1:-1, :-2], heights[:-2, 1:-1] - heights[2:, 1:-1]], axis=-1
    )
    slopes *= 0.5 * source.scale * np.array(source.shape[::-1])
    x, y = (uv * source.shape[::-1] - 0.5).T
    rows, columns = source.shape
    known = (x > -1.0) & (y > -1.0) & (x < columns) & (y < rows)
    x, y = np.where(known, x, 0.0), np.where(known, y, 0.0)
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    f, g = (x - i)[:, None], (y - j)[:, None]
    upper = slopes[j + 1, i + 1] * (1.0 - f) + slopes[j + 1, i + 2] * f
    lower = slopes[j + 2, i + 1] * (1.0 - f) + slopes[j + 2, i + 2] * f
    truth = np.concatenate([-(upper * (1.0 - g) + lower * g), np.ones((len(uv), 1))], axis=-1)
    truth /= np.linalg.norm(truth, axis=-1, keepdims=True)
    chord = np.linalg.norm(normal - truth, axis=-1)
    angle = np.degrees(2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0)))
    return _worst("normal", np.where(known, angle, 0.0), "degrees", _MOST_DEGREES, kept)


def _shadows(
    technique: Technique, source: HeightMap, places: Numbers, shadow: Numbers, kept: NDArray[np.intp]
) -> Iterator[Check]:
    """Pixels in the light that should be hidden from it, and hidden ones that should not."""
    directions = np.tile(_turned(source, _TO_LIGHT[None]), (len(places), 1))
    if technique.name in GUARANTEED:
        on_it = np.concatenate([places[:, :2], surface(source, *places[:, :2].T)[:, None]], axis=1)
        must, may_not = known_shadows(source, on_it, directions, _BESIDE)
    elif technique.name in RECIPES:
        least = samples_to_light(technique, source, places, directions)
        must, may_not = least < -_BESIDE, least > _BESIDE
    else:
        return
    yield _worst("hidden where it should be", (must & (shadow < 0.5)).astype(float), "pixels", 0.0, kept)
    yield _worst("does not hide itself", (may_not & (shadow > 0.5)).astype(float), "pixels", 0.0, kept)


def _worst(
    name: str, values: Numbers, unit: str, limit: float, kept: NDArray[np.intp] | None = None
) -> Check:
    values = np.where(np.isnan(values), np.inf, values)
    at = int(values.argmax())
    worst = float(values.sum() if unit == "pixels" else values[at])
    pixel = at if kept is None else int(kept[at])
    where = f"pixel ({pixel % _SIZE[0]}, {pixel // _SIZE[0]})" if worst > 0.0 else ""
    return row(name, worst, unit, limit, where)
