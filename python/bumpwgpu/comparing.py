"""Run time against error: which technique suits an asset, measured against the exact surface."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, TypeAlias

from . import _bumpwgpu
from . import techniques as _techniques
from ._checks import choice, number, whole
from .compare_result import FORMATS, CompareResult, Progress
from .compare_scene import Scene
from .heightmap import HeightMap
from .system import machine
from .techniques import Technique

__all__ = ["ELEVATIONS", "compare"]

Device: TypeAlias = Literal["auto", "cpu", "gpu"]
_Settings: TypeAlias = "list[tuple[str, list[tuple[str, float]], str, str]]"

ELEVATIONS = (90.0, 45.0, 20.0, 10.0, 5.0)


def compare(
    source: HeightMap | Scene,
    techniques: str | Technique | Iterable[str | Technique] | None = None,
    *,
    elevations: Iterable[float] = ELEVATIONS,
    formats: Iterable[str] | None = None,
    device: Device = "auto",
    rays: int = 8192,
    repeats: int = 5,
    seed: int = 0,
    progress: Progress | None = None,
) -> CompareResult:
    """Measure run time and error of techniques on a height map or a mesh scene.

    Errors are against the exact surface, found in double precision. A height map is met by seeded
    rays at each elevation; of a scene every pixel that shows the mesh is checked.

    Parameters
    ----------
    source : HeightMap or Scene
        What to compare on.
    techniques : name, Technique, or several; None
        Which settings. None is every technique with its defaults and, on a height map, an adaptive
        sweep: each over its own parameters, more of them around the Pareto front, there with smaller
        texture formats too; what another setting beats by far gets no more than a first look (see
        ``CompareResult.dropped``). "relaxed_cone_texel", whose map takes long to bake, has to be named.
    elevations : iterable of float, default (90, 45, 20, 10, 5)
        View angles above the surface in degrees, in mesh units, above 0 to 90. The pixels of a scene
        are counted with the nearest of them.
    formats : iterable of str or None
        Texture formats to try each of the techniques with: "r32float", "r16float", "r16unorm",
        "r8unorm". Heights are rounded to the nearest value, cone ratios down. Errors are against the
        map as it is; times are those of 32-bit floats. None is 32-bit floats for named techniques.
    device : {"auto", "cpu", "gpu"}
        Whose time to take besides the CPU's. "auto" takes a Vulkan device if there is one. Scenes need
        one. The time of a software device is processor time, all its threads together.
    rays : int, default 8192
        Rays at each elevation of a height map, at most 2**20.
    repeats : int, default 5
        Timed repeats, taken in turns over all settings; the least, the median and the upper quartile are
        reported. What another setting beats by far at every elevation is timed twice.
    seed : int, default 0
        Fixes rays and lights.
    progress : callable or None
        Called as ``progress(done, total, text)``.

    Returns
    -------
    CompareResult

    Raises
    ------
    ValueError, TypeError
        Settings out of range or of the wrong kind.
    CompareError
        The device failed, or a needed package is missing.
    RenderError
        A scene without a Vulkan device.

    Notes
    -----
    A *miss* is a ray whose first hit was skipped: it went below the surface by more than 1e-4 of the
    relief and came up again before the reported hit. A *false hit* was reported in the air: more than 1 %
    of the relief above the surface and more than a texel short of the true one. Either is no answer at
    all, so a setting with more than 0.1 % of them is neither on the front nor recommended.

    Times whose ranges, from the least to the upper quartile, meet, or whose medians or least differ by less
    than 25 %, are a tie.
    Which settings the sweep tries depends on errors and texture reads, not on time, so it tries the same
    ones on every machine.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> result = bw.compare(bw.HeightMap.procedural("sines", 64), ["steep", "exact"], elevations=[45],
    ...                     device="cpu", rays=500, repeats=1)
    >>> result.recommend(max_error=0.1).technique
    'exact'
    """
    angles = _elevations(elevations)
    choice("device", device, ("auto", "cpu", "gpu"))
    count = whole("rays", rays, 1, 1 << 20)
    rounds = whole("repeats", repeats, 1, 1000)
    start = whole("seed", seed, 0, (1 << 64) - 1)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be callable, got {type(progress).__name__}")
    chosen = _chosen(techniques)
    if isinstance(source, Scene):
        from ._compare_scene import compare_scene

        if formats is not None:
            raise ValueError("formats are tried on height maps; a scene is drawn with 32-bit floats")
        return compare_scene(source, chosen, angles, device, rounds, progress)
    if not isinstance(source, HeightMap):
        raise TypeError(f"compare takes a HeightMap or a Scene, got {type(source).__name__}")
    for technique in chosen:
        if not technique.marches:
            known = ", ".join(_techniques.marching())
            raise ValueError(f"technique {technique.name!r} finds no hit on a height map; these do: {known}")
    settings = _settings(chosen, formats)
    rows, dropped, problem = _bumpwgpu.compare_planar(
        source._field, settings, angles, count, rounds, start, device, progress
    )
    for row in rows:
        row["elevation"] = "all" if row["elevation"] is None else row["elevation"]
    environment = {
        **machine(device != "cpu" and problem is None),
        "map": repr(source),
        "rays_per_elevation": count,
        "repeats": rounds,
        "seed": start,
    }
    environment["time"] = "CPU: processor time of one thread"
    if problem is not None:
        environment["device"] = f"none ({problem})"
    elif "(software)" in environment.get("device", ""):
        environment["time"] += "; device: processor time, all its threads together"
    elif device != "cpu":
        environment["time"] += "; device: its own clock"
    return CompareResult(rows, "planar", environment, source, dropped=dropped)


def _settings(chosen: list[Technique], formats: Any) -> _Settings:
    """Techniques with formats; none for the adaptive sweep."""
    if formats is None:
        wanted = [FORMATS[0]]
    else:
        wanted = [formats] if isinstance(formats, str) else list(formats)
        for name in wanted:
            choice("formats", name, FORMATS)
        if not wanted:
            raise ValueError("formats is empty; at least one is needed, or None")
        if not chosen:
            raise ValueError("formats go with named techniques: the adaptive sweep tries them by itself")
    settings: _Settings = []
    for technique in chosen:
        values = [(name, float(value)) for name, value in technique.parameters.items()]
        settings += [(technique.name, values, name, name) for name in dict.fromkeys(wanted)]
    return settings


def _elevations(elevations: Any) -> list[float]:
    if isinstance(elevations, int | float):
        elevations = (elevations,)
    try:
        angles = [number("elevations", angle) for angle in elevations]
    except TypeError:
        raise TypeError(f"elevations must be numbers, got {elevations!r}") from None
    for angle in angles:
        if not 0.0 < angle <= 90.0:
            raise ValueError(f"elevations must be above 0 and at most 90 degrees, got {angle:g}")
    if not 1 <= len(angles) <= 64:
        raise ValueError(f"elevations must be 1 to 64 angles, got {len(angles)}")
    return list(dict.fromkeys(angles))


def _chosen(techniques: Any) -> list[Technique]:
    """Technique objects, each once; empty for the default sweep."""
    if techniques is None:
        return []
    if isinstance(techniques, str | Technique):
        techniques = (techniques,)
    try:
        parts = list(techniques)
    except TypeError:
        raise TypeError(f"techniques must be names or techniques, got {type(techniques).__name__}") from None
    if not parts:
        raise ValueError("techniques is empty; at least one is needed, or None for the default sweep")
    return list(dict.fromkeys(_techniques.get(part) for part in parts))
