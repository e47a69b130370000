"""Reading pixels from files, arrays and PIL images, with nothing decided about what they mean."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from .errors import BakeError


@dataclass
class Pixels:
    """Raw samples, (H, W) or (H, W, C), with what is known about them."""

    values: NDArray[Any]
    warnings: list[str] = field(default_factory=list)
    label: str = "image"
    names: list[str] = field(default_factory=list)


def read_array(source: Any, label: str) -> Pixels:
    """Anything NumPy takes for an array of numbers."""
    if source is None or isinstance(source, str | bytes | bytearray | dict | set | frozenset):
        raise TypeError(f"{label} must be a path, an array or a PIL image, got {type(source).__name__}")
    if isinstance(source, np.ma.MaskedArray):
        if np.ma.is_masked(source):
            raise ValueError(f"{label} is a masked array with masked texels; fill the holes first")
        source = source.data
    try:
        values = np.asarray(source)
    except Exception as error:
        raise TypeError(f"{label} of type {type(source).__name__} is not an array: {error}") from None
    if values.dtype.kind not in "buif":
        raise TypeError(
            f"{label} must be a path, an array of numbers or a PIL image, got {type(source).__name__}"
            f" (dtype {values.dtype})"
        )
    return Pixels(values, [], label)


def read_npy(path: Path) -> Pixels:
    """An ``.npy`` file; its header is checked against the file's size before memory is asked for."""
    with open(path, "rb") as file:
        try:
            version = np.lib.format.read_magic(file)
            reader = {
                (1, 0): np.lib.format.read_array_header_1_0,
                (2, 0): np.lib.format.read_array_header_2_0,
            }.get(version)
            if reader is None:
                raise ValueError(f"format version {version} is not read")
            shape, _, dtype = reader(file)
        except Exception as error:
            raise BakeError(f"{path}: not a readable .npy file: {_one_line(error)}") from None
        if dtype.hasobject:
            raise BakeError(f"{path}: holds Python objects, which are not read from files")
        need = dtype.itemsize
        for side in shape:
            need *= int(side)
        have = os.fstat(file.fileno()).st_size - file.tell()
        if any(side < 0 for side in shape) or need > have:
            raise BakeError(
                f"{path}: header announces shape {shape} of {dtype}, {need} bytes, but {have} follow"
            )
        file.seek(0)
        try:
            values = np.load(file, allow_pickle=False)
        except Exception as error:
            raise BakeError(f"{path}: not a readable .npy file: {_one_line(error)}") from None
    if not isinstance(values, np.ndarray):
        raise BakeError(f"{path}: does not hold an array")
    return Pixels(values, [], path.name)


def read_any(source: Any, label: str) -> Pixels:
    """Pixels of a path, an array or a PIL image."""
    if isinstance(source, str | os.PathLike):
        path = Path(source)
        if path.suffix.lower() == ".npy":
            return read_npy(path)
        if path.suffix.lower() == ".npz":
            raise ValueError(
                f"{path}: an .npz holds several arrays; load it and pass one, np.load(path)[key]"
            )
        if "\0" in str(path):
            raise ValueError(f"{label}: path contains a null character")
        if path.suffix.lower() == ".dds":
            from ._dds import read_dds

            texels, notes = read_dds(path)
            return Pixels(texels, [f"{path.name} {note}" for note in notes], path.name)
        values, names, texts = _bumpwgpu.read_image(path)
        return Pixels(values, [f"{path.name}: {text}" for text in texts], path.name, names)
    if is_pil_image(source):
        return read_pil(source)
    return read_array(source, label)


def read_encoded(data: bytes) -> NDArray[Any]:
    """Samples of an image file held in memory, (H, W, C)."""
    values, _, _ = _bumpwgpu.decode_image(data)
    return values


def is_pil_image(source: object) -> bool:
    """Whether this is a PIL image, without importing PIL for it."""
    module = sys.modules.get("PIL.Image")
    return module is not None and isinstance(source, module.Image)


def read_pil(image: Any) -> Pixels:
    """A PIL image in any mode; palettes are looked up, 16-bit modes kept."""
    notes = []
    if image.format == "JPEG":
        notes.append("comes from a JPEG: its compression shows as bumps; use a lossless file for heights")
    if "srgb" in image.info:
        notes.append("is tagged sRGB; heights are read as linear data")
    mode = image.mode
    try:
        if mode == "P":
            image = image.convert("RGBA" if "transparency" in image.info else "RGB")
        elif mode == "PA":
            image = image.convert("RGBA")
        elif mode in ("CMYK", "YCbCr", "LAB", "HSV"):
            image = image.convert("RGB")
        elif mode not in ("1", "L", "LA", "La", "F", "I", "RGB", "RGBA", "RGBX", "RGBa") and mode[:2] != "I;":
            raise ValueError(f"PIL image of mode {mode!r} is not read; convert it first, for example to 'L'")
        values = np.asarray(image)
    except OSError as error:
        raise BakeError(f"PIL image cannot be read: {_one_line(error)}") from None
    if mode == "RGBX":
        values = values[:, :, :3]
    if mode[:2] == "I;":
        values = values.astype(np.uint16)
    elif mode == "I" and image.format in ("PNG", "PPM", "TIFF") and values.size and values.min() >= 0:
        # Pillow widens 16-bit greys of these formats to 32 bits.
        values = values.astype(np.uint16) if values.max() <= 0xFFFF else values
    return Pixels(values, [f"PIL image {note}" for note in notes], "PIL image")


def _one_line(error: BaseException) -> str:
    text = str(error).strip()
    return text.splitlines()[0] if text else type(error).__name__
