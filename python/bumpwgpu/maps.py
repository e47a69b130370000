"""Baked maps: arrays by name, saved to files and read again."""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._atomic import replace_file
from ._checks import choice
from ._map_info import ALL_MAPS
from ._sidecar import SavedFile, read_map, sidecar_path, sidecars, write_sidecar
from .errors import BakeError, BumpWarning

__all__ = ["FORMATS", "Format", "Maps"]

Format: TypeAlias = Literal["png", "tiff", "exr", "npy"]
#: Bits a sample that each format can hold, the default first.
FORMATS: Mapping[str, tuple[int, ...]] = {"png": (8, 16), "tiff": (8, 16, 32), "exr": (32,), "npy": (32,)}
_BITS = {"uint8": 8, "uint16": 16, "float32": 32}


@dataclass(frozen=True)
class BakedMap:
    """One map of :class:`Maps`."""

    layers: tuple[NDArray[Any], ...]
    #: What the smallest and the largest integer stand for, a channel each.
    ranges: tuple[tuple[float, float], ...]
    options: dict[str, Any] = field(default_factory=dict)
    #: Size, extent and wrap of the height map.
    source: dict[str, Any] = field(default_factory=dict)


class Maps(Mapping[str, Any]):
    """Baked maps by name.

    ``maps["normal"]``, ``["normal_xy"]`` and ``["relief"]`` are float32 arrays of shape (H, W, 3),
    (H, W, 2) and (H, W, 4): unit normals in -1..1 (+X right, +Y up unless baked otherwise, +Z out),
    and height in 0..1. ``maps["pyramid"]`` is a tuple of (h, w, 2) arrays, finest first: the lowest
    and the highest point of ever larger blocks of the bilinear surface. Maps of one channel have
    shape (H, W), stacks of slices (N, H, W); :func:`bumpwgpu.baking.about` describes each map. Baked
    with another `dtype`, the arrays hold the integers that files do.
    """

    __slots__ = ("_maps",)

    def __init__(self, maps: Mapping[str, BakedMap]) -> None:
        self._maps = dict(maps)

    def __getitem__(self, name: str) -> Any:
        layers = self._maps[name].layers
        return layers if ALL_MAPS[name].form == "levels" else layers[0]

    def __iter__(self) -> Iterator[str]:
        return iter(self._maps)

    def __len__(self) -> int:
        return len(self._maps)

    def __repr__(self) -> str:
        return f"<Maps: {', '.join(f'{name} {made.layers[0].shape}' for name, made in self._maps.items())}>"

    def options(self, name: str) -> dict[str, Any]:
        """The options that a map was baked with.

        Parameters
        ----------
        name : str
            Name of the map.

        Returns
        -------
        dict

        Raises
        ------
        KeyError
            There is no such map.
        """
        return dict(self._maps[name].options)

    def ranges(self, name: str) -> tuple[tuple[float, float], ...]:
        """What the smallest and the largest integer of each channel stand for.

        Parameters
        ----------
        name : str
            Name of the map.

        Returns
        -------
        tuple of (float, float)

        Raises
        ------
        KeyError
            There is no such map.
        """
        return self._maps[name].ranges

    @staticmethod
    def open(folder: str | os.PathLike[str], *, prefix: str | None = None) -> Maps:
        """Read the maps that :meth:`save` wrote into a folder, as float32.

        Parameters
        ----------
        folder : path
            Where they are.
        prefix : str or None
            That of :meth:`save`; None takes the only one there is.

        Returns
        -------
        Maps
            Floats as they were; integers as the numbers they stand for, within the encoding of what
            was baked.

        Raises
        ------
        FileNotFoundError
            There is no such folder, no map in it, or a file of one is missing.
        BakeError
            A file is damaged or does not belong to its sidecar.
        ValueError
            The folder has maps of several prefixes.

        Examples
        --------
        >>> import bumpwgpu as bw, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     baked = bw.bake(bw.HeightMap.procedural("flat", 8))
        ...     _ = baked.save(folder, format="exr")
        ...     (bw.Maps.open(folder)["normal"] == baked["normal"]).all()
        np.True_
        """
        target = _path("folder", folder)
        if not target.is_dir():
            raise FileNotFoundError(f"there is no folder {target}")
        if prefix is not None:
            _check_prefix(prefix)
        found = sidecars(target, prefix)
        if not found:
            asked = "" if prefix is None else f" with prefix {prefix!r}"
            raise FileNotFoundError(f"there are no maps in {target}{asked}: no sidecar (.json) of one")
        if len(found) > 1:
            listed = ", ".join(repr(start) for start in found)
            raise ValueError(f"{target} has maps of several prefixes, {listed}; say which one")
        maps = {}
        for path, data in next(iter(found.values())):
            read = read_map(path, data)
            maps[read.name] = BakedMap(read.layers, read.ranges, read.options, read.source)
        return Maps({name: maps[name] for name in ALL_MAPS if name in maps})

    def save(
        self,
        folder: str | os.PathLike[str],
        *,
        format: Format = "png",
        bits: Literal[8, 16, 32] | None = None,
        prefix: str = "",
    ) -> list[Path]:
        """Write every map into a folder, which is made if need be.

        Each file gets a temporary name first, so an interrupted run leaves no half of one. Beside the
        files of a map lies ``<map>.json``, written last: extent, wrap, options, and what the integers
        stand for; :meth:`open` reads it.

        Parameters
        ----------
        folder : path
            Where to.
        format : {"png", "tiff", "exr", "npy"}
            PNG holds ``(n + 1) / 2`` for normals, heights as they are, and 0 in the blue channel of
            two-channel maps; bounds are rounded to the safe side: of a pyramid, minima down and maxima
            up. EXR and npy hold the floats, TIFF either.
        bits : 8, 16, 32 or None
            Of a PNG or TIFF; None is 8, or what the arrays have. A flat normal is (128, 128, 255) in 8
            bits.
        prefix : str, default ""
            Files are ``<prefix>_<map>.png``; levels of a pyramid, slices of a stack and channels
            beyond the fourth get files of their own, ``<prefix>_pyramid_00.png``.

        Returns
        -------
        list of Path
            The files made, without the sidecars.

        Raises
        ------
        BakeError, OSError
            A file cannot be written.
        ValueError, TypeError
            An unknown format, a prefix that is no file name, or bits that the format or the arrays do
            not have.

        Warns
        -----
        BumpWarning
            `bits` together with a format that has no choice of them.

        Examples
        --------
        >>> import bumpwgpu as bw, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     [path.name for path in bw.bake(bw.HeightMap([[0.0, 1.0]])).save(folder, bits=16)]
        ['normal.png']
        """
        choice("format", format, tuple(FORMATS))
        if bits is not None and (isinstance(bits, bool) or bits not in (8, 16, 32)):
            raise ValueError(f"bits must be 8, 16 or 32, got {bits!r}")
        _check_prefix(prefix)
        if bits is not None and len(FORMATS[format]) == 1:
            if bits != FORMATS[format][0]:
                warnings.warn(
                    f"bits={bits} has no effect: {format} files hold floats", BumpWarning, stacklevel=2
                )
            bits = None
        if bits is not None and bits not in FORMATS[format]:
            raise ValueError(f"{format} has {' or '.join(map(str, FORMATS[format]))} bits, got {bits}")
        depths = {name: _depth(name, made, format, bits) for name, made in self._maps.items()}
        target = _made_folder(folder)
        paths: list[Path] = []
        for name, made in self._maps.items():
            sidecar = sidecar_path(target, prefix, name)
            # Without a sidecar, what an interrupted run leaves is no map.
            with contextlib.suppress(FileNotFoundError):
                sidecar.unlink()
            arrays = [np.require(layer, None, ("C", "A")) for layer in made.layers]
            if format == "npy":
                files, ranges = _save_npy(name, arrays, target, prefix), made.ranges
            else:
                rows, found = _bumpwgpu.save_map(
                    name, arrays, list(made.ranges), target, prefix, format, depths[name]
                )
                stacked = ALL_MAPS[name].form == "stack"
                files = [
                    SavedFile(path, layer, part if stacked else None, one) for path, layer, part, one in rows
                ]
                ranges = tuple(found)
            encoding = arrays[0].dtype.name if format == "npy" else _encoding(depths[name])
            shapes = [layer.shape for layer in arrays]
            write_sidecar(sidecar, ALL_MAPS[name], made.options, made.source, encoding, ranges, shapes, files)
            paths += [file.path for file in files]
        return paths


