"""Height maps: read from files, arrays and PIL images, normalised once, never changed."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._atomic import replace_file
from ._checks import choice, flag, number, whole
from ._images import Pixels, read_any
from .errors import BumpWarning

if TYPE_CHECKING:
    from PIL import Image

__all__ = ["HeightMap", "HeightRange", "HeightSource", "Wrap"]

Wrap: TypeAlias = Literal["repeat", "clamp", "mirror"]
HeightSource: TypeAlias = "str | os.PathLike[str] | ArrayLike | Image.Image"
HeightRange: TypeAlias = "Literal['auto'] | tuple[float, float] | None"

#: What :class:`HeightMap` takes besides its source.
HEIGHT_MAP_SETTINGS = ("scale", "base", "tile_size", "wrap", "channel", "invert", "height_range")
#: Resampling filters overshoot by up to this much; such heights are clipped with a warning.
OVERSHOOT = 0.01
#: Channels that differ by no more than two levels of 8 bits are the same grey: palettes and lossy
#: compression of a grey picture leave that much.
GREY_TOLERANCE = 2.0 / 255.0
_CHANNEL_NAMES = {"r": 0, "g": 1, "b": 2, "a": 3}


class HeightMap:
    """Heights in 0..1, 1 = high, with the size of the relief they stand for.

    Parameters
    ----------
    source : path, array or PIL image
        PNG (8 or 16 bit), TIFF (8, 16 bit, float), EXR, JPEG, WebP, BMP, TGA or ``.npy``; or an array
        of shape (H, W) or (H, W, C), row 0 on top. ``uint8`` and ``uint16`` mean 0..1, ``bool`` means
        0 and 1, floats must be in 0..1, other integers need `height_range`.
    scale : float, default 0.1
        Mesh units between height 0 and height 1; finite, not negative.
    base : float, default 1.0
        The height that lies on the mesh surface: 1 carves the relief in, 0 raises it.
    tile_size : float or (float, float), default (1, 1)
        Mesh units covered by one tile along u and v, so that slopes have a unit.
    wrap : {"repeat", "clamp", "mirror"}
        What lies beyond the edge.
    channel : int, str or None
        The channel to read: an index, "r", "g", "b", "a", or a name from an EXR file. Needed when
        there are several that differ.
    invert : bool, default False
        For depth maps, where 1 is low.
    height_range : None, "auto" or (float, float)
        The values that become height 0 and height 1, in the units of the data: metres of a terrain,
        raw integers of an image. ``"auto"`` takes the smallest and the largest value.

    Raises
    ------
    FileNotFoundError
        The file does not exist.
    BakeError
        The file is damaged, or of a kind that is not read.
    ValueError
        NaN, infinite or out-of-range heights, an empty map, several channels that differ, or a
        setting out of range.
    TypeError
        A source or setting of the wrong type.

    Warns
    -----
    BumpWarning
        The data is tagged sRGB, comes from a lossy JPEG, or had to be clipped.

    Notes
    -----
    Between texel centres, at ``u = (i + 0.5) / W``, the surface is bilinear.

    Examples
    --------
    >>> import numpy as np
    >>> import bumpwgpu as bw
    >>> hm = bw.HeightMap(np.arange(256, dtype=np.uint8).reshape(16, 16), scale=0.05)
    >>> hm.shape, hm.bits, float(hm.array[15, 15])
    ((16, 16), 8, 1.0)
    """

    __slots__ = ("_array", "_base", "_bits", "_built", "_scale", "_tile_size", "_wrap")

    #: Whether the heights are the map's own; see `BorrowedHeightMap`.
    _OWN = True
    #: None until somebody asks: of many floats that takes longer than a bake.
    _bits: int | None
    #: None until somebody marches or bakes what needs more than rows.
    _built: _bumpwgpu.Field | None

    def __init__(
        self,
        source: HeightSource,
        *,
        scale: float = 0.1,
        base: float = 1.0,
        tile_size: float | tuple[float, float] = (1.0, 1.0),
        wrap: Wrap = "repeat",
        channel: int | str | None = None,
        invert: bool = False,
        height_range: HeightRange = None,
    ) -> None:
        self._scale, self._base, self._tile_size = checked_extent(scale, base, tile_size)
        self._wrap = _checked_wrap(wrap)
        pixels = _read(source)
        for text in pixels.warnings:
            warnings.warn(text, BumpWarning, stacklevel=2)
        plane, label = _pick_channel(pixels.values, channel, pixels.label, pixels.names)
        heights, bits = _normalise(plane, height_range, label)
        if flag("invert", invert):
            bits = _effective_bits(plane) if bits is None else bits
            heights = np.subtract(np.float32(1.0), heights)
        heights = np.ascontiguousarray(heights, dtype=np.float32)
        if self._OWN:
            if heights is source or heights.base is not None or not heights.flags.owndata:
                heights = heights.copy()
            heights.flags.writeable = False
        self._array = heights
        self._bits = bits
        self._built = None

    @property
    def _field(self) -> _bumpwgpu.Field:
        if self._built is None:
            self._built = _bumpwgpu.Field(self._array, self._wrap, self._extent)
        return self._built

    @property
    def _extent(self) -> tuple[float, float, tuple[float, float]]:
        return (self._scale, self._base, self._tile_size)

    @staticmethod
    def procedural(
        name: str,
        size: int | tuple[int, int] = 512,
        seed: int = 0,
        *,
        scale: float = 0.1,
        base: float = 1.0,
        tile_size: float | tuple[float, float] = (1.0, 1.0),
        wrap: Wrap = "repeat",
    ) -> HeightMap:
        """A height map made from a formula. All of them tile.

        Parameters
        ----------
        name : str
            One of :func:`procedural_names`.
        size : int or (int, int), default 512
            Texels: the side of a square, or (width, height).
        seed : int, default 0
            Picks one of many maps of the same kind; the same seed gives the same map.
        scale, base, tile_size, wrap
            As for :class:`HeightMap`.

        Returns
        -------
        HeightMap

        Raises
        ------
        ValueError
            For an unknown name, or a size or seed out of range.
        TypeError
            For a size or seed that is not a whole number.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> bw.HeightMap.procedural("bricks", size=(64, 32)).shape
        (32, 64)
        """
        from .procedural import heights

        made = HeightMap(heights(name, size, seed), scale=scale, base=base, tile_size=tile_size, wrap=wrap)
        made._bits = 32
        return made

    @staticmethod
    def from_function(
        function: Callable[[NDArray[np.float64], NDArray[np.float64]], ArrayLike],
        size: int | tuple[int, int] = 512,
        *,
        scale: float = 0.1,
        base: float = 1.0,
        tile_size: float | tuple[float, float] = (1.0, 1.0),
        wrap: Wrap = "repeat",
    ) -> HeightMap:
        """A height map sampled from any function.

        Parameters
        ----------
        function : callable
            ``function(u, v)`` with the texel centres, u of shape (1, W) and v of shape (H, 1) in 0..1, v
            down, gives heights that broadcast to (H, W); 0..1, 1 = high.
        size : int or (int, int), default 512
            Texels: the side of a square, or (width, height).
        scale, base, tile_size, wrap
            As for :class:`HeightMap`.

        Returns
        -------
        HeightMap

        Raises
        ------
        ValueError
            Heights that are not finite, of another shape, or outside 0..1; a size out of range.
        TypeError
            No function, or a size that is not a whole number.

        Examples
        --------
        >>> import numpy as np
        >>> import bumpwgpu as bw
        >>> waves = bw.HeightMap.from_function(lambda u, v: 0.5 + 0.5 * np.sin(40 * u) * np.sin(40 * v), 64)
        >>> waves.shape
        (64, 64)
        """
        from .procedural import sampled

        plane = sampled(function, size)
        made = HeightMap(plane, scale=scale, base=base, tile_size=tile_size, wrap=wrap)
        made._bits = 32
        return made

    @staticmethod
    def procedural_names() -> tuple[str, ...]:
        """Names that :meth:`procedural` knows.

        Returns
        -------
        tuple of str
        """
        from .procedural import NAMES

        return NAMES

    def replace(
        self,
        *,
        scale: float | None = None,
        base: float | None = None,
        tile_size: float | tuple[float, float] | None = None,
    ) -> HeightMap:
        """The same heights with another extent; :attr:`array` is shared, not copied.

        Parameters
        ----------
        scale, base, tile_size
            As for :class:`HeightMap`; None keeps the present value.

        Returns
        -------
        HeightMap

        Raises
        ------
        ValueError
            For a value out of range.

        Examples
        --------
        >>> import bumpwgpu as bw
        >>> bw.HeightMap.procedural("dot", 16).replace(scale=0.5).scale
        0.5
        """
        made = object.__new__(HeightMap)
        made._scale, made._base, made._tile_size = checked_extent(
            self._scale if scale is None else scale,
            self._base if base is None else base,
            self._tile_size if tile_size is None else tile_size,
        )
        made._wrap = self._wrap
        made._array = self._array
        made._bits = self._bits
        made._built = None
        return made

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the heights, and nothing but them, to a file that :class:`HeightMap` reads back.

        Parameters
        ----------
        path : path
            The suffix decides: ``.png`` is 16-bit grey, ``.tif`` and ``.tiff`` are 32-bit float, ``.npy``
            is float32. The folder must exist; the file appears only when it is complete.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ValueError
            Another suffix.
        OSError
            The file cannot be written.
        TypeError
            `path` is no path.

        Examples
        --------
        >>> import bumpwgpu as bw, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     bw.HeightMap(bw.HeightMap([[0.0, 0.25]]).save(folder + "/heights.png")).array.round(4)
        array([[0.  , 0.25]], dtype=float32)
        """
        if not isinstance(path, str | os.PathLike):
            raise TypeError(f"path must be a string or a path, got {type(path).__name__}")
        target, data = Path(path), BytesIO()
        kind = target.suffix.lower()
        if kind == ".npy":
            np.save(data, self._array, allow_pickle=False)
        elif kind in (".png", ".tif", ".tiff"):
            from PIL import Image

            if kind == ".png":
                steps = np.floor(self._array.astype(np.float64) * 65535.0 + 0.5).astype(np.uint16)
                Image.fromarray(steps).save(data, format="PNG")
            else:
                Image.fromarray(self._array).save(data, format="TIFF")
        else:
            raise ValueError(f"cannot write heights to {target.name!r}; use .png, .tiff or .npy")
        return replace_file(target, data.getvalue())

    @property
    def array(self) -> NDArray[np.float32]:
        """Heights, float32, (H, W), 0..1, read-only."""
        return self._array

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return (self._array.shape[0], self._array.shape[1])

    @property
    def bits(self) -> int:
        """Effective bits found in the data: 8 for 8-bit data stored in 16 bits, 32 for full floats."""
        if self._bits is None:
            self._bits = _effective_bits(self._array)
        return self._bits

    @property
    def scale(self) -> float:
        """Mesh units between height 0 and height 1."""
        return self._scale

    @property
    def base(self) -> float:
        """The height that lies on the mesh surface."""
        return self._base

    @property
    def tile_size(self) -> tuple[float, float]:
        """Mesh units covered by one tile along u and v."""
        return self._tile_size

    @property
    def wrap(self) -> Wrap:
        """What lies beyond the edge."""
        return self._wrap

    def __repr__(self) -> str:
        rows, columns = self.shape
        return (
            f"<HeightMap {columns} x {rows}, {self.bits} bits, scale={self._scale:g}, base={self._base:g}, "
            f"tile_size=({self._tile_size[0]:g}, {self._tile_size[1]:g}), wrap={self._wrap!r}>"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restore, (self._array, self._extent, self._wrap, self.bits))


