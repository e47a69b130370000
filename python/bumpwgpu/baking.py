"""Baking maps from height maps, and saving them."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import DTypeLike

from . import _bumpwgpu
from ._checks import choice, flag, number, whole, width_and_height
from ._map_info import MAPS as _INFO
from ._map_info import OPTIONS, MapChannel, MapInfo, MapOption, listing, takers
from ._sidecar import SavedFile, write_sidecar
from .errors import BumpWarning
from .heightmap import (
    HEIGHT_MAP_SETTINGS,
    BorrowedHeightMap,
    HeightMap,
    HeightRange,
    HeightSource,
    Wrap,
    checked_extent,
)
from .maps import BakedMap, Maps
from .meshes import Mesh

__all__ = [
    "CONVENTIONS",
    "KERNELS",
    "MAPS",
    "MapChannel",
    "MapInfo",
    "MapOption",
    "Maps",
    "Progress",
    "about",
    "bake",
    "bake_file",
    "estimate",
]

Progress: TypeAlias = Callable[[int, int], object]

#: Maps that can be baked.
MAPS: tuple[str, ...] = tuple(_INFO)
#: Slope kernels.
KERNELS: tuple[str, ...] = OPTIONS["kernel"][0].choices
#: Which way green points.
CONVENTIONS: tuple[str, ...] = OPTIONS["convention"][0].choices


def about(name: str) -> MapInfo:
    """What a map is: its options, channels, source.

    Parameters
    ----------
    name : str
        One of :data:`MAPS`.

    Returns
    -------
    MapInfo

    Raises
    ------
    ValueError
        An unknown map.

    Examples
    --------
    >>> from bumpwgpu import baking
    >>> info = baking.about("normal")
    >>> [option.name for option in info.options], [channel.name for channel in info.channels]
    (['kernel', 'convention'], ['x', 'y', 'z'])
    """
    return _INFO[choice("map", name, MAPS)]


def estimate(size: tuple[int, int], name: str, *, wrap: Wrap = "repeat", **options: Any) -> tuple[int, int]:
    """Bytes of a map before it is baked, and those its bake needs besides.

    Parameters
    ----------
    size : (int, int)
        Width and height of the height map.
    name : str
        One of :data:`MAPS`.
    wrap : {"repeat", "clamp", "mirror"}
        As for :class:`HeightMap`.
    **options
        What the map takes.

    Returns
    -------
    (int, int)

    Raises
    ------
    ValueError, TypeError
        An unknown map or option, a value out of range.

    Examples
    --------
    >>> from bumpwgpu import baking
    >>> baking.estimate((1024, 1024), "normal")
    (12582912, 0)
    """
    info = about(name)
    width, height = width_and_height(size)
    if not (1 <= width <= _bumpwgpu.MAX_SIDE and 1 <= height <= _bumpwgpu.MAX_SIDE):
        raise ValueError(f"size must be 1..{_bumpwgpu.MAX_SIDE} each way, got ({width}, {height})")
    _refuse_unknown(options, [name])
    choice("wrap", wrap, ("repeat", "clamp", "mirror"))
    return _bumpwgpu.map_bytes(name, list(info.complete(options).items()), width, height, wrap)


def _warn(text: str) -> None:
    warnings.warn(text, BumpWarning, stacklevel=3)


def bake(
    source: HeightMap | HeightSource | Mesh,
    maps: str | Iterable[str] = ("normal",),
    *,
    dtype: DTypeLike = "float32",
    progress: Progress | None = None,
    **options: Any,
) -> Maps:
    """Make the maps a renderer needs from a height map, or from a mesh.

    Parameters
    ----------
    source : HeightMap, path, array or PIL image; or Mesh, or path to one
        The heights, or the plain mesh whose UVs the maps are for.
    maps : str or iterable of str, default ("normal",)
        Any of :data:`bumpwgpu.baking.MAPS`; of a mesh, any of :data:`bumpwgpu.mesh_maps.MESH_MAPS`.
    dtype : {"float32", "uint8", "uint16"}
        Type of the arrays. Integers are what files of 8 and 16 bits hold (see :meth:`Maps.save`):
        ``(n + 1) / 2`` for normals, bounds rounded to the safe side; normals in 8 bits take a fraction
        of the time and memory of floats.
    progress : callable or None
        Called as ``progress(done, total)``, in rows, on the calling thread; an exception from it
        stops the bake.
    **options
        What the maps take (:func:`bumpwgpu.baking.about`), such as ``kernel`` and ``convention`` of
        those that hold normals; each goes to every map that has it. For sources that are no HeightMap
        yet, also what :class:`HeightMap` takes, such as ``scale``. For meshes see below.

    Returns
    -------
    Maps
        For a mesh :class:`bumpwgpu.MeshMaps`, which also has a report.

    Other Parameters
    ----------------
    detail : Mesh or path
        The detailed mesh. "normal", "height" and "ao" hold what rays from the plain mesh meet first of
        it; "tangents" needs none.
    size : int or (int, int), default 1024
        Texels: the side of a square, or (width, height).
    front, rear : float or None
        How far above the plain mesh rays start, and how far below it they end, mesh units, along its
        interpolated normals. None measures how far the detailed mesh rises and sinks.
    cage : Mesh or path
        The plain mesh with its vertices moved outwards; rays run from there to the plain mesh and
        ``rear`` further. Same triangles in the same order.
    samples : int, default 1
        Along each side of a texel, up to 8; their mean is stored.
    padding : int, default 16
        Texels by which charts are grown.
    space : {"tangent", "object"}
        Of the normals; the tangent frame is the one the mesh is drawn with, MikkTSpace's unless the
        file has its own. ``convention`` as above.
    back_faces : bool, default False
        Whether rays stop at triangles seen from behind.
    rays, distance, seed
        Of "ao": rays a sample (64), how far things shade in mesh units (None: any distance), and which
        of many sets of directions (0).

    Raises
    ------
    ValueError
        An unknown map, an option out of range, or what :class:`HeightMap` raises.
    TypeError
        An option that no map has, or of the wrong type.
    FileNotFoundError, BakeError
        The source file is missing or damaged; a map would not fit into memory.

    Warns
    -----
    BumpWarning
        An option that none of the maps asked for takes, though others do.

    Notes
    -----
    The normal of a texel is ``normalize(-dh/dx, dh/dy, 1)`` (y down) with slopes per mesh unit:
    ``scale * dh/dtexel * W / tile_size`` (Blinn 1978; Cohen, Olano, Manocha 1998).

    Maps that take seconds are kept on disk and found again when heights, extent, wrap and options are
    the same: up to 2 GiB in the user's cache folder, those used least recently go first. The environment
    variable ``BUMPWGPU_CACHE`` names another folder, or switches it off with ``off``.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> maps = bw.bake(bw.HeightMap.procedural("flat", 8), maps=("normal", "pyramid"), kernel="scharr")
    >>> maps["normal"][0, 0].tolist(), len(maps["pyramid"])
    ([0.0, 0.0, 1.0], 4)
    """
    numbers = _dtype(dtype)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be callable, got {type(progress).__name__}")
    # Maps of meshes are Maps too, so that module imports this one.
    from .mesh_maps import bake_mesh, opened

    source = opened(source)
    if isinstance(source, Mesh):
        if numbers != "float32":
            raise ValueError(f"maps of a mesh are baked as float32, not {numbers}; save() makes integers")
        return bake_mesh(source, maps, progress, options)
    names = _map_names(maps)
    settings = {name: value for name, value in options.items() if name in HEIGHT_MAP_SETTINGS}
    given = {name: value for name, value in options.items() if name not in settings}
    _refuse_unknown(given, names)
    values = {name: list(_INFO[name].complete(given).items()) for name in names}
    if isinstance(source, HeightMap):
        if settings:
            raise TypeError(
                f"bake() got {', '.join(settings)}, but source is a HeightMap already; use its replace()"
            )
        heights = source
    else:
        heights = BorrowedHeightMap(source, **settings)
    for name in given:
        if not any(_INFO[wanted].option(name) for wanted in names):
            _warn(
                f"{name} has no effect: none of {', '.join(names)} takes it, only {', '.join(takers(name))}"
            )
    rows, columns = heights.shape
    about_source = {"size": [columns, rows], **_extent_of(heights)}
    made = {}
    for at, name in enumerate(names):
        part = (at * rows, len(names) * rows)
        if _INFO[name].by_rows:
            layers, ranges = _bumpwgpu.bake_rows(
                heights.array, heights.wrap, heights._extent, name, values[name], numbers, progress, *part
            )
        else:
            layers, ranges = _bumpwgpu.bake_map(heights._field, name, values[name], numbers, progress, *part)
        made[name] = BakedMap(tuple(layers), tuple(ranges), dict(values[name]), about_source)
    return Maps(made)


def bake_file(
    source: str | os.PathLike[str],
    target: str | os.PathLike[str],
    map: str = "normal",
    *,
    bits: Literal[8, 16] | None = None,
    scale: float = 0.1,
    base: float = 1.0,
    tile_size: float | tuple[float, float] = (1.0, 1.0),
    wrap: Wrap = "repeat",
    channel: int | None = None,
    invert: bool = False,
    height_range: HeightRange = None,
    progress: Progress | None = None,
    **options: Any,
) -> Path:
    """Make a map of a height map that memory does not hold: from file to file, by rows.

    A few million texels are in memory at any time, whatever the size. The file is bit for bit what
    :func:`bake` and :meth:`Maps.save` make, with the same sidecar beside it.

    Parameters
    ----------
    source : path
        The height map: ``.npy``, PNG without interlacing, or TIFF in strips or tiles.
    target : path
        The map: ``.png``, or ``.npy`` for floats.
    map : {"normal", "normal_xy", "relief"}
        Which map; others need all heights at once.
    bits : 8, 16 or None
        Of a PNG; None is 8.
    scale, base, tile_size, wrap, invert, height_range
        As for :class:`HeightMap`. ``height_range="auto"`` reads the file once more.
    channel : int or None
        The channel to read, needed when there are several.
    progress : callable or None
        Called as ``progress(done, total)``, in rows; an exception from it stops the bake.
    **options
        What the map takes (:func:`bumpwgpu.baking.about`).

    Returns
    -------
    Path
        The file made.

    Raises
    ------
    ValueError
        Heights or settings out of range, an unknown map, or one that needs all heights at once.
    TypeError
        Arguments of the wrong type, an unknown option.
    FileNotFoundError, BakeError
        The source is missing, damaged, or of a kind whose rows do not lie in order; the target cannot
        be written.

    Warns
    -----
    BumpWarning
        Heights were clipped to 0..1.

    Examples
    --------
    >>> import numpy as np, bumpwgpu as bw, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     heights = pathlib.Path(folder) / "heights.npy"
    ...     np.save(heights, np.zeros((4, 6), np.float32))
    ...     bw.bake_file(heights, pathlib.Path(folder) / "normal.png", bits=16).name
    'normal.png'
    """
    info = about(map)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be callable, got {type(progress).__name__}")
    read, written = _file(source, "source"), _file(target, "target")
    if written.suffix.lower() not in (".png", ".npy"):
        raise ValueError(f"target must end in .png or .npy, got {written.name!r}")
    if bits is not None and (isinstance(bits, bool) or bits not in (8, 16)):
        raise ValueError(f"bits must be 8 or 16, got {bits!r}")
    floats = written.suffix.lower() == ".npy"
    if bits is not None and floats:
        _warn(f"bits={bits} has no effect: npy files hold floats")
    numbers = "float32" if floats else f"uint{bits or 8}"
    extent = checked_extent(scale, base, tile_size)
    choice("wrap", wrap, ("repeat", "clamp", "mirror"))
    span: tuple[float, float] | None = None
    if height_range is not None and not isinstance(height_range, str):
        if not hasattr(height_range, "__len__") or len(height_range) != 2:
            raise TypeError(f'height_range must be None, "auto" or (low, high), got {height_range!r}')
        span = (number("height_range[0]", height_range[0]), number("height_range[1]", height_range[1]))
    elif height_range not in (None, "auto"):
        raise ValueError(f'height_range must be None, "auto" or (low, high), got {height_range!r}')
    reading = (
        None if channel is None else whole("channel", channel, 0),
        span,
        height_range == "auto",
        flag("invert", invert),
    )
    _refuse_unknown(options, [map])
    for name in options:
        if info.option(name) is None:
            _warn(f"{name} has no effect: {map} does not take it, only {', '.join(takers(name))}")
    values = info.complete(options)
    columns, rows, clipped, _ = _bumpwgpu.bake_file(
        read, written, map, list(values.items()), numbers, wrap, extent, reading, progress
    )
    if clipped:
        _warn(f"{read.name}: {clipped} heights outside the range were clipped to 0..1")
    about_source = {"size": [columns, rows], **dict(zip(_EXTENT, (*extent, wrap), strict=True))}
    ranges = [channel.range or (0.0, 1.0) for channel in info.channels]
    shape = (rows, columns, len(info.channels))
    file = SavedFile(written, 0, None, None)
    write_sidecar(written.with_suffix(".json"), info, values, about_source, numbers, ranges, [shape], [file])
    return written


_EXTENT = ("scale", "base", "tile_size", "wrap")


def _extent_of(heights: HeightMap) -> dict[str, Any]:
    return {name: getattr(heights, name) for name in _EXTENT}


def _file(path: Any, name: str) -> Path:
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"{name} must be a string or a path, got {type(path).__name__}")
    if "\0" in str(path):
        raise ValueError(f"{name} contains a null character")
    return Path(path)


def _dtype(dtype: Any) -> str:
    try:
        name = np.dtype(dtype).name
    except TypeError:
        raise TypeError(f"dtype must be float32, uint8 or uint16, got {dtype!r}") from None
    return choice("dtype", name, ("float32", "uint8", "uint16"))


def _refuse_unknown(options: Mapping[str, Any], names: list[str]) -> None:
    unknown = [name for name in options if name not in OPTIONS]
    if unknown:
        raise TypeError(f"unexpected options {', '.join(unknown)}; {', '.join(names)} takes {listing(names)}")
    for name, value in options.items():
        if not any(_INFO[wanted].option(name) for wanted in names):
            # Without effect, but a mistake all the same.
            OPTIONS[name][0].check(value)


def _map_names(maps: Any) -> list[str]:
    if isinstance(maps, str):
        maps = (maps,)
    try:
        names = list(maps)
    except TypeError:
        raise TypeError(f"maps must be names, got {type(maps).__name__}") from None
    for name in names:
        choice("map", name, MAPS)
    if not names:
        raise ValueError(f"maps is empty; ask for at least one of {', '.join(MAPS)}")
    return list(dict.fromkeys(names))
