"""Marching batches of rays through a height map."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._blocks import BLOCK, Window, blocks
from ._checks import choice, flag, rows, strings
from .heightmap import HeightMap
from .techniques import Technique, get, marching

__all__ = ["OUTPUTS", "Device", "Hits", "march"]

Device: TypeAlias = Literal["cpu", "gpu", "auto"]

#: Everything `march` can return.
OUTPUTS = ("t", "uv", "z", "normal", "steps", "status")

# Numbers a ray and their type, of each output.
_SHAPES: dict[str, tuple[tuple[int, ...], type[np.generic]]] = {
    "t": ((), np.float32),
    "uv": ((2,), np.float32),
    "z": ((), np.float32),
    "normal": ((3,), np.float32),
    "steps": ((), np.uint32),
    "status": ((), np.uint8),
}


class Hits:
    """What the rays met. Only the outputs that were asked for are there; the arrays are yours.

    Attributes
    ----------
    t : ndarray of float32, (N,)
        Along the given direction; inf where there is no hit.
    uv : ndarray of float32, (N, 2)
        Texture coordinates of the hit, not reduced to one tile; NaN where there is none.
    z : ndarray of float32, (N,)
        Height of the hit, 0..1; NaN where there is none.
    normal : ndarray of float32, (N, 3)
        Unit normal of the bilinear surface in texture space, ``(-dh/du, -dh/dv, 1)`` normalised;
        NaN where there is no hit.
    steps : ndarray of uint32, (N,)
        Height reads or nodes visited. ``exact`` shares some with the neighbours of a ray, so its counts
        depend on them a little.
    status : ndarray of uint8, (N,)
        0 hit, 1 left without meeting the surface, 2 unconverged.
    outputs : tuple of str
        Which of the above are there.
    seconds : float or None
        Time on the device, where that was measured.
    """

    __slots__ = ("_arrays", "_seconds")

    def __init__(self, arrays: dict[str, NDArray[Any]], seconds: float | None = None) -> None:
        self._arrays = arrays
        self._seconds = seconds

    def _get(self, name: str) -> NDArray[Any]:
        if name not in self._arrays:
            raise AttributeError(f"{name!r} was not asked for: march(..., outputs=({name!r}, ...))")
        return self._arrays[name]

    @property
    def t(self) -> NDArray[np.float32]:
        """Ray parameter along the given direction, float32 (N,); inf where there is no hit."""
        return self._get("t")

    @property
    def uv(self) -> NDArray[np.float32]:
        """Texture coordinates of the hit, float32 (N, 2), not reduced to one tile."""
        return self._get("uv")

    @property
    def z(self) -> NDArray[np.float32]:
        """Height of the hit, float32 (N,), 0..1."""
        return self._get("z")

    @property
    def normal(self) -> NDArray[np.float32]:
        """Unit normal in texture space (u, v, z), float32 (N, 3)."""
        return self._get("normal")

    @property
    def steps(self) -> NDArray[np.uint32]:
        """Height reads or nodes visited, uint32 (N,)."""
        return self._get("steps")

    @property
    def status(self) -> NDArray[np.uint8]:
        """0 hit, 1 left, 2 unconverged, uint8 (N,)."""
        return self._get("status")

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the arrays that are there."""
        return tuple(self._arrays)

    @property
    def seconds(self) -> float | None:
        """Time on the device, None on the CPU."""
        return self._seconds

    def __len__(self) -> int:
        return len(next(iter(self._arrays.values())))

    def __repr__(self) -> str:
        return f"<Hits of {len(self)} rays: {', '.join(self.outputs)}>"


