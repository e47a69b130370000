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
#: Bytes of a texel at most: 16, and as many for each texel of a block where a side is 1.
_MOST_BYTES = 16 * 16
#: Bytes before the texels at most: the headers and a palette.
_MOST_BEFORE = 4096


def read_dds(path: Path) -> tuple[NDArray[np.uint8 | np.uint16], list[str]]:
    """Samples of the finest level, (H, W) or (H, W, C) with 2 channels for BC5, and what to mind.

    Numbers with a sign, -1 to 1, come as 0 to 65535.

    Raises
    ------
    BakeError
        Not such a file, one cut short, or of a format that is not read.
    """
    from PIL.DdsImagePlugin import DdsImageFile

    notes = []
    with path.open("rb") as file:
        head = file.read(_NEWER)
        length = file.seek(0, io.SEEK_END)
    if len(head) < _HEADER or head[:4] != b"DDS ":
        raise BakeError(f"{path}: not a DDS file")
    rows, columns = struct.unpack_from("<2I", head, 12)
    # Before the rest is read, and anything decoded.
    if max(rows, columns) > _bumpwgpu.MAX_SIDE or rows * columns > _MOST_TEXELS * length:
        raise BakeError(
            f"{path}: header announces {columns} x {rows} texels, more than its {length} bytes can hold"
        )
    if _pictures(head) > 1:
        notes.append(
            f"holds {_pictures(head)} pictures (a cube map, an array or a volume); the first is read"
        )
    # Whatever else stands in the file: the first picture, which comes first, and what goes before it.
    with path.open("rb") as file:
        data = bytearray(file.read(_MOST_BEFORE + _MOST_BYTES * rows * columns))
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
    if blocks == "BC5S":
        # Pillow adds 128 to what runs from -127 to 127, where 0 is half of the range.
        signed = np.maximum(values.astype(np.float64) - 128.0, -127.0)
        values = np.rint((signed / 127.0 + 1.0) * 0.5 * 65535.0).astype(np.uint16)
    elif blocks in ("DXT1", "BC1") and bool((values[..., 3] == 255).all()):
        values = values[..., :3]
    return values, notes


def _pictures(head: bytes) -> int:
    """How many pictures a file holds besides mips: faces, members of an array or slices."""
    depth, caps = struct.unpack_from("<I", head, 24)[0], struct.unpack_from("<I", head, 112)[0]
    faces = (caps >> 10 & 0x3F).bit_count() if caps & 0x200 else 1
    members = 1
    if head[84:88] == b"DX10" and len(head) >= _NEWER:
        kind, flags, members = struct.unpack_from("<3I", head, _HEADER + 4)
        faces = 6 if flags & 4 else faces
        slices = depth if kind == 4 else 1
    else:
        slices = depth if caps & 0x20_0000 else 1
    return max(faces, 1) * max(members, 1) * max(slices, 1)