class BorrowedHeightMap(HeightMap):
    """Heights that may lie in an array of the caller's, for the time of a call: nothing is copied."""

    __slots__ = ()
    _OWN = False


def _restore(array: NDArray[np.float32], extent: tuple[Any, ...], wrap: Wrap, bits: int) -> HeightMap:
    made = HeightMap(array, scale=extent[0], base=extent[1], tile_size=extent[2], wrap=wrap)
    made._bits = bits
    return made


def _pair(name: str, value: Any) -> tuple[float, float]:
    if isinstance(value, str | bytes) or not hasattr(value, "__len__"):
        side = number(name, value)
        return (side, side)
    if len(value) != 2:
        raise ValueError(f"{name} must be one number or two, got {len(value)}")
    return (number(f"{name}[0]", value[0]), number(f"{name}[1]", value[1]))


def checked_extent(scale: Any, base: Any, tile_size: Any) -> tuple[float, float, tuple[float, float]]:
    """Scale, base and tile size as the core takes them."""
    scale, base, tile_size = number("scale", scale), number("base", base), _pair("tile_size", tile_size)
    if scale < 0.0:
        raise ValueError(f"scale must not be negative, got {scale:g}; for depth maps use invert=True")
    if not 0.0 <= base <= 1.0:
        raise ValueError(f"base must be in 0..1, got {base:g}")
    # Sizes that vanish as 32-bit floats would make slopes infinite.
    if min(tile_size) < float(np.finfo(np.float32).tiny):
        raise ValueError(f"tile_size must be positive, got ({tile_size[0]:g}, {tile_size[1]:g})")
    return scale, base, tile_size


