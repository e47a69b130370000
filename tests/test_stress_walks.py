"""The stability suite before a walk of one's own: sound as it is, and with the faults that walks have.

The walk goes from cell to cell in numpy, for all rays side by side, and shares no code with the package.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_stress import checks

import bumpwgpu as bw
from bumpwgpu._stress_surface import gradients


def wrapped(at: Any, count: int, wrap: str) -> Any:
    """Texels of columns or rows beyond the edge."""
    at = at.astype(np.int64)
    if wrap == "clamp":
        return np.clip(at, 0, count - 1)
    if wrap == "mirror":
        at = at % (2 * count)
        return np.where(at < count, at, 2 * count - 1 - at)
    return at % count


def walk(
    nudge: float = 0.0, kind: Any = np.float64, wrap: str | None = None, low: float = 0.0, most: int = 8000
) -> Any:
    """A `march` that finds the first hit; `nudge` and `kind` make it recover its cell from a position.

    With a nudge it steps over each border by that much of the ray; in 32 bits it does not know in which cell
    it is; `wrap` stands in for that of the map; `low` lets the ray enter below the lid. It gives up after
    `most` cells.
    """
    recovers = nudge > 0.0 or kind is np.float32

    def march(height_map: Any, origins: Any, directions: Any, _: Any, **__: Any) -> SimpleNamespace:
        rows, columns = height_map.shape
        heights, size = height_map.array.astype(np.float64), np.array([columns, rows], np.float64)
        how = wrap or height_map.wrap
        o, d = origins.astype(np.float64), directions.astype(np.float64)
        down = -d[:, 2]
        last, t = o[:, 2] / down, np.maximum((o[:, 2] - 1.0 + low) / down, 0.0)

        def cells(along: Any) -> Any:
            uv = origins[:, :2].astype(kind) + along[:, None].astype(kind) * directions[:, :2].astype(kind)
            return np.floor(uv * size.astype(kind) - kind(0.5)).astype(np.float64)

        cell, found = cells(t), np.full(len(t), np.inf)
        way = np.where(d[:, :2] > 0.0, 1.0, -1.0)
        going = np.ones(len(t), bool)
        for _step in range(most):
            with np.errstate(divide="ignore", invalid="ignore"):
                border = ((cell + (way > 0.0) + 0.5) / size - o[:, :2]) / d[:, :2]
            border = np.where(d[:, :2] == 0.0, np.inf, border)
            out = np.clip(np.minimum(border.min(axis=1), last), t, None)
            x, y = ([wrapped(cell[:, axis] + k, int(size[axis]), how) for k in (0, 1)] for axis in (0, 1))
            a, b, c, e = (heights[y[j], x[i]] for j in (0, 1) for i in (0, 1))

            def gap(
                along: Any, cell: Any = cell, a: Any = a, b: Any = b, c: Any = c, e: Any = e, o: Any = o
            ) -> Any:
                f = ((o[:, :2] + along[:, None] * d[:, :2]) * size - 0.5 - cell).T
                top, bottom = a + (b - a) * f[0], c + (e - c) * f[0]
                return o[:, 2] - along * down - (top + (bottom - top) * f[1])

            # Along a ray the gap is a quadratic: through its values at both ends and in the middle.
            g = [gap(t + share * (out - t)) for share in (0.0, 0.5, 1.0)]
            bend, slope = 2.0 * (g[0] - 2.0 * g[1] + g[2]), 4.0 * g[1] - 3.0 * g[0] - g[2]
            with np.errstate(divide="ignore", invalid="ignore"):
                root = np.sqrt(np.maximum(slope * slope - 4.0 * bend * g[0], 0.0))
                q = -0.5 * (slope + np.where(slope < 0.0, -root, root))
                pair = np.stack([g[0] / q, q / bend])
            real = (slope * slope >= 4.0 * bend * g[0]) & np.isfinite(pair) & (pair >= 0.0) & (pair <= 1.0)
            share = np.where(real, pair, np.inf).min(axis=0)
            share = np.where(g[0] <= 0.0, 0.0, np.where((g[2] <= 0.0) & np.isinf(share), 1.0, share))
            hit = going & np.isfinite(share)
            found = np.where(hit, t + np.where(hit, share, 0.0) * (out - t), found)
            going &= ~hit & (out < last)
            if not going.any():
                break
            if recovers:
                t = np.where(going, out + nudge, t)
                cell = np.where(going[:, None], cells(t), cell)
            else:
                t = np.where(going, out, t)
                axis = border.argmin(axis=1)
                step = np.zeros_like(cell)
                step[np.arange(len(t)), axis] = way[np.arange(len(t)), axis]
                cell = np.where(going[:, None], cell + step, cell)
        status = np.where(np.isfinite(found), 0, np.where(going, 2, 1)).astype(np.uint8)
        known = np.where(np.isfinite(found), found, 0.0)
        place = np.where(np.isfinite(found)[:, None], o + known[:, None] * d, np.nan)
        at = np.nan_to_num(place[:, :2]) * size - 0.5
        slopes = np.stack(gradients(height_map, *at.T), axis=-1) * size
        normal = np.concatenate([-slopes, np.ones((len(t), 1))], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        return SimpleNamespace(
            t=found.astype(np.float32),
            uv=place[:, :2].astype(np.float32),
            z=np.clip(place[:, 2], 0.0, 1.0).astype(np.float32),
            normal=normal,
            status=status,
        )

    return march


def stressed(march: Any, only: str, rays: int = 24) -> bw.StressResult:
    return bw.stress("exact", maps=[], frames=[], march=march, rays=rays, only=only)


SOUND = (
    "45 degrees",
    "85 degrees",
    "cell border",
    "1000 tiles",
    "spike",
    "checkerboard",
    "1 x N",
    "far start",
)


def test_a_sound_walk_passes() -> None:
    for only in SOUND:
        made = stressed(walk(), only)
        assert made, str(made)


def test_a_walk_without_wrap_is_found() -> None:
    for only in ("45 degrees, repeat", "45 degrees, mirror", "1000 tiles", "cell border"):
        assert not stressed(walk(wrap="clamp"), only), only


def test_a_walk_that_enters_below_the_lid_is_found() -> None:
    assert "on the surface" in checks(stressed(walk(low=1e-5), "flat 1"))


def test_cells_of_32_bits_are_found() -> None:
    # It comes back to the same cell again and again: a texel is 2^-5 of a tile, and 1000 tiles have 2^10.
    assert "answers" in checks(stressed(walk(kind=np.float32, most=400), "1000 tiles"))


def test_a_nudge_over_each_border_is_found() -> None:
    # What is passed over is as deep as the surface may rise along the nudge, a little near the horizon.
    found = stressed(walk(nudge=1e-5), "89.9 degrees, repeat", rays=128)
    assert "on the surface" in checks(found)


@pytest.mark.slow
def test_the_least_nudge_is_told_from_a_sound_walk() -> None:
    made = stressed(walk(most=60_000), "89.9", rays=128)
    assert made, str(made)
    assert "on the surface" in checks(stressed(walk(nudge=1e-6, most=60_000), "89.99", rays=128))
