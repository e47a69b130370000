"""Surfaces in closed form, and their normals under a relief: what renderings are measured against.

>>> import numpy as np
>>> from bumpwgpu import surfaces
>>> ball = surfaces.sphere([[0.5, 0.5]], radius=2.0)
>>> ball.position.round(6).tolist()
[[0.0, 0.0, 2.0]]
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._checks import choice, number, rows

__all__ = ["FORMULAS", "SurfacePoints", "bump_normals", "sphere", "torus"]

_Floats: TypeAlias = NDArray[np.float64]
#: A height function: u and v, each (N,), to heights (N,), or to (heights, dh/du, dh/dv).
Height: TypeAlias = Callable[[_Floats, _Floats], ArrayLike | tuple[ArrayLike, ArrayLike, ArrayLike]]

#: How normals are bent, the plainest first.
FORMULAS = ("orthogonal", "general", "blinn", "exact")


class SurfacePoints(NamedTuple):
    """Points of a parametric surface, float64 (N, 3) each; ``v`` runs down the image.

    Attributes
    ----------
    position, normal : ndarray
        Mesh units, and unit length.
    dpdu, dpdv : ndarray
        Derivatives of the position, mesh units per UV unit.
    dndu, dndv : ndarray
        Derivatives of the normal, per UV unit.
    """

    position: _Floats
    normal: _Floats
    dpdu: _Floats
    dpdv: _Floats
    dndu: _Floats
    dndv: _Floats


def sphere(uv: ArrayLike, radius: float = 0.5) -> SurfacePoints:
    """The sphere of :meth:`bumpwgpu.Mesh.sphere`.

    Parameters
    ----------
    uv : array_like, (N, 2)
        Longitude from the seam and colatitude, 0..1.
    radius : float, default 0.5
        Mesh units; positive.

    Returns
    -------
    SurfacePoints

    Raises
    ------
    ValueError, TypeError
        A radius that is not positive, or arrays of another shape or kind.
    """
    return _points("sphere", (_radius("radius", radius), 0.0), uv)


def torus(uv: ArrayLike, major: float = 0.7, minor: float = 0.3) -> SurfacePoints:
    """The torus of :meth:`bumpwgpu.Mesh.torus`.

    Parameters
    ----------
    uv : array_like, (N, 2)
        Around the ring and around the tube, 0..1.
    major, minor : float, default 0.7 and 0.3
        Radii of ring and tube, mesh units; positive.

    Returns
    -------
    SurfacePoints

    Raises
    ------
    ValueError, TypeError
        A radius that is not positive, or arrays of another shape or kind.
    """
    return _points("torus", (_radius("major", major), _radius("minor", minor)), uv)


def bump_normals(
    points: SurfacePoints,
    uv: ArrayLike,
    height: Height,
    *,
    scale: float = 0.1,
    base: float = 1.0,
    formula: str = "exact",
    differences: str = "central",
    step: float = 1e-4,
) -> _Floats:
    """Unit normals of a surface under a relief given by any function.

    Parameters
    ----------
    points : SurfacePoints
        Of :func:`sphere`, :func:`torus`, or of any other surface.
    uv : array_like, (N, 2)
        Where the points are on the map.
    height : callable
        ``height(u, v)`` with arrays (N,) gives heights (N,), 0..1, or a tuple of heights, dh/du and dh/dv;
        then no differences are taken.
    scale : float, default 0.1
        Height range, mesh units.
    base : float, default 1
        The height that lies on the surface, 0..1.
    formula : {"exact", "general", "blinn", "orthogonal"}
        ``"exact"``: the normal of the displaced surface, with the term h dN/du. ``"general"``: without
        it, axes at any angle, level heights keep the normal. ``"blinn"``: as published, the normal of the
        axes is bent (Blinn 1978). ``"orthogonal"``: as if the axes were orthogonal.
    differences : {"central", "forward"}
        Second order, or first order with fewer calls.
    step : float, default 1e-4
        How far to look for differences, in uv.

    Returns
    -------
    ndarray of float64, (N, 3)

    Raises
    ------
    ValueError, TypeError
        Wrong shapes, values out of range, heights that are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from bumpwgpu import surfaces
    >>> uv = np.array([[0.3, 0.4], [0.6, 0.5]])
    >>> ball = surfaces.sphere(uv)
    >>> level = surfaces.bump_normals(ball, uv, lambda u, v: 0 * u + 0.5)
    >>> bool(np.allclose(level, ball.normal))
    True
    """
    choice("formula", formula, FORMULAS)
    choice("differences", differences, ("central", "forward"))
    scale, base = number("scale", scale, 0.0), number("base", base, 0.0, 1.0)
    step = number("step", step)
    if not step > 0.0:
        raise ValueError(f"step must be positive, got {step:g}")
    places = _table("uv", uv, 2)
    heights, du, dv = _slopes(height, places, differences, step)
    parts = [_table(name, part, 3) for name, part in zip(SurfacePoints._fields, points, strict=True)]
    if any(len(part) != len(places) for part in parts):
        raise ValueError(f"{len(parts[0])} points for {len(places)} uvs; one each needed")
    _, normal, dpdu, dpdv, dndu, dndv = parts
    slopes = np.ascontiguousarray(np.column_stack((du, dv)) * scale)
    rise = scale * (heights - base)
    return _bumpwgpu.bend_normals(formula, normal, dpdu, dpdv, dndu, dndv, slopes, rise)


def _slopes(height: Height, uv: _Floats, differences: str, step: float) -> tuple[_Floats, _Floats, _Floats]:
    """Heights and their derivatives."""
    if not callable(height):
        raise TypeError(f"height must be a function of u and v, got {type(height).__name__}")
    u, v = uv[:, 0], uv[:, 1]
    here = height(u, v)
    if isinstance(here, tuple):
        if len(here) != 3:
            raise ValueError(f"height gave {len(here)} arrays; expected heights, dh/du and dh/dv")
        values, du, dv = (_column(part, len(uv)) for part in here)
        return values, du, dv

    def at(du: float, dv: float) -> _Floats:
        found = height(u + du, v + dv)
        if isinstance(found, tuple):
            raise TypeError("height gave one array and then several")
        return _column(found, len(uv))

    values = _column(here, len(uv))
    if differences == "forward":
        return values, (at(step, 0.0) - values) / step, (at(0.0, step) - values) / step
    return (
        values,
        (at(step, 0.0) - at(-step, 0.0)) / (2.0 * step),
        (at(0.0, step) - at(0.0, -step)) / (2.0 * step),
    )


def _column(values: ArrayLike, count: int) -> _Floats:
    column = np.asarray(values, np.float64)
    if column.shape != (count,):
        raise ValueError(f"height must give one number a point, shape ({count},), got {column.shape}")
    if not np.isfinite(column).all():
        raise ValueError("height gave NaN or infinity")
    return np.ascontiguousarray(column)


def _table(name: str, values: ArrayLike, width: int) -> _Floats:
    table = np.require(rows(name, values, width), np.float64, ("C", "A"))
    if not np.isfinite(table).all():
        raise ValueError(f"{name} holds NaN or infinity")
    return table


def _radius(name: str, value: float) -> float:
    radius = number(name, value)
    if not radius > 0.0:
        raise ValueError(f"{name} must be positive, got {radius:g}")
    return radius


def _points(shape: str, radii: tuple[float, float], uv: ArrayLike) -> SurfacePoints:
    return SurfacePoints(*_bumpwgpu.surface_points(shape, radii, _table("uv", uv, 2)))