def _checked_wrap(wrap: Any) -> Wrap:
    return cast(Wrap, choice("wrap", wrap, ("repeat", "clamp", "mirror")))


def _read(source: Any) -> Pixels:
    if isinstance(source, HeightMap):
        raise TypeError("source is a HeightMap already; use its replace() to change scale, base or tile_size")
    return read_any(source, "height map")


def _pick_channel(
    values: NDArray[Any], channel: int | str | None, label: str, names: list[str]
) -> tuple[NDArray[Any], str]:
    """The plane to read, and how to call it in messages."""
    if values.ndim not in (2, 3):
        raise ValueError(f"{label} must have shape (H, W) or (H, W, C), got {values.shape}")
    rows, columns = values.shape[:2]
    if rows == 0 or columns == 0 or values.size == 0:
        raise ValueError(f"{label} is empty: shape {values.shape}")
    if max(rows, columns) > _bumpwgpu.MAX_SIDE:
        raise ValueError(
            f"{label} is {columns} x {rows} texels; each side may be at most {_bumpwgpu.MAX_SIDE}"
        )
    planes = values if values.ndim == 3 else values[:, :, np.newaxis]
    count = planes.shape[2]
    if channel is not None:
        at = _channel_index(channel, count, label, names)
        return planes[:, :, at], f"{label} (channel {channel})" if count > 1 else label
    if count == 1:
        return planes[:, :, 0], label
    colours = count - 1 if count in (2, 4) else count
    alpha_says_nothing = count == colours or _is_constant(planes[:, :, -1])
    if alpha_says_nothing and all(_same_grey(planes[:, :, 0], planes[:, :, at]) for at in range(1, colours)):
        return planes[:, :, min(1, colours - 1)], label
    raise ValueError(
        f"{label} has {count} channels that differ; say which one holds the heights with "
        f'channel=0..{count - 1} or channel="r", "g", "b", "a"'
    )


