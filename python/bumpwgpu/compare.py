"""Run time against error: which technique suits an asset, measured against the exact surface."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from . import techniques as _techniques
from ._atomic import replace_file
from ._checks import choice, flag, number, whole
from .heightmap import HeightMap
from .meshes import Mesh
from .scene import Camera, Light, Material
from .techniques import Technique

__all__ = ["CompareResult", "Recommendation", "Scene", "compare"]

Device: TypeAlias = Literal["auto", "cpu", "gpu"]
Progress: TypeAlias = Callable[[int, int, str], object]
Row: TypeAlias = "dict[str, Any]"

ELEVATIONS = (90.0, 45.0, 20.0, 10.0, 5.0)
#: A technique that gets more than this share of rays wrong altogether is neither recommended nor on
#: the Pareto front.
MAX_FAILURE_RATE = 1e-3
#: Columns and rows of the pictures of a height map in a report.
PICTURE_SIZE = (480, 300)


@dataclass(frozen=True)
class Scene:
    """A mesh with its material, seen by a camera: what `compare` takes besides a height map.

    Attributes
    ----------
    mesh : Mesh
        The mesh.
    material : Material
        Its material, with a height map.
    camera : Camera
        Where it is seen from.
    lights : sequence of Light
        None at all is one directional light from the upper right.
    size : int or (int, int), default (512, 512)
        Pixels: the side of a square, or (width, height).
    shadows : bool, default True
        Whether the relief casts shadows on itself.
    """

    mesh: Mesh
    material: Material
    camera: Camera
    lights: Sequence[Light] = ()
    size: tuple[int, int] = (512, 512)
    shadows: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.mesh, Mesh):
            raise TypeError(f"mesh must be a Mesh, got {type(self.mesh).__name__}")
        if not isinstance(self.material, Material):
            raise TypeError(f"material must be a Material, got {type(self.material).__name__}")
        if self.material.height is None:
            raise ValueError("the material has no height map: there is nothing to compare")
        if not isinstance(self.camera, Camera):
            raise TypeError(f"camera must be a Camera, got {type(self.camera).__name__}")
        lights = (self.lights,) if isinstance(self.lights, Light) else tuple(self.lights)
        for light in lights:
            if not isinstance(light, Light):
                raise TypeError(f"lights must be Light objects, got {type(light).__name__}")
        object.__setattr__(self, "lights", lights)
        object.__setattr__(self, "size", _size(self.size))
        flag("shadows", self.shadows)


@dataclass(frozen=True)
class Recommendation:
    """What to use, and why; or why nothing qualifies.

    Attributes
    ----------
    technique : str or None
        Name of the technique, None when nothing is within the budget.
    parameters : dict of str to int
        Its parameters.
    error_p99_texels : float or None
        The bound it was measured at: 99th percentile of the hit-uv error in texels.
    failure_rate : float or None
        Measured share of rays without a right hit, 0..1.
    time_ns_per_ray : float or None
        Median time.
    reason : str
        One or two sentences.
    """

    technique: str | None
    parameters: dict[str, int]
    error_p99_texels: float | None
    failure_rate: float | None
    time_ns_per_ray: float | None
    reason: str

    def __bool__(self) -> bool:
        return self.technique is not None

    def __str__(self) -> str:
        return self.reason if self.technique is not None else f"No recommendation. {self.reason}"


@dataclass(frozen=True)
class Picture:
    """A picture a technique made: `rgb` (H, W, 3) uint8 sRGB, `error_texels` (H, W), NaN without a hit."""

    label: str
    rgb: NDArray[np.uint8]
    error_texels: NDArray[np.float32]


def label(technique: str, parameters: dict[str, int]) -> str:
    """``relief(linear=32, refine=8)``; the bare name without parameters."""
    inside = ", ".join(f"{name}={value}" for name, value in parameters.items())
    return f"{technique}({inside})" if inside else technique


@dataclass(frozen=True)
class CompareResult:
    """What each technique costs and how wrong it is.

    Attributes
    ----------
    rows : list of dict
        One for each technique and elevation (degrees), and one with ``elevation="all"``:

        ``technique``, ``parameters``, ``label``, ``elevation``, ``rays``;
        ``time_cpu_ns_per_ray`` and ``time_device_ns_per_ray`` (median, with ``_low`` and ``_high``
        quartiles; CPU on all cores; None where not measured);
        ``uv_error_median_texels``, ``uv_error_p99_texels``, ``uv_error_max_texels``,
        ``share_above_1_texel``; ``depth_error_p99``, ``depth_error_max`` (heights 0..1);
        ``normal_error_median_deg``, ``normal_error_p99_deg``;
        ``miss_rate`` (first hit skipped), ``false_hit_rate`` (hit reported above the surface),
        ``unconverged_rate``, ``nan_count``, ``failure_rate`` (missed, unconverged or NaN);
        ``shadow_error_rate`` (None for techniques without shadows); ``steps_mean``;
        ``device_difference_p99_texels``, ``device_difference_hit_rate`` (device against CPU).

        For scenes a ray is a pixel, the time is that of the whole frame over the pixels of the mesh,
        and the "all" rows also have ``flip_mean``, ``psnr_db``, ``ssim`` of the picture against the
        exact one (``psnr_db`` is None for equal pictures).
    kind : {"planar", "scene"}
        What was compared.
    environment : dict
        Device, driver, versions, settings.
    """

    rows: list[Row]
    kind: Literal["planar", "scene"]
    environment: dict[str, Any]
    _source: HeightMap | Scene = field(repr=False)
    _pictures: list[Picture] = field(default_factory=list, repr=False)

    @property
    def elevations(self) -> list[Any]:
        """Elevations in degrees, then ``"all"``."""
        return list(dict.fromkeys(row["elevation"] for row in self.rows))

    @property
    def timed_on(self) -> Literal["cpu", "device"]:
        """Whose time ranks the techniques unless told otherwise: the device's where there is one."""
        return "device" if all(row["time_device_ns_per_ray"] is not None for row in self.rows) else "cpu"

    def select(self, elevation: float | str = "all") -> list[Row]:
        """The rows of one elevation.

        Parameters
        ----------
        elevation : float or "all"
            Degrees.

        Returns
        -------
        list of dict

        Raises
        ------
        ValueError
            No such elevation was measured.
        """
        rows = [row for row in self.rows if row["elevation"] == elevation]
        if not rows:
            known = ", ".join(str(known) for known in self.elevations)
            raise ValueError(f"no rows at elevation {elevation!r}; there are: {known}")
        return rows

    def pareto(
        self,
        elevation: float | str = "all",
        *,
        time: Literal["cpu", "device"] | None = None,
        max_failure_rate: float = MAX_FAILURE_RATE,
    ) -> list[Row]:
        """The settings worth having: nothing else is both faster and more accurate.

        Parameters
        ----------
        elevation : float or "all"
            Which rows to rank.
        time : {"cpu", "device"} or None
            Whose time counts; None for the device's where there is one.
        max_failure_rate : float, default 0.001
            Settings that fail on a larger share of the rays are left out: misses are no trade.

        Returns
        -------
        list of dict
            Rows by rising time, each with ``tied_with``: labels of the others on the front whose time
            cannot be told from its own (the quartile ranges meet).

        Raises
        ------
        ValueError
            No such elevation, or no such time was measured.
        """
        rows, measured = self._measured(elevation, time)
        allowed = number("max_failure_rate", max_failure_rate, 0.0, 1.0)
        front = _bumpwgpu.compare_front(measured, allowed)
        return [{**rows[at], "tied_with": [rows[other]["label"] for other in tied]} for at, tied in front]

    def recommend(
        self,
        max_error: float = 0.5,
        *,
        max_failure_rate: float = MAX_FAILURE_RATE,
        elevation: float | str = "all",
        time: Literal["cpu", "device"] | None = None,
    ) -> Recommendation:
        """The cheapest setting within an error budget.

        Parameters
        ----------
        max_error : float, default 0.5
            Largest 99th percentile of the hit-uv error, texels.
        max_failure_rate : float, default 0.001
            Largest share of rays without a right hit.
        elevation : float or "all"
            Which rows count.
        time : {"cpu", "device"} or None
            Whose time counts; None for the device's where there is one.

        Returns
        -------
        Recommendation
            False in a condition when nothing qualifies; its reason says what came nearest.

        Raises
        ------
        ValueError
            A budget out of range, no such elevation, or no such time was measured.
        """
        rows, measured = self._measured(elevation, time)
        budget = number("max_error", max_error, 0.0)
        allowed = number("max_failure_rate", max_failure_rate, 0.0, 1.0)
        at, reason = _bumpwgpu.compare_recommend(measured, budget, allowed)
        if at is None:
            return Recommendation(None, {}, None, None, None, reason)
        row = rows[at]
        worst = max(
            (other for other in self.rows if other["label"] == row["label"]),
            key=lambda other: other["uv_error_p99_texels"],
        )
        if elevation == "all" and worst["uv_error_p99_texels"] > row["uv_error_p99_texels"]:
            texels = worst["uv_error_p99_texels"]
            reason += (
                f" At its worst angle, {worst['elevation']:g} degrees, the p99 error is {texels:.3g} texels."
            )
        return Recommendation(
            row["technique"],
            dict(row["parameters"]),
            row["uv_error_p99_texels"],
            row["failure_rate"],
            measured[at][1][1],
            reason,
        )

    def _measured(self, elevation: float | str, time: str | None) -> tuple[list[Row], list[Any]]:
        """Rows of one elevation, and what the ranking needs of each."""
        rows = self.select(elevation)
        clock = self.timed_on if time is None else choice("time", time, ("cpu", "device"))
        keys = [f"time_{clock}_ns_per_ray{end}" for end in ("_low", "", "_high")]
        if any(row[key] is None for row in rows for key in keys):
            other = "cpu" if clock == "device" else "device"
            raise ValueError(f"no {clock} time was measured; use time={other!r}")
        return rows, [
            (row["label"], [row[key] for key in keys], row["uv_error_p99_texels"], row["failure_rate"])
            for row in rows
        ]

    def to_json(self, path: str | os.PathLike[str]) -> Path:
        """Write rows, recommendation and environment as JSON.

        Parameters
        ----------
        path : path
            The file; replaced whole or not at all.

        Returns
        -------
        Path

        Raises
        ------
        FileNotFoundError
            The folder does not exist.
        """
        advice = self.recommend()
        data = {
            "kind": self.kind,
            "environment": self.environment,
            "timed_on": self.timed_on,
            "rows": self.rows,
            "pareto": [row["label"] for row in self.pareto()],
            "recommendation": {
                "technique": advice.technique,
                "parameters": advice.parameters,
                "error_p99_texels": advice.error_p99_texels,
                "reason": advice.reason,
            },
        }
        text = json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)
        return replace_file(path, text.encode())

    def plot(self, path: str | os.PathLike[str]) -> Path:
        """Plot time against error, one panel for each elevation. Needs matplotlib.

        Parameters
        ----------
        path : path
            ``.png``, ``.svg`` or ``.pdf``.

        Returns
        -------
        Path

        Raises
        ------
        CompareError
            matplotlib is missing.
        ValueError
            It does not write files with this suffix.
        FileNotFoundError
            The folder does not exist.
        """
        from .plot import plot

        return plot(self, path)

    def report(self, path: str | os.PathLike[str], *, title: str | None = None) -> Path:
        """Write one HTML file with pictures, plot and tables; it needs nothing else to be shown.

        Parameters
        ----------
        path : path
            The file; replaced whole or not at all.
        title : str or None
            Heading; None describes what was compared.

        Returns
        -------
        Path

        Raises
        ------
        FileNotFoundError
            The folder does not exist.
        """
        from .report import report

        return report(self, path, title)

    def pictures(self) -> list[Picture]:
        """Pictures of the exact technique first, then of each technique's defaults and the Pareto front.

        Returns
        -------
        list of Picture
        """
        if not self._pictures and isinstance(self._source, HeightMap):
            self._pictures.extend(_planar_pictures(self._source, self._shown()))
        return list(self._pictures)

    def _shown(self) -> list[Row]:
        """Rows worth a picture, the exact technique not among them."""
        rows = self.select("all")
        front = {row["label"] for row in self.pareto()}
        seen: set[str] = set()
        shown = []
        for row in rows:
            if row["technique"] != "exact" and (row["technique"] not in seen or row["label"] in front):
                shown.append(row)
            seen.add(row["technique"])
        return shown

    def __repr__(self) -> str:
        count = len(self.select("all"))
        return f"<CompareResult of {count} settings ({self.kind}), timed on {self.timed_on}>"


