"""What a comparison found: rows, the Pareto front, recommendations, and files of them."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from . import techniques as _techniques
from ._atomic import replace_file
from ._checks import choice, flag, number, whole
from ._csv import csv_bytes
from .compare_scene import Scene
from .heightmap import HeightMap
from .recommending import LEAST_CHECKED, MipAdvice, Recommendation, recommend, recommend_by_mip

__all__ = [
    "FORMATS",
    "MAX_FAILURE_RATE",
    "REGIONS",
    "CompareResult",
    "Picture",
    "Progress",
    "Row",
    "advice_dict",
    "label",
]

Progress: TypeAlias = Callable[[int, int, str], object]
Row: TypeAlias = "dict[str, Any]"
Region: TypeAlias = Literal["interior", "silhouette", "shadow"]

#: Texture formats that height maps and cone maps may be stored in.
FORMATS = ("r32float", "r16float", "r16unorm", "r8unorm")
#: Parts of a relief that errors are split by.
REGIONS: tuple[Region, ...] = ("interior", "silhouette", "shadow")
#: A technique that gets more than this share of rays wrong altogether is neither recommended nor on
#: the Pareto front.
MAX_FAILURE_RATE = 1e-3
#: Columns and rows of the pictures of a height map in a report.
PICTURE_SIZE = (480, 300)


@dataclass(frozen=True)
class Picture:
    """A picture a technique made.

    Attributes
    ----------
    label : str
        The setting.
    rgb : (H, W, 3) uint8
        sRGB.
    error_texels : (H, W) float32
        Distance of the hit from the exact one, NaN without a hit.
    steps : (H, W) float32
        Height reads of the view ray; NaN where there is no mesh.
    """

    label: str
    rgb: NDArray[np.uint8]
    error_texels: NDArray[np.float32]
    steps: NDArray[np.float32]


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

        ``technique``, ``parameters``, ``label``, ``elevation``, ``rays``; ``heights_format``,
        ``cones_format`` (None where none are read), ``memory_bytes`` (texture that it reads);
        ``time_cpu_ns_per_ray`` and ``time_device_ns_per_ray`` (median, with ``_low``, the least, and
        ``_high``, the upper quartile; CPU on one core; None where not measured);
        ``uv_error_median_texels``, ``uv_error_p99_texels``, ``uv_error_p99_bound_texels`` (what the 99th
        percentile of all such rays does not exceed, with 95 % confidence; None for under 299 rays),
        ``uv_error_max_texels``, ``share_above_1_texel``; ``depth_error_p99``, ``depth_error_max``
        (heights 0..1); ``normal_error_median_deg``, ``normal_error_p99_deg``;
        ``miss_rate`` (first hit skipped), ``false_hit_rate`` (hit reported in the air),
        ``unconverged_rate``, ``nan_count``, ``failure_rate`` (all of these), ``failure_rate_bound`` (with
        95 % confidence);
        ``shadow_error_rate`` (None for techniques without shadows); ``steps_mean``;
        ``device_difference_p99_texels``, ``device_difference_hit_rate`` (device against CPU);
        ``regions``: the errors again for "interior", "silhouette" (beside an edge that hides relief, or
        of the mesh) and "shadow" (not lit), where there are such rays.

        For scenes a ray is a pixel, the time is that of the whole frame over the pixels of the mesh,
        and the "all" rows also have ``flip_mean``, ``psnr_db``, ``ssim`` of the picture against the
        exact one (``psnr_db`` is None for equal pictures).
    kind : {"planar", "scene"}
        What was compared.
    environment : dict
        Device, driver, versions, settings.
    dropped : list of dict
        Settings that the adaptive sweep left out after a first look, because another one was faster
        *and* more accurate by far: ``label``, ``time_ns_per_ray``, ``uv_error_p99_texels``,
        ``failure_rate`` of that look.
    """

    rows: list[Row]
    kind: Literal["planar", "scene"]
    environment: dict[str, Any]
    _source: HeightMap | Scene = field(repr=False)
    _pictures: list[Picture] = field(default_factory=list, repr=False)
    dropped: list[Row] = field(default_factory=list)
    _checked: dict[Any, Row] = field(default_factory=dict, repr=False)

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
            Rows by rising time, each with ``tied_with``: labels of settings whose time cannot be told from
            its own (ranges meet, or medians or least times are within 25 %) and that are on the front
            too or would be, were the tie broken in their favour; ``rivals``: those of them that are no less
            accurate, so that they may take its place on another machine (one of it and its rivals is on the
            front however ties are broken); and ``certain``: whether it has no rival.

        Raises
        ------
        ValueError
            No such elevation, or no such time was measured.
        """
        rows, measured = self._measured(elevation, time)
        allowed = number("max_failure_rate", max_failure_rate, 0.0, 1.0)
        front = _bumpwgpu.compare_front(measured, allowed)

        def labels(some: list[int]) -> list[str]:
            return [rows[at]["label"] for at in some]

        return [
            {**rows[at], "tied_with": labels(tied), "rivals": labels(rivals), "certain": not rivals}
            for at, tied, rivals in front
        ]

    def recommend(
        self,
        max_error: float = 0.5,
        *,
        max_time: float | None = None,
        memory: int | None = None,
        max_failure_rate: float = MAX_FAILURE_RATE,
        elevation: float | str = "all",
        time: Literal["cpu", "device"] | None = None,
        among: Iterable[str] | None = None,
        verify: bool = True,
    ) -> Recommendation:
        """The cheapest setting within a budget, checked on rays that it was not chosen by.

        Parameters
        ----------
        max_error : float, default 0.5
            Largest 99th percentile of the hit-uv error, texels.
        max_time : float or None
            Longest time, nanoseconds a ray.
        memory : int or None
            Most texture that it may read, bytes.
        max_failure_rate : float, default 0.001
            Largest share of rays without a right hit.
        elevation : float or "all"
            Which rows count.
        time : {"cpu", "device"} or None
            Whose time counts; None for the device's where there is one.
        among : iterable of str or None
            Techniques that may be chosen, such as ``bumpwgpu.engines.BUILT_IN["bevy"]``; None for all.
        verify : bool, default True
            Measure the pick again: on other rays and at angles between, or from cameras a little aside.
            One whose error could exceed the budget there is passed over for the next.

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
        budget = (
            number("max_error", max_error, 0.0),
            number("max_failure_rate", max_failure_rate, 0.0, 1.0),
            float("inf") if max_time is None else number("max_time", max_time, 0.0),
            float("inf") if memory is None else number("memory", memory, 0.0),
        )
        flag("verify", verify)
        if among is not None:
            names = {_techniques.get(name).name for name in ([among] if isinstance(among, str) else among)}
            chosen = [at for at, row in enumerate(rows) if row["technique"] in names]
            rows, measured = [rows[at] for at in chosen], [measured[at] for at in chosen]
        return recommend(self, rows, measured, budget, elevation, verify)

    def recommend_by_mip(
        self,
        max_error: float = 0.5,
        *,
        levels: int = 4,
        progress: Progress | None = None,
        **options: Any,
    ) -> list[MipAdvice]:
        """What to use at a distance, where smaller mip levels of the height map are read.

        Each level is compared like a map of its own, against its own exact surface; settings are those
        of this comparison.

        Parameters
        ----------
        max_error : float, default 0.5
            Largest 99th percentile of the hit-uv error, in texels of the level.
        levels : int, default 4
            How many levels, 1 to 16; fewer where the map ends before.
        progress : callable or None
            Called as ``progress(done, total, text)``.
        **options
            What else :meth:`recommend` takes.

        Returns
        -------
        list of MipAdvice
            Level 0 first; ``advice.distance(fov_y, pixels)`` says from how far away it counts.

        Raises
        ------
        ValueError
            A scene was compared, or what :meth:`recommend` raises.
        """
        count = whole("levels", levels, 1, 16)
        return recommend_by_mip(self, max_error, count, progress, options)

    def exceeding(self, max_error: float, *, max_failure_rate: float = MAX_FAILURE_RATE) -> list[Row]:
        """The rows over all elevations that exceed a limit: what a check in CI fails on.

        Parameters
        ----------
        max_error : float
            Largest 99th percentile of the hit-uv error, texels.
        max_failure_rate : float, default 0.001
            Largest share of rays without a right hit.

        Returns
        -------
        list of dict

        Raises
        ------
        ValueError, TypeError
            A limit out of range or of the wrong kind.
        """
        limit = number("max_error", max_error, 0.0)
        allowed = number("max_failure_rate", max_failure_rate, 0.0, 1.0)
        return [
            row
            for row in self.select("all")
            if not (row["uv_error_p99_texels"] <= limit and row["failure_rate"] <= allowed)
        ]

    def _height_map(self) -> HeightMap | None:
        return self._source if isinstance(self._source, HeightMap) else self._source.height

    def _verified(self, row: Row, elevation: float | str) -> Row:
        """Metrics of a setting on rays that it was not chosen by."""
        key = (row["label"], elevation)
        if key not in self._checked:
            angles = [known for known in self.elevations if known != "all"]
            if isinstance(self._source, Scene):
                from ._compare_scene import verify_scene

                self._checked[key] = verify_scene(self._source, row, angles, elevation)
            else:
                self._checked[key] = _verify_planar(self, self._source, row, angles, elevation)
        return self._checked[key]

    def _measured(self, elevation: float | str, time: str | None) -> tuple[list[Row], list[Any]]:
        """Rows of one elevation, and what the ranking needs of each."""
        rows = self.select(elevation)
        clock = self.timed_on if time is None else choice("time", time, ("cpu", "device"))
        keys = [f"time_{clock}_ns_per_ray{end}" for end in ("_low", "", "_high")]
        if any(row[key] is None for row in rows for key in keys):
            other = "cpu" if clock == "device" else "device"
            raise ValueError(f"no {clock} time was measured; use time={other!r}")
        return rows, [
            (
                row["label"],
                [row[key] for key in keys],
                row["uv_error_p99_texels"],
                row["failure_rate"],
                float(row["memory_bytes"]),
            )
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
        front = self.pareto()
        data = {
            "kind": self.kind,
            "environment": self.environment,
            "timed_on": self.timed_on,
            "rows": self.rows,
            "dropped": self.dropped,
            "pareto": [row["label"] for row in front],
            "certain": [row["label"] for row in front if row["certain"]],
            "ties": {row["label"]: row["tied_with"] for row in front if row["tied_with"]},
            "rivals": {row["label"]: row["rivals"] for row in front if row["rivals"]},
            "recommendation": advice_dict(advice),
        }
        text = json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False)
        return replace_file(path, text.encode())

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write all rows as CSV: one column for each figure, those of regions with the region in front.

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
        return replace_file(path, csv_bytes([_flat(row) for row in self.rows]))

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
            plain = row["heights_format"] == FORMATS[0] and row["cones_format"] in (None, FORMATS[0])
            if not plain or row["technique"] == "exact":
                continue
            if row["technique"] not in seen or row["label"] in front:
                shown.append(row)
            seen.add(row["technique"])
        return shown

    def __repr__(self) -> str:
        count = len(self.select("all"))
        return f"<CompareResult of {count} settings ({self.kind}), timed on {self.timed_on}>"


