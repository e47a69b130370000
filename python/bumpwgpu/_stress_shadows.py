"""Rays towards a light under stress: from a point of the surface, which must neither hide itself nor look
past what hides it.
"""

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

__all__ = ["MOST_BESIDE", "known_shadows", "shadow_checks"]

#: Height by which a ray may pass over or through the surface before it counts: what 32 bits make of a ray
#: over six tiles of 32 texels, times ten.
MOST_BESIDE = 1e-4


def shadow_checks(march: Callable[..., Any], technique: Technique, case: RayCase) -> Iterator[Check]:
    """Runs one search that promises the first hit from the surface; yields what was found."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", BumpWarning)
            hits = march(
                case.height_map,
                case.origins.astype(case.dtype),
                case.directions.astype(case.dtype),
                technique,
                device="cpu",
                from_surface=True,
            )
        hidden = np.asarray(hits.status) == 0
    except Exception as error:  # a fault in what is tested must become a line in the table
        yield failed("runs", f"{type(error).__name__}: {error}")
        return
    must, may_not = known_shadows(case.height_map, case.origins, case.directions, MOST_BESIDE)
    for name, wrong in (
        ("hidden where it should be", must & ~hidden),
        ("does not hide itself", may_not & hidden),
    ):
        at = int(wrong.argmax())
        place = ", ".join(f"{part:.9g}" for part in (*case.origins[at], *case.directions[at]))
        yield row(name, float(wrong.sum()), "rays", 0.0, f"ray {at}: {place}" if wrong.any() else "")


def known_shadows(
    height_map: HeightMap, origins: NDArray[np.float64], directions: NDArray[np.float64], beside: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points of the surface are surely hidden from a light above, and which surely are not.

    Hidden is what is still hidden when it is raised by `beside`, and in the light what is there when it is
    lowered by as much, whatever it digs through to come out again. Both by a plain walk in double precision,
    from the light to the point.
    """
    raised, lowered = (_deepest(height_map, origins, directions, way * beside) for way in (1.0, -1.0))
    # Where the walk gave up neither is known.
    with np.errstate(invalid="ignore"):
        return raised > 1e-12, lowered < 1e-12


def _deepest(
    height_map: HeightMap, origins: NDArray[np.float64], directions: NDArray[np.float64], lift: float
) -> NDArray[np.float64]:
    """How deep under the surface the ways to some points come, beyond how deep those themselves lie; else
    NaN.
    """
    points = origins + np.array([0.0, 0.0, lift])
    # From a little above the lid, and never from below.
    way = np.maximum((1.0 + 1e-3 - points[:, 2]) / directions[:, 2], 0.0)
    lights = points + way[:, None] * directions
    first, _, deepest, _ = _bumpwgpu.judge(
        height_map.array,
        height_map.wrap,
        np.ascontiguousarray(lights),
        np.ascontiguousarray(-directions),
        way,
    )
    return np.where(np.isnan(first), np.nan, deepest)
