"""Marching batches of rays through a height map."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bumpwgpu
from ._checks import choice, flag, rows, strings
from .heightmap import HeightMap
from .techniques import Technique, get, marching

__all__ = ["OUTPUTS", "Device", "Hits", "march"]

Device: TypeAlias = Literal["cpu", "gpu", "auto"]

#: Everything `march` can return.
OUTPUTS = ("t", "uv", "z", "normal", "steps", "status")


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
        Height reads or nodes visited.
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

    Returns
    -------
    Hits

    Raises
    ------
    ValueError
        Wrong shapes, no rays, an infinite, NaN or zero direction (the message names the ray), an
        unknown technique or output.
    TypeError
        Arguments of the wrong type.
    RenderError
        ``device="gpu"`` without a Vulkan device.

    Notes
    -----
    ``"exact"`` solves each bilinear cell in closed form (Musgrave 1988) and skips with a max pyramid
    (Tevs, Ihrke, Seidel 2008). A ray that starts below the surface hits at t = 0.

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
    chosen = get(technique)
    if not chosen.marches:
        raise ValueError(f"technique {chosen.name!r} does not march; these do: {', '.join(marching())}")
    wanted = strings("outputs", outputs, OUTPUTS)
    if not wanted:
        raise ValueError(f"outputs is empty; ask for at least one of {', '.join(OUTPUTS)}")
    from_surface = flag("from_surface", from_surface)
    starts, ways = _rays("origins", origins), _rays("directions", directions)
    choice("device", device, ("cpu", "gpu", "auto"))
    if device == "auto":
        on_device = not from_surface and starts.dtype == ways.dtype == np.float32 and _has_hardware()
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
        return Hits(arrays, seconds)
    arrays = _bumpwgpu.march(height_map._field, starts, ways, chosen.name, parameters, wanted, from_surface)
    return Hits(arrays)


@cache
def _has_hardware() -> bool:
    return any(kind in ("discrete", "integrated") for *_, kind in _bumpwgpu.adapters())


def _rays(name: str, values: Any) -> NDArray[Any]:
    """(N, 3) float32 or float64, C-contiguous, aligned, native: copied only when it is not."""
    array = rows(name, values, 3)
    if array.shape[0] == 0:
        raise ValueError(f"{name} is empty: there are no rays to march")
    dtype = np.float32 if array.dtype == np.float32 else np.float64
    return np.require(array, dtype=dtype, requirements=("C", "A"))
