"""Baking maps from height maps, and saving them."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._atomic import replace_file
from ._checks import choice, width_and_height
from ._map_info import MAPS as _INFO
from ._map_info import OPTIONS, MapChannel, MapInfo, MapOption, form_of, listing, takers
from .errors import BakeError, BumpWarning
from .heightmap import HEIGHT_MAP_SETTINGS, HeightMap, HeightSource, Wrap
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


class Maps(Mapping[str, Any]):
    """Baked maps by name.

    ``maps["normal"]``, ``["normal_xy"]`` and ``["relief"]`` are float32 arrays of shape (H, W, 3),
    (H, W, 2) and (H, W, 4): unit normals in -1..1 (+X right, +Y up unless baked otherwise, +Z out),
    and height in 0..1. ``maps["pyramid"]`` is a tuple of (h, w, 2) arrays, finest first: the lowest
    and the highest point of ever larger blocks of the bilinear surface. Maps of one channel have
    shape (H, W), stacks of slices (N, H, W); :func:`bumpwgpu.baking.about` describes each map.
    """

    __slots__ = ("_layers",)

    def __init__(self, layers: dict[str, tuple[NDArray[np.float32], ...]]) -> None:
        self._layers = layers

    def __getitem__(self, name: str) -> Any:
        layers = self._layers[name]
        return layers if form_of(name) == "levels" else layers[0]

    def __iter__(self) -> Iterator[str]:
        return iter(self._layers)

    def __len__(self) -> int:
        return len(self._layers)

    def __repr__(self) -> str:
        return f"<Maps: {', '.join(f'{name} {layers[0].shape}' for name, layers in self._layers.items())}>"

    def save(
        self,
        folder: str | os.PathLike[str],
        *,
        format: Literal["png", "exr", "npy"] = "png",
        bits: Literal[8, 16] | None = None,
        prefix: str = "",
    ) -> list[Path]:
        """Write every map into a folder, which is made if need be.

        Each file gets a temporary name first, so an interrupted run leaves no half of one.

        Parameters
        ----------
        folder : path
            Where to.
        format : {"png", "exr", "npy"}
            PNG holds ``(n + 1) / 2`` for normals, heights as they are, and 0 in the blue channel of
            two-channel maps; of a pyramid, minima are rounded down and maxima up. EXR and npy hold
            the floats.
        bits : 8, 16 or None
            Of a PNG; None is 8. A flat normal is (128, 128, 255) in 8 bits.
        prefix : str, default ""
            Files are ``<prefix>_<map>.png``, levels of a pyramid ``<prefix>_pyramid_00.png``.

        Returns
        -------
        list of Path
            The files made.

        Raises
        ------
        BakeError, OSError
            A file cannot be written.
        ValueError, TypeError
            An unknown format, or a prefix that is no file name.

        Warns
        -----
        BumpWarning
            `bits` together with a format of floats.

        Examples
        --------
        >>> import bumpwgpu as bw, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in bw.bake(bw.HeightMap([[0.0, 1.0]])).save(folder, bits=16)]
        ['normal.png']
        """
        choice("format", format, ("png", "exr", "npy"))
        if bits is not None and (isinstance(bits, bool) or bits not in (8, 16)):
            raise ValueError(f"bits must be 8 or 16, got {bits!r}")
        if bits is not None and format != "png":
            _warn(f"bits={bits} has no effect: {format} files hold floats")
        if not isinstance(prefix, str):
            raise TypeError(f"prefix must be a string, got {type(prefix).__name__}")
        if "/" in prefix or "\\" in prefix or "\0" in prefix:
            raise ValueError(f"prefix must be part of a file name, got {prefix!r}")
        target = _folder(folder)
        made: list[Path] = []
        for name, layers in self._layers.items():
            if format == "npy":
                made += _save_npy(name, layers, target, prefix)
            else:
                arrays = [np.require(layer, np.float32, ("C", "A")) for layer in layers]
                depth = 32 if format == "exr" else bits or 8
                made += _bumpwgpu.save_map(name, arrays, target, prefix, format, depth)
        return made


def _warn(text: str) -> None:
    warnings.warn(text, BumpWarning, stacklevel=3)


def _folder(folder: Any) -> Path:
    if not isinstance(folder, str | os.PathLike):
        raise TypeError(f"folder must be a string or a path, got {type(folder).__name__}")
    target = Path(folder)
    if "\0" in str(target):
        raise ValueError("folder contains a null character")
    try:
        target.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise BakeError(f"cannot write into {target}: it is a file, not a folder") from None
    return target


def _save_npy(name: str, layers: tuple[NDArray[np.float32], ...], folder: Path, prefix: str) -> list[Path]:
    stem = f"{prefix}_{name}" if prefix else name
    made = []
    for level, layer in enumerate(layers):
        path = folder / (f"{stem}_{level:02}.npy" if form_of(name) == "levels" else f"{stem}.npy")
        data = BytesIO()
        np.save(data, layer, allow_pickle=False)
        made.append(replace_file(path, data.getvalue()))
    return made


def bake(
    source: HeightMap | HeightSource | Mesh,
    maps: str | Iterable[str] = ("normal",),
    *,
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

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> maps = bw.bake(bw.HeightMap.procedural("flat", 8), maps=("normal", "pyramid"), kernel="scharr")
    >>> maps["normal"][0, 0].tolist(), len(maps["pyramid"])
    ([0.0, 0.0, 1.0], 4)
    """
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be callable, got {type(progress).__name__}")
    # Maps of meshes are Maps too, so that module imports this one.
    from .mesh_maps import bake_mesh, opened

    source = opened(source)
    if isinstance(source, Mesh):
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
        heights = HeightMap(source, **settings)
    for name in given:
        if not any(_INFO[wanted].option(name) for wanted in names):
            _warn(
                f"{name} has no effect: none of {', '.join(names)} takes it, only {', '.join(takers(name))}"
            )
    rows = heights.shape[0]
    layers = {}
    for at, name in enumerate(names):
        made = _bumpwgpu.bake_map(heights._field, name, values[name], progress, at * rows, len(names) * rows)
        layers[name] = tuple(made)
    return Maps(layers)


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
