"""DirectDraw Surface files, by Pillow: textures as engines ship them, compressed in blocks."""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._images import read_pil
from .errors import BakeError

__all__ = ["read_dds"]

#: What comes before the pixels: the mark, the header, and for newer formats what DXGI calls them.
_HEADER, _NEWER = 128, 148
#: DXGI formats tagged sRGB that Pillow knows by their linear twins alone: BC1, BC2, BC3.
_LINEAR = {72: 71, 75: 74, 78: 77}
#: Texels that a byte holds at most: blocks of 16 in 8 bytes.
_MOST_TEXELS = 2


def read_dds(path: Path) -> tuple[NDArray[np.uint8], list[str]]:
    """Samples of the finest level, (H, W) or (H, W, C) with 2 channels for BC5, and what to mind.

    Raises
    ------
    BakeError
        Not such a file, one cut short, or of a format that is not read.
    """
    from PIL.DdsImagePlugin import DdsImageFile

    data = bytearray(path.read_bytes())
    notes = []
    if len(data) < _HEADER or data[:4] != b"DDS ":
        raise BakeError(f"{path}: not a DDS file")
    rows, columns = struct.unpack_from("<2I", data, 12)
    # Before anything is decoded.
    if max(rows, columns) > _bumpwgpu.MAX_SIDE or rows * columns > _MOST_TEXELS * len(data):
        raise BakeError(
            f"{path}: header announces {columns} x {rows} texels, more than its {len(data)} bytes can hold"
        )
    if data[84:88] == b"DX10" and len(data) >= _NEWER:
        (kind,) = struct.unpack_from("<I", data, _HEADER)
        if kind in _LINEAR:
            struct.pack_into("<I", data, _HEADER, _LINEAR[kind])
            notes.append("is tagged sRGB; its numbers are read as linear data")
    try:
        # Not by Image.open, which refuses sides of 16384.
        with DdsImageFile(io.BytesIO(data)) as image:
            if "gamma" in image.info:
                notes.append("is tagged sRGB; its numbers are read as linear data")
            # BC1 to BC3 keep colours of 5 or 6 bits a channel; alpha, and BC4 up, fare better.
            blocks = str(getattr(image, "pixel_format", ""))
            if blocks in ("DXT1", "DXT3", "DXT5", "BC1", "BC2", "BC3"):
                notes.append(f"is compressed in blocks of few colours ({blocks})")
            values = read_pil(image).values
    except Exception as error:  # Pillow's readers raise whatever they come across
        text = str(error).splitlines()
        raise BakeError(f"{path}: {text[0] if text else type(error).__name__}") from None
    if blocks.startswith("BC5"):
        values = values[..., :2]
    elif blocks in ("DXT1", "BC1") and bool((values[..., 3] == 255).all()):
        values = values[..., :3]
    return values, notes