def compare(
    source: HeightMap | Scene,
    techniques: str | Technique | Iterable[str | Technique] | None = None,
    *,
    elevations: Iterable[float] = ELEVATIONS,
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
        Which settings. None tries every technique with its defaults and, on a height map, a grid of
        step counts.
    elevations : iterable of float, default (90, 45, 20, 10, 5)
        View angles above the surface in degrees, in mesh units, above 0 to 90. The pixels of a scene
        are counted with the nearest of them.
    device : {"auto", "cpu", "gpu"}
        Whose time to take besides the CPU's. "auto" takes a Vulkan device if there is one. Scenes need
        one.
    rays : int, default 8192
        Rays at each elevation of a height map, at most 2**20.
    repeats : int, default 5
        Timed repeats, taken in turns over all settings; medians and quartiles are reported.
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
    relief and came up again before the reported hit. A *false hit* was reported more than 1 % of the
    relief above the surface and short of the true one.

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

        return compare_scene(source, chosen, angles, device, rounds, progress)
    if not isinstance(source, HeightMap):
        raise TypeError(f"compare takes a HeightMap or a Scene, got {type(source).__name__}")
    for technique in chosen:
        if not technique.marches:
            known = ", ".join(_techniques.marching())
            raise ValueError(f"technique {technique.name!r} finds no hit on a height map; these do: {known}")
    settings = [(technique.name, list(technique.parameters.items())) for technique in chosen]
    rows, problem = _bumpwgpu.compare_planar(
        source._field, settings, angles, count, rounds, start, device, progress
    )
    for row in rows:
        row["label"] = label(row["technique"], row["parameters"])
        row["elevation"] = "all" if row["elevation"] is None else row["elevation"]
    environment = {
        **machine(device != "cpu" and problem is None),
        "map": repr(source),
        "rays_per_elevation": count,
        "repeats": rounds,
        "seed": start,
    }
    if problem is not None:
        environment["device"] = f"none ({problem})"
    return CompareResult(rows, "planar", environment, source)


def _size(size: Any) -> tuple[int, int]:
    sides = tuple(size) if hasattr(size, "__len__") else (size, size)
    if len(sides) != 2:
        raise ValueError(f"size must be one number or (width, height), got {len(sides)} numbers")
    return whole("size[0]", sides[0], 1, 1 << 16), whole("size[1]", sides[1], 1, 1 << 16)


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


def machine(uses_device: bool) -> dict[str, Any]:
    """Device and versions, for every comparison to state."""
    from .system import info

    found = info()
    wanted = os.environ.get("BUMPWGPU_ADAPTER", "").lower()
    device = next((known for known in found["adapters"] if wanted in known["name"].lower()), None)
    stated = {"cpu": f"{_processor()}, {found['threads']} threads, {found['simd']}"}
    if uses_device and device is not None:
        driver = f"{device['driver']} {device['driver_info']}"
        stated["device"] = f"{device['name']} ({device['kind']}), driver {driver}"
    return {**stated, **{key: found[key] for key in ("version", "python", "numpy", "platform")}}


def _processor() -> str:
    """What the processor calls itself, where the system says."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:
            for line in lines:
                if line.startswith("model name"):
                    return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def _planar_pictures(height_map: HeightMap, rows: list[Row]) -> list[Picture]:
    view = _bumpwgpu.CompareView(height_map._field, *PICTURE_SIZE)
    made = [Picture("exact", *view.picture("exact", []))]
    for row in rows:
        rgb, error = view.picture(row["technique"], list(row["parameters"].items()))
        made.append(Picture(row["label"], rgb, error))
    return made
