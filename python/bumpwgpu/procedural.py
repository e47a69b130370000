"""Height maps made from formulas: deterministic, tileable, of any size.

Every function takes the coordinates of the texel centres, ``u`` of shape (1, W) and ``v`` of shape
(H, 1) in 0..1 (``v`` down), and a seeded generator, and returns float64 heights in 0..1.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._checks import choice, whole, width_and_height

__all__ = ["NAMES", "heights", "sampled"]

_Plane: TypeAlias = NDArray[np.float64]
_Generator: TypeAlias = Callable[[_Plane, _Plane, np.random.Generator], _Plane]

#: Largest map made, in texels: 4 GiB of working memory would be no help to anybody.
MAX_TEXELS = 1 << 28


def _smoothstep(x: _Plane) -> _Plane:
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


def _stretch(x: _Plane) -> _Plane:
    low, high = x.min(), x.max()
    return (x - low) / (high - low) if high > low else np.full_like(x, 0.5)


def _centred(u: _Plane, v: _Plane) -> _Plane:
    """Distance from the middle of the tile."""
    return np.asarray(np.hypot(u - 0.5, v - 0.5))


def _spectral(u: _Plane, v: _Plane, rng: np.random.Generator, slope: float) -> _Plane:
    """Noise with random phases and amplitude ``frequency ** -slope``: periodic by construction.

    Fournier, Fussell, Carpenter 1982; spectral synthesis as in Saupe 1988.
    """
    shape = (v.shape[0], u.shape[1])
    frequency = np.hypot(
        np.fft.fftfreq(shape[0])[:, None] * shape[0], np.fft.rfftfreq(shape[1])[None] * shape[1]
    )
    frequency[0, 0] = np.inf
    # The lowest waves come from a table of fixed size, so a map keeps its look at other sizes.
    phases = rng.uniform(0.0, 2.0 * np.pi, (64, 64))
    rows = (np.fft.fftfreq(shape[0]) * shape[0]).astype(np.int64) % 64
    columns = np.arange(frequency.shape[1]) % 64
    scrambled = phases[rows[:, None], columns[None]] * (
        1.0 + (frequency.clip(max=1e6).astype(np.int64) // 64)
    )
    spectrum = frequency**-slope * np.exp(1j * scrambled)
    return _stretch(np.fft.irfft2(spectrum, s=shape))


def _fbm(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    return _spectral(u, v, rng, 2.0)


def _noise(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    return rng.random((v.shape[0], u.shape[1]))


def _bricks(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """Running bond: 4 x 8 bricks, bevelled edges, each a little higher or lower, slightly rough."""
    across, down = 4, 8
    levels = rng.uniform(0.82, 0.96, (down, across))
    row = np.minimum((v * down).astype(np.int64), down - 1)
    along = u * across + 0.5 * (row % 2)
    column = np.floor(along).astype(np.int64) % across
    x, y = along - np.floor(along), v * down - row
    # Distances to the brick's edge in units of the brick's height, which is half its length.
    edge = np.minimum(np.minimum(x, 1.0 - x) * 2.0, np.minimum(y, 1.0 - y))
    brick = _smoothstep((edge - 0.06) / 0.09)
    rough = _spectral(u, v, rng, 1.4) - 0.5
    surface = levels[row, column] + 0.08 * rough
    mortar = 0.2 + 0.1 * rough
    return np.clip(mortar + (surface - mortar) * brick, 0.0, 1.0)


def _sinc(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """Circular waves that fade towards the border of the tile."""
    r = _centred(u, v)
    window = _smoothstep((0.5 - r) / 0.15)
    return _stretch(np.sinc(r * 16.0) * window)


def _spheres(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """4 x 4 half spheres (as seen in their own scale), radius 0.45 of a cell."""
    x, y = u * 4.0 % 1.0 - 0.5, v * 4.0 % 1.0 - 0.5
    return np.sqrt(np.clip(1.0 - (x * x + y * y) / 0.45**2, 0.0, 1.0))


def _cones(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    x, y = u * 4.0 % 1.0 - 0.5, v * 4.0 % 1.0 - 0.5
    return np.clip(1.0 - np.hypot(x, y) / 0.45, 0.0, 1.0)


def _wall(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """One upright wall, a sixteenth of the tile thick, along v."""
    return np.where(np.abs(u - 0.5) < 1.0 / 32.0, 1.0, 0.0) + 0.0 * v


def _dot(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """A single high texel in the middle."""
    plane = np.zeros((v.shape[0], u.shape[1]))
    plane[v.shape[0] // 2, u.shape[1] // 2] = 1.0
    return plane


def _thin(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """Fences one texel wide, eight each way: what searches with few steps jump over."""
    columns = np.arange(u.shape[1])[None] % max(1, u.shape[1] // 8) == 0
    rows = np.arange(v.shape[0])[:, None] % max(1, v.shape[0] // 8) == 0
    return np.where(columns | rows, 1.0, 0.0)


def _ridge(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """One triangular ridge along v: ``1 - |2u - 1|``."""
    return 1.0 - np.abs(2.0 * u - 1.0) + 0.0 * v


def _sines(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """``0.5 + 0.25 sin(2 pi 3 u) + 0.25 sin(2 pi 2 v)``."""
    return 0.5 + 0.25 * np.sin(6.0 * np.pi * u) + 0.25 * np.sin(4.0 * np.pi * v)


def _flat(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    return np.full((v.shape[0], u.shape[1]), 0.5)


def _checker(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    return ((np.floor(u * 8.0) + np.floor(v * 8.0)) % 2.0).astype(np.float64)


def _steps(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """Eight terraces up and down again along u."""
    return np.floor((1.0 - np.abs(2.0 * u - 1.0)) * 7.999) / 7.0 + 0.0 * v


def _terrain(u: _Plane, v: _Plane, rng: np.random.Generator) -> _Plane:
    """Ridged noise: sharp crests, wide valleys (after Musgrave 1989)."""
    ridges = 1.0 - np.abs(2.0 * _spectral(u, v, rng, 1.9) - 1.0)
    return _stretch(ridges * ridges * 0.7 + 0.3 * _spectral(u, v, rng, 2.3))


_GENERATORS: dict[str, _Generator] = {
    "bricks": _bricks,
    "fbm": _fbm,
    "terrain": _terrain,
    "noise": _noise,
    "sinc": _sinc,
    "spheres": _spheres,
    "cones": _cones,
    "sines": _sines,
    "ridge": _ridge,
    "steps": _steps,
    "checker": _checker,
    "wall": _wall,
    "thin": _thin,
    "dot": _dot,
    "flat": _flat,
}

NAMES = tuple(_GENERATORS)


def heights(name: str, size: int | tuple[int, int], seed: int) -> NDArray[np.float32]:
    """Heights of a procedural map; see :meth:`bumpwgpu.HeightMap.procedural`.

    Parameters
    ----------
    name : str
        One of :data:`NAMES`.
    size : int or (int, int)
        Texels: the side of a square, or (width, height).
    seed : int
        Not negative.

    Returns
    -------
    ndarray
        float32, (H, W), 0..1.

    Raises
    ------
    ValueError
        For an unknown name, or a size or seed out of range.
    TypeError
        For a name that is no string, or a size or seed that is no whole number.
    """
    choice("height map", name, NAMES)
    u, v = _centres(size)
    seed = whole("seed", seed)
    if seed < 0:
        raise ValueError(f"seed must not be negative, got {seed}")
    plane = _GENERATORS[name](u, v, np.random.default_rng(seed))
    return np.clip(plane, 0.0, 1.0).astype(np.float32)


def sampled(
    function: Callable[[_Plane, _Plane], ArrayLike], size: int | tuple[int, int]
) -> NDArray[np.float32]:
    """Heights of any function at the texel centres; see :meth:`bumpwgpu.HeightMap.from_function`.

    Parameters
    ----------
    function : callable
        Of u (1, W) and v (H, 1).
    size : int or (int, int)
        Texels: the side of a square, or (width, height).

    Returns
    -------
    ndarray
        float32, (H, W), 0..1.

    Raises
    ------
    ValueError
        Heights of another shape, not finite, or outside 0..1; a size out of range.
    TypeError
        No function, no numbers, or a size that is no whole number.
    """
    if not callable(function):
        raise TypeError(f"function must be a function of u and v, got {type(function).__name__}")
    u, v = _centres(size)
    shape = (v.shape[0], u.shape[1])
    values = np.asarray(function(u, v))
    if values.dtype.kind not in "fiu":
        raise TypeError(f"function must give numbers, got dtype {values.dtype}")
    try:
        plane = np.broadcast_to(values, shape)
    except ValueError:
        raise ValueError(
            f"function must give heights that broadcast to {shape}, got {values.shape}"
        ) from None
    if not np.isfinite(plane).all():
        raise ValueError("function gave NaN or infinity")
    low, high = float(plane.min()), float(plane.max())
    if low < 0.0 or high > 1.0:
        raise ValueError(f"function must give heights in 0..1, got {low:g} to {high:g}")
    return np.ascontiguousarray(plane, np.float32)


def _centres(size: int | tuple[int, int]) -> tuple[_Plane, _Plane]:
    """Texel centres of a map of that size, once it is in range."""
    width, height = width_and_height(size)
    limit = _bumpwgpu.MAX_SIDE
    if not (1 <= width <= limit and 1 <= height <= limit) or width * height > MAX_TEXELS:
        raise ValueError(
            f"size is {width} x {height}; each side must be 1 to {limit}, "
            f"and no more than {MAX_TEXELS} texels in all"
        )
    u = (np.arange(width) + 0.5)[None] / width
    return u, (np.arange(height) + 0.5)[:, None] / height
