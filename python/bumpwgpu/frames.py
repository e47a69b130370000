"""Tangent frames for plain arrays, and what is known of each method."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._checks import choice, flag, rows
from .errors import BumpWarning

__all__ = ["TANGENT_METHODS", "TangentMethod", "Tangents", "tangents"]

#: Most vertices that arrays without indices may have: each is a corner of its own.
_MAX_VERTICES = 1 << 25


class TangentMethod(NamedTuple):
    """What is known of one way to find tangents.

    Attributes
    ----------
    name : str
        As in ``tangents(method=...)``.
    summary : str
        What it does.
    guarantee : str
        What can be relied on, and what cannot.
    source : str
        The work it comes from.
    """

    name: str
    summary: str
    guarantee: str
    source: str


#: Every method by its name, the standard first.
TANGENT_METHODS: dict[str, TangentMethod] = {
    entry[0]: TangentMethod(*entry) for entry in _bumpwgpu.tangent_methods()
}


class Tangents(NamedTuple):
    """Tangent frames, and the vertices they need.

    Attributes
    ----------
    tangents : ndarray of float32, (M, 4)
        As in glTF: xyz of unit length, w = +1 or -1; ``w * cross(normal, tangent)`` points up the image.
    indices : ndarray of uint32, (F, 3) or (F, 4)
        The faces in their given order, over the M vertices.
    source : ndarray of uint32, (M,)
        The given vertex that each of them is a copy of; where frames of one vertex differ (mirrored
        charts, seams) it was split. ``attribute[source]`` carries any other attribute over.
    """

    tangents: NDArray[np.float32]
    indices: NDArray[np.uint32]
    source: NDArray[np.uint32]


def tangents(
    positions: ArrayLike,
    indices: ArrayLike | None,
    uvs: ArrayLike,
    normals: ArrayLike | None = None,
    method: str = "mikktspace",
    *,
    weld: bool = False,
    flip_v: bool = False,
) -> Tangents:
    """Tangent frames of a mesh given as arrays.

    MikkTSpace runs on unindexed corners, as its standard asks: vertices that are equal in position,
    normal and UV count as one whatever the indices say, and a vertex whose corners get different
    tangents is split.

    Parameters
    ----------
    positions : array_like, (V, 3)
        Any unit.
    indices : array_like of int, (F, 3) or (F, 4), or None
        Triangles or quads, counter-clockwise seen from outside. None: each three vertices in a row
        are a triangle. Quads are for ``"mikktspace"`` alone, which splits them along the shorter
        diagonal of their UVs, as Blender does; a triangle among them repeats its last vertex.
    uvs : array_like, (V, 2)
        Texture coordinates, origin at the top left of the image, v down, as in glTF.
    normals : array_like, (V, 3), optional
        Any length but zero. None: as :class:`bumpwgpu.Mesh` makes them, the angle-weighted mean over
        the triangles that use a vertex.
    method : str, default "mikktspace"
        A key of ``bumpwgpu.frames.TANGENT_METHODS``: "mikktspace", "dietrich", "edge", "axis",
        "averaged", "split", "uv_gradient" or "derivative".
    weld : bool, default False
        Whether vertices that are equal in position, normal, UV and tangent become one, and unused
        ones go. Without it the first V vertices of the result are the given ones, and copies follow.
    flip_v : bool, default False
        For arrays whose v points up, as in OBJ files and Blender: the same as giving 1 - v.

    Returns
    -------
    Tangents

    Raises
    ------
    ValueError
        Wrong shapes, an index out of range, NaN or infinity, an unknown method, quads with another
        method than MikkTSpace.
    TypeError
        Arrays that do not hold numbers.
    MeshError
        A mesh too large to be used.

    Warns
    -----
    BumpWarning
        Vertices whose UVs are degenerate and have no sound neighbour got an arbitrary direction.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> found = bw.tangents(square, [[0, 1, 2, 3]], [[0, 1], [1, 1], [1, 0], [0, 0]])
    >>> found.tangents[0].tolist(), found.indices.tolist()
    ([1.0, 0.0, 0.0, 1.0], [[0, 1, 2, 3]])
    """
    choice("method", method, tuple(TANGENT_METHODS))
    places = floats("positions", positions, 3)
    faces = _corners(len(places)) if indices is None else whole_rows(indices, quads=True)
    if faces.shape[1] == 4 and method != "mikktspace":
        raise ValueError(f"method {method!r} takes triangles, got quads; split them, or use 'mikktspace'")
    image = floats("uvs", uvs, 2)
    if flag("flip_v", flip_v):
        # Without the 1, which shifts the image and no tangent, nothing is rounded.
        image = np.column_stack((image[:, 0], -image[:, 1]))
    found, faces, source, texts = _bumpwgpu.tangents(
        places,
        faces,
        image,
        None if normals is None else floats("normals", normals, 3),
        method,
        flag("weld", weld),
    )
    for text in texts:
        warnings.warn(text, BumpWarning, stacklevel=2)
    return Tangents(found, faces, source)


def floats(name: str, values: ArrayLike, width: int) -> NDArray[np.float32]:
    """Numbers of shape (N, width) as the core takes them."""
    with np.errstate(over="ignore"):
        return np.require(rows(name, values, width), np.float32, ("C", "A"))


def whole_rows(values: ArrayLike, *, quads: bool = False) -> NDArray[np.uint32]:
    """Vertex numbers of triangles, or of quads where those are taken."""
    shape = getattr(values, "shape", None) or np.shape(values)
    array = rows("indices", values, 4 if quads and len(shape) == 2 and shape[1] == 4 else 3)
    if array.dtype.kind == "f":
        raise TypeError(f"indices must be whole numbers, got dtype {array.dtype}")
    if array.size and (int(array.min()) < 0 or int(array.max()) > 0xFFFFFFFF):
        row = int(np.argmax(((array < 0) | (array > 0xFFFFFFFF)).any(axis=1)))
        raise ValueError(f"indices: triangle {row} is {array[row].tolist()}; vertices are counted from 0")
    return np.require(array, np.uint32, ("C", "A"))


def _corners(vertices: int) -> NDArray[np.uint32]:
    if vertices % 3:
        raise ValueError(f"without indices each three vertices are a triangle, got {vertices} vertices")
    return np.arange(min(vertices, _MAX_VERTICES), dtype=np.uint32).reshape(-1, 3)
