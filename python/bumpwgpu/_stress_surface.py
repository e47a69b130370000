"""The bilinear surface in double precision, with wraps of its own: what the stability suite goes by."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .heightmap import HeightMap

__all__ = ["folded", "gradients", "padded", "surface"]

Heights = NDArray[np.float64]


def padded(source: HeightMap, by: int = 1) -> Heights:
    """The heights with what lies beyond the edge, in double precision."""
    rows, columns = (folded(np.arange(-by, side + by), side, source.wrap) for side in source.shape)
    return source.array.astype(np.float64)[np.ix_(rows, columns)]


def folded(index: NDArray[np.int64], side: int, wrap: str) -> NDArray[np.int64]:
    if wrap == "repeat":
        return index % side
    if wrap == "clamp":
        return np.clip(index, 0, side - 1)
    turned = index % (2 * side)
    return np.where(turned < side, turned, 2 * side - 1 - turned)


def surface(source: HeightMap, u: Heights, v: Heights) -> Heights:
    """The bilinear surface in double precision."""
    rows, columns = source.shape
    x, y = u * columns - 0.5, v * rows - 0.5
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    f, g = x - i, y - j
    heights = source.array.astype(np.float64)
    left, right = (folded(i + step, columns, source.wrap) for step in (0, 1))
    above, below = (folded(j + step, rows, source.wrap) for step in (0, 1))
    upper = heights[above, left] * (1 - f) + heights[above, right] * f
    lower = heights[below, left] * (1 - f) + heights[below, right] * f
    height: Heights = upper * (1 - g) + lower * g
    return height


def gradients(source: HeightMap, x: Heights, y: Heights) -> tuple[Heights, Heights]:
    """Height a texel along x and y at these places, in texels from the centre of the first."""
    rows, columns = source.shape
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    f, g = x - i, y - j
    heights = source.array.astype(np.float64)
    left, right = (folded(i + step, columns, source.wrap) for step in (0, 1))
    above, below = (folded(j + step, rows, source.wrap) for step in (0, 1))
    upper = heights[above, right] - heights[above, left]
    lower = heights[below, right] - heights[below, left]
    near = heights[below, left] - heights[above, left]
    far = heights[below, right] - heights[above, right]
    return upper * (1 - g) + lower * g, near * (1 - f) + far * f