def _channel_index(channel: Any, count: int, label: str, names: list[str]) -> int:
    if isinstance(channel, str):
        lower = [name.lower() for name in names]
        if channel.lower() in lower:
            return lower.index(channel.lower())
        if channel.lower() not in _CHANNEL_NAMES:
            known = ", ".join(repr(name) for name in names) if names else '"r", "g", "b", "a"'
            raise ValueError(f"channel must be {known} or an index, got {channel!r}")
        at = _CHANNEL_NAMES[channel.lower()]
        if count == 2 and channel.lower() == "a":
            at = 1
    else:
        at = whole("channel", channel)
    if not 0 <= at < count:
        raise ValueError(f"channel {channel!r} does not exist: {label} has {count}")
    return at


def _is_constant(plane: NDArray[Any]) -> bool:
    return bool((plane == plane[0, 0]).all())


def _same_grey(a: NDArray[Any], b: NDArray[Any]) -> bool:
    if np.array_equal(a, b):
        return True
    tolerance = GREY_TOLERANCE * (np.iinfo(a.dtype).max if a.dtype.kind == "u" else 1.0)
    with np.errstate(invalid="ignore"):
        difference = np.abs(a.astype(np.float64) - b.astype(np.float64))
        return bool((difference <= tolerance * (1.0 + 1e-9)).all())


def _first(bad: NDArray[np.bool_]) -> tuple[int, int]:
    row, column = np.unravel_index(int(bad.argmax()), bad.shape)
    return int(row), int(column)


def _require_finite(plane: NDArray[Any], label: str) -> None:
    finite = np.isfinite(plane)
    if not finite.all():
        row, column = _first(~finite)
        count = int(finite.size - np.count_nonzero(finite))
        raise ValueError(
            f"{label}: height at row {row}, column {column} is {plane[row, column]} ({count} such texels); "
            "heights must be finite, so fill the holes first"
        )