def march(
    height_map: HeightMap,
    origins: ArrayLike,
    directions: ArrayLike,
    technique: str | Technique = "exact",
    *,
    device: Device = "cpu",
    outputs: Iterable[str] = OUTPUTS,
    from_surface: bool = False,
    out: Mapping[str, NDArray[Any]] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Hits:
    """Find where rays first meet a height map.

    Parameters
    ----------
    height_map : HeightMap
        The surface, bilinear between texel centres.
    origins, directions : array_like, (N, 3)
        In texture space (u, v, z): u right, v down, z the height 0..1. Directions need not be of
        unit length. C-contiguous float32 and float64 arrays are used where they lie, without a copy,
        and float64 rays are not rounded to float32.
    technique : str or Technique, default "exact"
        One of :func:`bumpwgpu.techniques.marching`.
    device : {"cpu", "gpu", "auto"}, default "cpu"
        ``"gpu"`` runs the same search on the Vulkan device in 32 bits; ``"auto"`` does so where there
        is graphics hardware, the rays are float32, and they do not start on the surface.
    outputs : iterable of str
        Any of "t", "uv", "z", "normal", "steps", "status"; fewer are faster.
    from_surface : bool, default False
        The origins lie on the surface: the march leaves it first (shadow rays).
    out : mapping of str to ndarray, optional
        Arrays of yours that the results go to, by output name: C-contiguous, of the type and shape
        given in :class:`Hits`. Unless you say otherwise, `outputs` are those that it has. After an
        error they hold anything.
    progress : callable, optional
        Called as ``progress(rays done, all rays)`` after each million rays on the CPU, and at the end.

    Returns
    -------
    Hits
        With `out`, its arrays are those.

    Raises
    ------
    ValueError
        Wrong shapes, no rays, an infinite, NaN or zero direction (the message names the ray), an
        unknown technique or output, an array in `out` that does not fit or overlaps another.
    TypeError
        Arguments of the wrong type.
    RenderError
        ``device="gpu"`` without a Vulkan device.

    Notes
    -----
    ``"exact"`` solves each bilinear cell in closed form (Musgrave 1988) and skips with a max pyramid
    (Tevs, Ihrke, Seidel 2008). A ray that starts below the surface hits at t = 0.

    More rays than memory holds: give memory-mapped arrays, as ``numpy.load(path, mmap_mode="r")`` and
    ``numpy.lib.format.open_memmap`` make them, for rays and `out`. A million rays are in memory at a
    time; arrays that need a conversion are converted in such blocks too. For rays that are made as they
    are marched there is :func:`march_stream`.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> hm = bw.HeightMap.procedural("ridge", 64)
    >>> hits = bw.march(hm, [[0.25, 0.5, 1.0]], [[0.0, 0.0, -1.0]], outputs=("t", "z"))
    >>> round(float(hits.t[0]), 4), round(float(hits.z[0]), 4)
    (0.5, 0.5)
    """
    if not isinstance(height_map, HeightMap):
        raise TypeError(f"height_map must be a HeightMap, got {type(height_map).__name__}")
    chosen = _searching(technique)
    if out is not None and outputs is OUTPUTS:
        outputs = _names(out)
    wanted = wanted_outputs(outputs)
    from_surface = flag("from_surface", from_surface)
    starts, ways = _rays("origins", origins), _rays("directions", directions)
    choice("device", device, ("cpu", "gpu", "auto"))
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be callable, got {type(progress).__name__}")
    places = None if out is None else _places(out, wanted, starts, ways)
    if device == "auto":
        on_device = not from_surface and _dtype(starts) == _dtype(ways) == np.float32 and _has_hardware()
    else:
        on_device = device == "gpu"
    parameters = list(chosen.parameters.items())
    if on_device:
        if from_surface:
            raise ValueError("from_surface=True needs device='cpu'")
        arrays, seconds = _bumpwgpu.march_gpu(
            height_map._field,
            np.ascontiguousarray(starts, np.float32),
            np.ascontiguousarray(ways, np.float32),
            chosen.name,
            parameters,
            wanted,
        )
        if places is not None:
            for name, place in places.items():
                np.copyto(place, arrays[name])
            arrays = places
        return Hits(arrays, seconds)
    if places is None:
        places = empty_places(wanted, len(starts))
    _march_in_blocks(height_map, starts, ways, (chosen.name, parameters), places, from_surface, progress)
    return Hits(places)


def _march_in_blocks(
    height_map: HeightMap,
    starts: NDArray[Any],
    ways: NDArray[Any],
    technique: tuple[str, Sequence[tuple[str, float]]],
    places: dict[str, NDArray[Any]],
    from_surface: bool,
    progress: Callable[[int, int], object] | None,
) -> None:
    """One call where all lies in memory as it is needed; else a block of rays after the other."""
    name, parameters = technique
    total = len(starts)
    windows = [Window(array) for array in (starts, ways, *places.values())]
    usable = _usable(starts) and _usable(ways)
    if total <= BLOCK or (usable and progress is None and not any(window.mapped for window in windows)):
        _bumpwgpu.march(
            height_map._field, _ready(starts), _ready(ways), name, parameters, places, from_surface
        )
        if progress is not None:
            progress(total, total)
        return
    for first, last in blocks(total):
        for window in windows[:2]:
            window.read_ahead(last, last + BLOCK)
        _bumpwgpu.march(
            height_map._field,
            _ready(starts[first:last]),
            _ready(ways[first:last]),
            name,
            parameters,
            {output: place[first:last] for output, place in places.items()},
            from_surface,
            first,
        )
        for window in windows:
            window.let_go(first, last)
        if progress is not None:
            progress(last, total)


@cache
def _has_hardware() -> bool:
    return any(kind in ("discrete", "integrated") for *_, kind in _bumpwgpu.adapters())


def _searching(technique: str | Technique) -> Technique:
    chosen = get(technique)
    if not chosen.marches:
        raise ValueError(f"technique {chosen.name!r} does not march; these do: {', '.join(marching())}")
    return chosen


def wanted_outputs(outputs: Iterable[str]) -> list[str]:
    """The outputs by name, at least one."""
    wanted = strings("outputs", outputs, OUTPUTS)
    if not wanted:
        raise ValueError(f"outputs is empty; ask for at least one of {', '.join(OUTPUTS)}")
    return wanted


def empty_places(wanted: Iterable[str], count: int) -> dict[str, NDArray[Any]]:
    """Arrays for the results of so many rays, in the order of `OUTPUTS`."""
    shapes = {name: _SHAPES[name] for name in OUTPUTS if name in wanted}
    return {name: np.empty((count, *shape), dtype) for name, (shape, dtype) in shapes.items()}


def _names(out: Mapping[str, NDArray[Any]]) -> list[str]:
    if not isinstance(out, Mapping):
        raise TypeError(f"out must map output names to arrays, got {type(out).__name__}")
    names = strings("out", out, OUTPUTS)
    if not names:
        raise ValueError(f"out is empty; give an array for at least one of {', '.join(OUTPUTS)}")
    return names


def _places(
    out: Mapping[str, NDArray[Any]], wanted: list[str], starts: NDArray[Any], ways: NDArray[Any]
) -> dict[str, NDArray[Any]]:
    """The arrays of `out`, checked: what is written to them must not change what is read."""
    names = _names(out)
    if set(names) != set(wanted):
        raise ValueError(f"out has {', '.join(names)} but outputs are {', '.join(wanted)}")
    others = {"origins": starts, "directions": ways}
    places: dict[str, NDArray[Any]] = {}
    for name in (name for name in OUTPUTS if name in names):
        place, (shape, dtype) = out[name], _SHAPES[name]
        if not isinstance(place, np.ndarray):
            raise TypeError(f"out[{name!r}] must be an array, got {type(place).__name__}")
        expected = (len(starts), *shape)
        if place.shape != expected or place.dtype != dtype:
            need = f"{np.dtype(dtype)} of shape {expected}"
            raise ValueError(f"out[{name!r}] must be {need}, got {place.dtype} of shape {place.shape}")
        if not (place.flags.c_contiguous and place.flags.aligned and place.flags.writeable):
            raise ValueError(f"out[{name!r}] must be C-contiguous, aligned and writable")
        for other, array in (*others.items(), *((f"out[{n!r}]", a) for n, a in places.items())):
            if np.may_share_memory(place, array):
                raise ValueError(f"out[{name!r}] overlaps {other}")
        places[name] = place.view(np.ndarray)
    return places


def _rays(name: str, values: Any) -> NDArray[Any]:
    """(N, 3) numbers, where and as they lie."""
    array = rows(name, values, 3)
    if array.shape[0] == 0:
        raise ValueError(f"{name} is empty: there are no rays to march")
    return array


def _dtype(rays: NDArray[Any]) -> type[np.generic]:
    return np.float32 if rays.dtype == np.float32 else np.float64


def _usable(rays: NDArray[Any]) -> bool:
    """Whether the core can read the rays where they lie."""
    return bool(rays.dtype == _dtype(rays) and rays.flags.c_contiguous and rays.flags.aligned)


def _ready(rays: NDArray[Any]) -> NDArray[Any]:
    """float32 or float64, C-contiguous, aligned, native: copied only when it is not."""
    return np.require(rays, dtype=_dtype(rays), requirements=("C", "A"))
