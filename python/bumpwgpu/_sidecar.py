"""The JSON file beside a saved map: what it takes to read the map again and to know where it came from."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._atomic import replace_file
from ._map_info import ALL_MAPS, MapInfo
from .errors import BakeError

__all__ = ["SavedFile", "read_map", "sidecars", "write_sidecar"]

#: Counts up when older versions cannot read the file any more.
FORMAT_VERSION = 1
#: What the files are told by.
FORMAT = "bumpwgpu map"
#: Largest sidecar that is read; real ones have some kilobytes.
MAX_BYTES = 1 << 22
_LEVELS = {"uint8": 255.0, "uint16": 65535.0}


class SavedFile(NamedTuple):
    """One file of a map: a slice of a layer, or one channel of it."""

    path: Path
    layer: int
    slice: int | None
    channel: str | None


def sidecar_path(folder: Path, prefix: str, name: str) -> Path:
    """Where the sidecar of a map is."""
    return folder / (f"{prefix}_{name}.json" if prefix else f"{name}.json")


def write_sidecar(
    path: Path,
    info: MapInfo,
    options: dict[str, Any],
    source: dict[str, Any],
    encoding: str,
    ranges: Sequence[tuple[float, float]],
    shapes: Sequence[tuple[int, ...]],
    files: Sequence[SavedFile],
) -> None:
    """Write what is known about a map, whole or not at all."""
    channels = [
        {"name": channel.name, "low": low, "high": high, "rounding": channel.rounding}
        for channel, (low, high) in zip(info.channels, ranges, strict=True)
    ]
    data = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "bumpwgpu": _bumpwgpu.VERSION,
        "map": info.name,
        "map_version": info.version,
        "summary": info.summary,
        "source": info.source,
        **source,
        "options": options,
        "form": info.form,
        "axis": info.axis,
        "encoding": encoding,
        "channels": channels,
        "shapes": [list(shape) for shape in shapes],
        "files": [
            {"file": file.path.name, "layer": file.layer, "slice": file.slice, "channel": file.channel}
            for file in files
        ],
    }
    replace_file(path, (json.dumps(data, indent=1, allow_nan=False, default=_plain) + "\n").encode())


def _plain(value: Any) -> Any:
    """NumPy's numbers as Python's; anything else by its name."""
    return value.item() if isinstance(value, np.generic) else str(value)


def sidecars(folder: Path, prefix: str | None) -> dict[str, list[tuple[Path, dict[str, Any]]]]:
    """All sidecars of a folder that belong to maps, by prefix."""
    found: dict[str, list[tuple[Path, dict[str, Any]]]] = {}
    for path in sorted(folder.glob("*.json")):
        if path.stat().st_size > MAX_BYTES:
            continue
        try:
            data = json.loads(path.read_bytes())
        except (ValueError, RecursionError):
            continue
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            continue
        name = data.get("map")
        if not isinstance(name, str) or not path.stem.endswith(name):
            raise BakeError(f"{path}: not the sidecar of map {name!r}")
        start = path.stem[: -len(name)].removesuffix("_")
        if prefix is None or start == prefix:
            found.setdefault(start, []).append((path, data))
    return found


class ReadMap(NamedTuple):
    """A map as it was read."""

    name: str
    layers: tuple[NDArray[Any], ...]
    ranges: tuple[tuple[float, float], ...]
    options: dict[str, Any]
    source: dict[str, Any]


def read_map(path: Path, data: dict[str, Any]) -> ReadMap:
    """The map that a sidecar describes, as float32; raises BakeError when the two do not agree."""
    try:
        return _read_map(path, data)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        raise BakeError(f"{path}: damaged sidecar or files: {type(error).__name__}: {error}") from None


def _read_map(path: Path, data: dict[str, Any]) -> ReadMap:
    if data["format_version"] != FORMAT_VERSION:
        raise BakeError(f"{path}: format version {data['format_version']}; {FORMAT_VERSION} is read")
    name, encoding = data["map"], data["encoding"]
    if name not in ALL_MAPS:
        raise BakeError(f"{path}: unknown map {name!r}; known: {', '.join(ALL_MAPS)}")
    if encoding not in (*_LEVELS, "float32"):
        raise BakeError(f"{path}: unknown encoding {encoding!r}")
    info = ALL_MAPS[name]
    names = [channel["name"] for channel in data["channels"]]
    if names != [channel.name for channel in info.channels]:
        raise BakeError(f"{path}: channels {names} are not those of {name!r}")
    ranges = tuple((float(channel["low"]), float(channel["high"])) for channel in data["channels"])
    parts: dict[int, dict[int | None, dict[str | None, NDArray[np.float32]]]] = {}
    for file in data["files"]:
        if Path(file["file"]).name != file["file"] or file["channel"] not in (None, *names):
            raise BakeError(f"{path}: it names {file['file']!r}, which is no file beside it")
        chosen = ranges if file["channel"] is None else (ranges[names.index(file["channel"])],)
        plane = _decode(path.with_name(file["file"]), encoding, chosen)
        parts.setdefault(file["layer"], {}).setdefault(file["slice"], {})[file["channel"]] = plane
    layers = []
    for at, shape in enumerate(data["shapes"]):
        slices = [_join(parts[at][key], names) for key in sorted(parts[at], key=lambda key: key or 0)]
        layer = slices[0] if list(parts[at]) == [None] else np.stack(slices)
        layer = layer if layer.shape == tuple(shape) else layer.reshape(shape)
        layers.append(np.ascontiguousarray(layer))
    if not layers or (info.form != "levels" and len(layers) > 1):
        raise BakeError(f"{path}: {len(layers)} layers cannot be a map {name!r}")
    source: dict[str, Any] = {
        key: data[key] for key in ("size", "scale", "base", "tile_size", "wrap") if key in data
    }
    return ReadMap(name, tuple(layers), ranges, dict(data["options"]), source)


def _join(channels: dict[str | None, NDArray[np.float32]], names: list[str]) -> NDArray[np.float32]:
    if list(channels) == [None]:
        return channels[None]
    return np.stack([channels[name][..., 0] for name in names], axis=-1)


def _decode(path: Path, encoding: str, ranges: Sequence[tuple[float, float]]) -> NDArray[np.float32]:
    """A file as float32, with its channels as the last axis where it is an image."""
    if path.suffix == ".npy":
        values = np.load(path, allow_pickle=False)
        if values.dtype.name not in (encoding, "float32"):
            raise ValueError(f"{path.name} holds {values.dtype}, not {encoding}")
        planes = values
    else:
        values, _, _ = _bumpwgpu.read_image(path)
        if values.dtype.name != encoding:
            raise ValueError(f"{path.name} holds {values.dtype}, not {encoding}")
        planes = values if values.ndim == 3 else values[..., np.newaxis]
        if planes.shape[-1] < len(ranges):
            raise ValueError(f"{path.name} has {planes.shape[-1]} channels, not {len(ranges)}")
        # PNG and TIFF have no colour of two channels, so there is a blue one.
        planes = planes[..., : len(ranges)]
    if encoding == "float32":
        return np.asarray(planes, np.float32)
    low = np.array([low for low, _ in ranges])
    wide = np.array([high - low for low, high in ranges])
    if len(ranges) == 1:
        low, wide = low[0], wide[0]
    return np.asarray(low + wide * (planes / _LEVELS[encoding]), np.float32)