def _encoding(bits: int) -> str:
    return next(name for name, depth in _BITS.items() if depth == bits)


def _depth(name: str, made: BakedMap, format: str, bits: int | None) -> int:
    """Bits a sample in the files of a map."""
    own = _BITS[made.layers[0].dtype.name]
    if own == 32:
        return bits or FORMATS[format][0]
    if format != "npy" and own not in FORMATS[format]:
        raise ValueError(f"{format} files hold floats, but map {name!r} was baked in {own} bits")
    if bits not in (None, own):
        raise ValueError(f"map {name!r} was baked in {own} bits, not {bits}; bake it with dtype='float32'")
    return own


def _path(name: str, value: Any) -> Path:
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"{name} must be a string or a path, got {type(value).__name__}")
    path = Path(value)
    if "\0" in str(path):
        raise ValueError(f"{name} contains a null character")
    return path


def _check_prefix(prefix: Any) -> None:
    if not isinstance(prefix, str):
        raise TypeError(f"prefix must be a string, got {type(prefix).__name__}")
    if "/" in prefix or "\\" in prefix or "\0" in prefix:
        raise ValueError(f"prefix must be part of a file name, got {prefix!r}")


def _made_folder(folder: Any) -> Path:
    target = _path("folder", folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise BakeError(f"cannot write into {target}: it is a file, not a folder") from None
    return target


def _save_npy(name: str, layers: list[NDArray[Any]], folder: Path, prefix: str) -> list[SavedFile]:
    stem = f"{prefix}_{name}" if prefix else name
    made = []
    for level, layer in enumerate(layers):
        path = folder / (f"{stem}_{level:02}.npy" if ALL_MAPS[name].form == "levels" else f"{stem}.npy")
        data = BytesIO()
        np.save(data, layer, allow_pickle=False)
        made.append(SavedFile(replace_file(path, data.getvalue()), level, None, None))
    return made