def _verify_planar(
    result: CompareResult, source: HeightMap, row: Row, angles: list[float], elevation: float | str
) -> Row:
    """Metrics on other rays, and at the angles between those that were measured."""
    if elevation != "all":
        angles = [float(elevation)]
    between = [0.5 * (high + low) for high, low in itertools.pairwise(sorted(angles, reverse=True))]
    checked = sorted({*angles, *between}, reverse=True)
    count = max(result.environment["rays_per_elevation"], -(-LEAST_CHECKED // len(checked)))
    setting = (
        row["technique"],
        [(name, float(value)) for name, value in row["parameters"].items()],
        row["heights_format"],
        row["cones_format"] or FORMATS[0],
    )
    seed = (result.environment["seed"] + 0x5EED) % (1 << 64)
    return _bumpwgpu.compare_verify(source._field, setting, checked, min(count, 1 << 20), seed)


def advice_dict(advice: Recommendation) -> dict[str, Any]:
    """A recommendation as JSON holds it."""
    return {
        "technique": advice.technique,
        "parameters": advice.parameters,
        "heights_format": advice.heights_format,
        "cones_format": advice.cones_format,
        "error_p99_texels": advice.error_p99_texels,
        "bound_p99_texels": advice.bound_p99_texels,
        "bound_failure_rate": advice.bound_failure_rate,
        "verified_rays": advice.verified_rays,
        "time_ns_per_ray": advice.time_ns_per_ray,
        "memory_bytes": advice.memory_bytes,
        "reason": advice.reason,
    }


def _flat(row: Row) -> Row:
    flat = {name: value for name, value in row.items() if name not in ("regions", "parameters")}
    flat["parameters"] = " ".join(f"{name}={value}" for name, value in row["parameters"].items())
    for region, part in row["regions"].items():
        flat.update({f"{region}_{name}": value for name, value in part.items()})
    return flat


def _planar_pictures(height_map: HeightMap, rows: list[Row]) -> list[Picture]:
    view = _bumpwgpu.CompareView(height_map._field, *PICTURE_SIZE)
    made = [Picture("exact", *view.picture("exact", []))]
    for row in rows:
        made.append(Picture(row["label"], *view.picture(row["technique"], list(row["parameters"].items()))))
    return made
