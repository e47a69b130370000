"""Repairs of height and normal maps, and checks of what they are.

Smooth stair steps, heights from normals, a report on seams, and a verdict on green channels:

>>> import bumpwgpu as bw
>>> wall = bw.HeightMap.procedural("bricks", 64)
>>> bw.tile_report(wall).tiles
True
>>> bw.check_normals(bw.bake(wall)["normal"], wall).convention
'opengl'
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from ._checks import choice, number, whole
from ._images import read_any
from .baking import Progress
from .errors import BumpWarning
from .heightmap import HeightMap, HeightSource, Wrap

__all__ = [
    "DERIVATIVES",
    "CurlEvidence",
    "HeightEvidence",
    "IntegratedHeights",
    "NormalReport",
    "Seam",
    "TileReport",
    "check_normals",
    "dequantise",
    "heights_from_normals",
    "tile_report",
]

#: What the slopes in a normal map may stand for: true ones, or what a slope kernel makes of texels.
DERIVATIVES: tuple[str, ...] = tuple(_bumpwgpu.derivatives())


class Seam(NamedTuple):
    """The edge of a map across one axis, as it would meet itself; means of absolute differences.

    Attributes
    ----------
    verdict : {"tiles", "crease", "seam"}
        "crease": the heights meet, the slopes do not. "seam": a step in height.
    step, inner_step, ratio : float
        Step in height from the last texel to the first, between neighbours inside, and their
        quotient: about 1 or below for maps that tile.
    local : float
        The step over the mean step of the texels next to it, so that a feature at the edge, such as
        a joint between bricks, is not taken for a seam.
    rank : float
        Share of the lines inside that step less, 0..1.
    bend, inner_bend, bend_ratio, bend_rank : float
        The same for second differences.
    worst : (int, float)
        The row (column, for y) with the largest step, and that step.
    """

    verdict: Literal["tiles", "crease", "seam"]
    step: float
    inner_step: float
    ratio: float
    local: float
    rank: float
    bend: float
    inner_bend: float
    bend_ratio: float
    bend_rank: float
    worst: tuple[int, float]


class TileReport(NamedTuple):
    """Whether a map tiles, along each axis. ``str(report)`` is a line for each.

    Attributes
    ----------
    x : Seam
        Last column against first.
    y : Seam
        Last row against first.
    """

    x: Seam
    y: Seam

    @property
    def tiles(self) -> bool:
        """Whether it tiles along both axes."""
        return self.x.verdict == self.y.verdict == "tiles"

    def __str__(self) -> str:
        def line(axis: str, seam: Seam) -> str:
            along = "row" if axis == "x" else "column"
            return (
                f"{axis}: {seam.verdict}; step {seam.ratio:.2f} x inside, {seam.local:.2f} x beside it; "
                f"bend {seam.bend_ratio:.2f} x inside; worst at {along} {seam.worst[0]}"
            )

        return "\n".join(line(axis, seam) for axis, seam in zip("xy", self, strict=True))


class CurlEvidence(NamedTuple):
    """What the normals say by themselves: slopes of a surface have no curl.

    Attributes
    ----------
    convention, swapped
        The reading with the least curl: which way green points, and whether red holds y.
    share : (float, float, float, float)
        Curl of the readings opengl, directx, and both with red and green exchanged: 0 for a surface, 1
        for channels that have nothing to do with each other, 2 for a wrong sign.
    confidence : float
        One less the least share over the next one.
    votes : float
        Share of the map's blocks that agree on green.
    decides : bool
        Whether that is enough for a verdict.
    """

    convention: Literal["opengl", "directx"]
    swapped: bool
    share: tuple[float, float, float, float]
    confidence: float
    votes: float
    decides: bool


class HeightEvidence(NamedTuple):
    """What normals and heights say about each other.

    Attributes
    ----------
    convention, swapped
        The reading that fits best.
    inverted : bool
        The heights are depths - or both axes of the normals are turned round, which looks the same.
    correlation : (float, float, float, float)
        Slopes of normals, read as opengl, and heights: x with x, y with y, the normals' y with the
        heights' x, and the other way round.
    confidence : float
        The lower correlation of that reading, 0..1.
    decides : bool
        Whether the normals belong to the heights.
    scale : float
        The ``scale`` of the height map at which its normals come closest, in mesh units.
    mean_error : float
        Mean angle that is left at that scale, in degrees.
    flat_error : float
        Mean angle between the normals and a flat map's, in degrees.
    """

    convention: Literal["opengl", "directx"]
    swapped: bool
    inverted: bool
    correlation: tuple[float, float, float, float]
    confidence: float
    decides: bool
    scale: float
    mean_error: float
    flat_error: float


@dataclass(frozen=True)
class NormalReport:
    """What is known of a normal map. ``str(report)`` says it in a few lines.

    Attributes
    ----------
    convention : {"opengl", "directx"} or None
        Which way green points; None when the evidence does not decide.
    swapped : bool or None
        Whether red and green are exchanged.
    confidence : float
        0..1, of the evidence that decided.
    mean_length, length_range : float, (float, float)
        Lengths of the vectors as stored.
    not_unit : float
        Share of texels whose length is off by more than 0.02.
    inward : float
        Share of texels that point into the surface.
    curl : CurlEvidence or None
        None for flat maps.
    heights : HeightEvidence or None
        None without a height map, or with a flat one.
    """

    convention: Literal["opengl", "directx"] | None
    swapped: bool | None
    confidence: float
    mean_length: float
    length_range: tuple[float, float]
    not_unit: float
    inward: float
    curl: CurlEvidence | None
    heights: HeightEvidence | None

    def __str__(self) -> str:
        if self.convention is None:
            lines = ["green: undecided"]
        else:
            exchanged = ", red and green exchanged" if self.swapped else ""
            lines = [f"green: {self.convention}{exchanged}, confidence {self.confidence:.2f}"]
        if self.curl is not None:
            shares = ", ".join(f"{share:.2f}" for share in self.curl.share)
            lines.append(f"curl: {shares} (opengl, directx, both exchanged); votes {self.curl.votes:.0%}")
        if self.heights is not None:
            with_them = self.heights
            belongs = "fit" if with_them.decides else "do not fit"
            upside = ", upside down (depths)" if with_them.inverted else ""
            lines.append(
                f"heights: {belongs}{upside}, correlation {with_them.confidence:.2f}; scale "
                f"{with_them.scale:.4g}, {with_them.mean_error:.2f} degrees off (flat: "
                f"{with_them.flat_error:.2f})"
            )
        lines.append(
            f"length: mean {self.mean_length:.3f}, {self.not_unit:.1%} not unit, {self.inward:.1%} inward"
        )
        return "\n".join(lines)


class IntegratedHeights(NamedTuple):
    """Heights from normals, and what they do not explain.

    Attributes
    ----------
    height_map : HeightMap
        Heights stretched to 0..1, with the ``scale`` that belongs to them.
    residual : float
        Share of the squared slopes, 0..1, that no height map has; near 0 for normals of a surface, 1
        for a whirl.
    mean_error : float
        Mean angle between the normals and those of the heights, in degrees.
    mean_slope : (float, float)
        Mean slope of the normals along x and, downwards, y: a map that repeats cannot have it.
    clipped : int
        Texels laid back because they were steeper than allowed, or pointed in.
    """

    height_map: HeightMap
    residual: float
    mean_error: float
    mean_slope: tuple[float, float]
    clipped: int


def dequantise(
    source: HeightMap | HeightSource,
    *,
    bits: int | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> HeightMap:
    """Smooth the stair steps out of heights that were rounded to few levels.

    The result is the smoothest surface, in the sense of a thin plate, that stays within half a level
    of the input everywhere: **rounding it gives the input back**, also after it was stored in 16
    bits. Real steps of several levels, and flat ground between them, stay; roughness that is no
    rounding stays; a lone step of one level cannot be told from a gentle slope and becomes one.

    Parameters
    ----------
    source : HeightMap, path, array or PIL image
        The heights.
    bits : int or None
        The levels are ``k / (2**bits - 1)``, 1 to 15 bits. None: the step between the levels is found
        in the data, which may be stretched and have levels missing.
    progress : callable or None
        Called as ``progress(done, total)``; an exception from it stops the work.
    **options
        For sources that are no HeightMap yet: what :class:`HeightMap` takes.

    Returns
    -------
    HeightMap
        With the extent and wrap of the source; a repeating map is smoothed across its edge.

    Raises
    ------
    ValueError, TypeError
        Heights that lie on no levels, or what :class:`HeightMap` raises.
    FileNotFoundError, BakeError
        The file is missing or damaged, or the memory does not suffice.

    Warns
    -----
    BumpWarning
        There is nothing to smooth: one level, or steps as fine as those of 16 bits.

    Notes
    -----
    A plate in a box, solved from coarse to fine; weights follow from what rounding can do to second
    differences. Related: Rudin, Osher, Fatemi 1992; Smith and Wessel 1990.

    Examples
    --------
    >>> import numpy as np
    >>> import bumpwgpu as bw
    >>> ramp = np.rint(np.linspace(20, 30, 100) * np.ones((20, 1))).astype(np.uint8)
    >>> smooth = bw.dequantise(ramp, wrap="clamp")
    >>> bool((np.rint(smooth.array * 255) == ramp).all()), len(np.unique(smooth.array[10])) > 90
    (True, True)
    """
    heights = _height_map(source, options)
    if bits is not None:
        quantum: float | None = 1.0 / (2 ** whole("bits", bits, 1, 15) - 1)
    else:
        quantum = _bumpwgpu.quantum(heights.array)
        if quantum is None and float(heights.array.min()) < float(heights.array.max()):
            raise ValueError("the heights lie on no levels of up to 16 bits: there are no steps to smooth")
    if quantum is None or quantum < 1.5 / 65535.0:
        what = "one level" if quantum is None else "steps as fine as those of 16 bits"
        warnings.warn(f"the heights have {what}: nothing to smooth", BumpWarning, stacklevel=2)
        return heights
    smooth = _bumpwgpu.dequantise(heights._field, quantum, _callback(progress))
    return HeightMap(
        smooth, scale=heights.scale, base=heights.base, tile_size=heights.tile_size, wrap=heights.wrap
    )


def tile_report(source: HeightMap | HeightSource, **options: Any) -> TileReport:
    """Whether a height map tiles: steps and bends across its edge against those inside.

    The check before and after a map is detiled, also as ``bumpwgpu lint``.

    Parameters
    ----------
    source : HeightMap, path, array or PIL image
        The heights; their wrap does not matter.
    **options
        For sources that are no HeightMap yet: what :class:`HeightMap` takes.

    Returns
    -------
    TileReport

    Raises
    ------
    ValueError, TypeError, FileNotFoundError, BakeError
        What :class:`HeightMap` raises.

    Examples
    --------
    >>> import numpy as np
    >>> import bumpwgpu as bw
    >>> report = bw.tile_report(np.linspace(0, 1, 32) * np.ones((16, 1)))
    >>> report.x.verdict, report.x.ratio, report.y.verdict
    ('seam', 31.0..., 'tiles')
    """
    heights = _height_map(source, options)
    x, y = (Seam(**entry) for entry in _bumpwgpu.seams(heights._field))
    return TileReport(x, y)


def heights_from_normals(
    normals: Any,
    *,
    convention: Literal["opengl", "directx"] = "opengl",
    wrap: Wrap = "repeat",
    tile_size: float | tuple[float, float] = (1.0, 1.0),
    base: float = 1.0,
    kernel: str = "sobel3",
    steepest: float = 85.0,
    progress: Progress | None = None,
) -> IntegratedHeights:
    """Height map out of a normal map, in the least squares of slopes.

    Parameters
    ----------
    normals : path, array or PIL image
        (H, W, 3 or 4), or (H, W, 2) with z left out: integers as image files hold them, where the code
        of a flat texel (128, 128) counts as exactly flat, or floats; the length does not matter.
    convention : {"opengl", "directx"}
        Whether green points up or down the image; :func:`check_normals` tells.
    wrap : {"repeat", "clamp", "mirror"}
        What lies beyond the edge. A map that repeats has no mean slope; the others may.
    tile_size : float or (float, float), default (1, 1)
        Mesh units covered by one tile along u and v.
    base : float, default 1.0
        Of the height map made.
    kernel : str, default "sobel3"
        What the slopes stand for: "spectral" for true slopes of a smooth surface, or the kernel the map
        was baked with: any of :data:`DERIVATIVES`.
    steepest : float, default 85
        Degrees; steeper normals are laid back to it.
    progress : callable or None
        Called as ``progress(done, total)``; an exception from it stops the work.

    Returns
    -------
    IntegratedHeights

    Raises
    ------
    ValueError, TypeError
        A wrong shape or setting, or NaN.
    FileNotFoundError, BakeError
        The file is missing or damaged, or the memory does not suffice.

    Notes
    -----
    Frankot and Chellappa 1988 for maps that repeat, in one Fourier transform; slopes halfway between
    texels with free edges (Horn and Brooks 1986) for the others.

    Examples
    --------
    >>> import numpy as np
    >>> import bumpwgpu as bw
    >>> wave = 0.5 + 0.5 * np.sin(np.arange(64) / 64 * 2 * np.pi) * np.ones((48, 1))
    >>> there = bw.HeightMap(wave, scale=0.2)
    >>> back = bw.heights_from_normals(bw.bake(there)["normal"])
    >>> round(back.height_map.scale, 3), bool(abs(back.height_map.array - there.array).max() < 1e-3)
    (0.2, True)
    """
    choice("convention", convention, ("opengl", "directx"))
    choice("kernel", kernel, DERIVATIVES)
    choice("wrap", wrap, ("repeat", "clamp", "mirror"))
    steepest = number("steepest", steepest, 1.0, 89.9)
    vectors = _normals(normals, exactly_flat=True)
    # A height map checks what becomes of tile_size and base.
    extent = HeightMap(np.zeros((1, 1), np.float32), tile_size=tile_size, base=base)
    heights, about = _bumpwgpu.integrate_normals(
        vectors,
        convention,
        wrap,
        extent.tile_size,
        kernel,
        math.tan(math.radians(steepest)),
        _callback(progress),
    )
    made = HeightMap(heights, scale=about.pop("scale"), base=base, tile_size=extent.tile_size, wrap=wrap)
    return IntegratedHeights(
        made, about["residual"], about["mean_error"], tuple(about["mean_slope"]), about["clipped"]
    )


def check_normals(
    normals: Any, heights: HeightMap | HeightSource | None = None, *, wrap: Wrap = "repeat"
) -> NormalReport:
    """Which way a normal map's channels point, and whether it belongs to a height map.

    Parameters
    ----------
    normals : path, array or PIL image
        (H, W, 3 or 4), or (H, W, 2) with z left out: integers as image files hold them, or floats.
    heights : HeightMap, path, array, PIL image or None
        The heights they should belong to, of any size; the ``scale`` reported is in the units of their
        ``tile_size``.
    wrap : {"repeat", "clamp", "mirror"}
        What lies beyond the edge of the normal map; only "repeat" looks across it.

    Returns
    -------
    NormalReport

    Raises
    ------
    ValueError, TypeError
        A wrong shape or setting, or NaN; what :class:`HeightMap` raises.
    FileNotFoundError, BakeError
        A file is missing or damaged.

    Notes
    -----
    Without heights the verdict comes from the curl, which is 0 for slopes of a surface read the right
    way. It cannot tell depths from heights, nor both axes turned round.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> wall = bw.HeightMap.procedural("fbm", 64)
    >>> directx = bw.bake(wall, convention="directx")["normal"]
    >>> bw.check_normals(directx).convention
    'directx'
    """
    choice("wrap", wrap, ("repeat", "clamp", "mirror"))
    vectors = _normals(normals, exactly_flat=False)
    field = None if heights is None else _height_map(heights, {})._field
    entry = _bumpwgpu.check_normals(vectors, wrap, field)
    curl, against = entry.pop("curl"), entry.pop("heights")
    return NormalReport(
        curl=None if curl is None else CurlEvidence(**{**curl, "share": tuple(curl["share"])}),
        heights=None
        if against is None
        else HeightEvidence(**{**against, "correlation": tuple(against["correlation"])}),
        **entry,
    )


def _height_map(source: Any, options: dict[str, Any]) -> HeightMap:
    if not isinstance(source, HeightMap):
        return HeightMap(source, **options)
    if options:
        raise TypeError(f"unexpected options {', '.join(options)}: the source is a HeightMap already")
    return source


def _callback(progress: Any) -> Progress | None:
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be callable, got {type(progress).__name__}")
    return cast("Progress | None", progress)


def _normals(source: Any, exactly_flat: bool) -> NDArray[np.float32]:
    """(H, W, 3) vectors of any length out of an image; `exactly_flat` reads the code of flat as 0."""
    values = read_any(source, "normals").values
    if values.ndim != 3 or values.shape[2] not in (2, 3, 4) or values.size == 0:
        raise ValueError(f"normals must have shape (H, W, 2 to 4), got {values.shape}")
    if max(values.shape[:2]) > _bumpwgpu.MAX_SIDE:
        raise ValueError(
            f"normals are {values.shape[1]} x {values.shape[0]}; a side may be {_bumpwgpu.MAX_SIDE}"
        )
    values = values[:, :, :3]
    if values.dtype.kind == "f":
        with np.errstate(over="ignore"):
            vectors = values.astype(np.float32)
        if not np.isfinite(vectors).all():
            raise ValueError("normals have NaN or infinite values")
        # Lengths do not matter; their squares must fit.
        if float(np.abs(vectors).max()) > 1e15:
            raise ValueError("normals have components beyond 1e15")
    elif values.dtype in (np.uint8, np.uint16):
        top = np.iinfo(values.dtype).max
        vectors = values.astype(np.float32) * np.float32(2.0 / top) - np.float32(1.0)
        if exactly_flat:
            # No integer stands for 0; both neighbours of it are used for flat texels.
            xy = values[:, :, :2]
            flat = (xy == top // 2 + 1).all(axis=2) | (xy == top // 2).all(axis=2)
            vectors[flat, :2] = 0.0
    else:
        raise TypeError(f"normals must be uint8, uint16 or floats, got {values.dtype}")
    if vectors.shape[2] == 2:
        z = np.sqrt(np.clip(1.0 - (vectors * vectors).sum(axis=2), 0.0, 1.0))
        vectors = np.dstack((vectors, z))
    return np.ascontiguousarray(vectors, dtype=np.float32)