def _normalise(plane: NDArray[Any], height_range: Any, label: str) -> tuple[NDArray[np.float32], int | None]:
    """Heights in 0..1 as float32, and the effective bits of the data; None when they can be found later.

    float32 heights that are what they should be come back as they are.
    """
    kind = plane.dtype.kind
    if kind not in "buif":
        raise TypeError(f"{label} must hold numbers, got dtype {plane.dtype}")
    # Files of the other byte order hold the same numbers.
    plane = np.asarray(plane, plane.dtype.newbyteorder("="))
    if plane.dtype == np.float32 and height_range is None and plane.flags.c_contiguous:
        span = _bumpwgpu.finite_span(plane)
        if span is not None and span[0] >= 0.0 and span[1] <= 1.0:
            return plane, None
    if kind == "f":
        _require_finite(plane, label)
    bits = _effective_bits(plane)
    if height_range is not None:
        return _stretch(plane, height_range, label), bits
    if kind == "b":
        return plane.astype(np.float32), bits
    if plane.dtype == np.uint8 or plane.dtype == np.uint16:
        return np.divide(plane, np.float32(np.iinfo(plane.dtype).max), dtype=np.float32), bits
    if kind in "ui":
        raise ValueError(
            f"{label} holds {plane.dtype} from {plane.min()} to {plane.max()}; only uint8 and uint16 have a "
            'meaning of their own: pass height_range="auto" or height_range=(low, high)'
        )
    return _within_unit(plane, label), bits


def _within_unit(plane: NDArray[Any], label: str) -> NDArray[np.float32]:
    low, high = float(plane.min()), float(plane.max())
    if low < -OVERSHOOT or high > 1.0 + OVERSHOOT:
        row, column = _first((plane < -OVERSHOOT) | (plane > 1.0 + OVERSHOOT))
        raise ValueError(
            f"{label}: height at row {row}, column {column} is {plane[row, column]}; floats must be in 0..1 "
            f'(this map spans {low:g} to {high:g}): pass height_range="auto" or height_range=(low, high)'
        )
    heights = plane.astype(np.float32)
    if low < 0.0 or high > 1.0:
        warnings.warn(
            f"{label}: heights from {low:g} to {high:g} were clipped to 0..1", BumpWarning, stacklevel=5
        )
        heights = np.clip(heights, 0.0, 1.0)
    return heights


def _stretch(plane: NDArray[Any], height_range: Any, label: str) -> NDArray[np.float32]:
    wide = plane.astype(np.float64)
    if isinstance(height_range, str):
        if height_range != "auto":
            raise ValueError(f'height_range must be None, "auto" or (low, high), got {height_range!r}')
        low, high = float(wide.min()), float(wide.max())
        if low == high:
            warnings.warn(
                f"{label} is constant ({low:g}); its height is taken as 0", BumpWarning, stacklevel=5
            )
            return np.zeros(plane.shape, np.float32)
    else:
        if not hasattr(height_range, "__len__") or len(height_range) != 2:
            raise TypeError(f'height_range must be None, "auto" or (low, high), got {height_range!r}')
        low, high = (number(f"height_range[{at}]", height_range[at]) for at in range(2))
        if low >= high:
            raise ValueError(f"height_range must be (low, high) with low < high, got ({low:g}, {high:g})")
    with np.errstate(over="ignore", invalid="ignore"):
        heights = (wide - low) / (high - low)
    if not np.isfinite(heights).all():
        raise ValueError(f"{label} spans {low:g} to {high:g}, too wide for 64-bit floats")
    outside = (heights < 0.0) | (heights > 1.0)
    if outside.any():
        row, column = _first(outside)
        warnings.warn(
            f"{label}: {np.count_nonzero(outside)} heights outside height_range=({low:g}, {high:g}) were "
            f"clipped, the first at row {row}, column {column}: {plane[row, column]}",
            BumpWarning,
            stacklevel=5,
        )
        heights = np.clip(heights, 0.0, 1.0)
    return heights.astype(np.float32)


def _effective_bits(plane: NDArray[Any]) -> int:
    """Bits the data really uses; see ``effective_bits`` of the core for 8- and 16-bit images."""
    kind = plane.dtype.kind
    if kind == "b":
        return 1
    if plane.dtype == np.uint8 or plane.dtype == np.uint16:
        return int(_bumpwgpu.effective_bits(np.ascontiguousarray(plane)))
    if kind == "f":
        with np.errstate(over="ignore"):
            narrow = np.ascontiguousarray(plane, dtype=np.float32)
        return int(_bumpwgpu.effective_bits(narrow))
    levels = int(plane.max()) - int(plane.min())
    return max(1, levels.bit_length())
