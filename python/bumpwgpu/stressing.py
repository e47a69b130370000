"""The stability suite: every search and bake where numbers get hard, and how far off each is there."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from . import _bumpwgpu
from . import techniques as _techniques
from ._atomic import replace_file
from ._checks import choice, whole
from ._csv import csv_bytes
from ._map_info import MAPS
from ._stress_bake import bake_checks
from ._stress_cases import RayCase, hard_maps, ray_cases, shadow_cases
from ._stress_frames import frame_cases, frame_checks
from ._stress_march import GUARANTEED, march_checks
from ._stress_pictures import picture_checks
from ._stress_shadows import shadow_checks
from .baking import bake as bake_maps
from .frames import TANGENT_METHODS
from .frames import tangents as find_tangents
from .marching import march as march_rays
from .rendering import render as render_picture
from .system import machine
from .techniques import Technique

__all__ = ["StressResult", "stress"]

Row = dict[str, Any]
Progress = Callable[[int, int, str], object]


@dataclass(frozen=True)
class StressResult:
    """What held and what did not. True in a condition when everything passed.

    Attributes
    ----------
    rows : list of dict
        One for each subject, case and check: ``subject`` ("march exact", "march exact, device", "picture
        exact", "bake cone", "frames mikktspace"), ``group`` and ``case``, ``check``, ``worst`` value with its
        ``unit`` and ``limit`` (inf: reported, not judged), ``passed``, and ``where``; for rays seen at an
        angle or far away ``at``, degrees from the normal or tiles.
    environment : dict
        Device, versions, settings.
    """

    rows: list[Row]
    environment: dict[str, Any]

    @property
    def failures(self) -> list[Row]:
        """The rows that did not pass."""
        return [row for row in self.rows if not row["passed"]]

    def __bool__(self) -> bool:
        return not self.failures

    def summary(self) -> list[Row]:
        """The worst row of each subject, group and check, those that failed first.

        Returns
        -------
        list of dict
            With ``cases`` and ``failed``: how many there were, and how many of them failed.
        """
        kept: dict[tuple[str, str, str], Row] = {}
        for row in self.rows:
            key = (row["subject"], row["group"], row["check"])
            best = kept.setdefault(key, {**row, "cases": 0, "failed": 0})
            counts = {"cases": best["cases"] + 1, "failed": best["failed"] + (not row["passed"])}
            worse = (not row["passed"], _severity(row)) > (not best["passed"], _severity(best))
            kept[key] = {**(row if worse else best), **counts}
        return sorted(kept.values(), key=lambda row: bool(row["passed"]))

    def __str__(self) -> str:
        lines = [
            f"{'pass' if row['passed'] else 'FAIL'}  {row['subject']:<24} {row['group']:<12} "
            f"{row['check']:<22} {row['worst']:.3g} {row['unit']}"
            + ("" if row["passed"] else f", limit {row['limit']:.3g}; {row['case']}: {row['where']}")
            for row in self.summary()
        ]
        verdict = f"{len(self.rows)} checks, {len(self.failures)} failed"
        return "\n".join([*lines, verdict])

    def to_json(self, path: str | os.PathLike[str]) -> Path:
        """Write all rows and the environment as JSON; an infinite limit or value is null.

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
        data = {"environment": self.environment, "rows": [_finite(row) for row in self.rows]}
        return replace_file(path, json.dumps(data, indent=1, allow_nan=False).encode())

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write all rows as CSV.

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
        return replace_file(path, csv_bytes(self.rows))

    def plot(self, path: str | os.PathLike[str]) -> Path:
        """Plot the searches' error against the view angle and against the distance from the origin.

        Needs matplotlib.

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
            It does not write files with this suffix, or no search was tested.
        FileNotFoundError
            The folder does not exist.
        """
        from ._stress_plot import plot

        return plot(self, path)


def stress(
    techniques: str | Technique | Iterable[str | Technique] | None = None,
    *,
    maps: str | Iterable[str] | None = None,
    frames: str | Iterable[str] | None = None,
    march: Callable[..., Any] | None = None,
    bake: Callable[..., Any] | None = None,
    tangents: Callable[..., Any] | None = None,
    only: str | None = None,
    device: Literal["all", "cpu", "gpu"] = "all",
    rays: int = 128,
    seed: int = 0,
    progress: Progress | None = None,
) -> StressResult:
    """Try searches, bakes and tangent frames on what breaks them.

    Searches: views to 89.99 degrees from the normal, rays to a million tiles from the origin, scales of
    1e-6 to 1e6, rays along cell borders and through corners, directions of 1e-18 to 1e18, single-precision
    against double-precision input; on flat, spiked, checkered, denormal, extreme and 1 x N maps, in every
    wrap. Those that promise the first hit are judged by a plain walk through all cells in double
    precision that shares no code with them, also from points of the surface up to a light; those that read
    heights alone by their recipes, followed in double precision; all of them by what must not change: shifts
    by whole tiles, mirror images, longer directions. On a device the same, and pictures of a relief: what
    pixels show, its normals, and what lies in shadow. Bakes: the same maps at three scales, against formulas
    and brute force in double precision. Frames: degenerate, mirrored, needle-shaped, tiny and huge charts.

    Parameters
    ----------
    techniques : name, Technique, or several; None
        Searches to try; None for all, an empty list for none.
    maps : str or iterable of str, or None
        Maps to bake; None for all, an empty list for none.
    frames : str or iterable of str, or None
        Methods of :func:`bumpwgpu.tangents`; None for all, an empty list for none.
    march : callable or None
        Tested in place of :func:`bumpwgpu.march`, with the same arguments: an implementation of one's
        own. It returns an object with ``t``, ``uv``, ``z``, ``normal`` and ``status``. Rays of group "shadow"
        come with ``from_surface=True``.
    bake : callable or None
        Tested in place of :func:`bumpwgpu.bake`: ``bake(height_map, (name,), **options)[name]``.
    tangents : callable or None
        Tested in place of :func:`bumpwgpu.tangents`.
    only : str or None
        Only cases whose group or name contains this text, such as "grazing" or "checkerboard".
    device : {"all", "cpu", "gpu"}
        Where searches run: everywhere, so on the device too if one answers; or in one place. The device takes
        rays in single precision, so those of double precision are left out there. With `march`, "all" is the
        CPU alone, and no pictures are drawn.
    rays : int, default 128
        Rays of a case, 8 to 65536.
    seed : int, default 0
        Fixes rays and maps.
    progress : callable or None
        Called as ``progress(done, total, text)``; an exception from it stops the suite.

    Returns
    -------
    StressResult

    Raises
    ------
    ValueError, TypeError
        Unknown names, settings out of range or of the wrong kind.

    Notes
    -----
    "on the surface" is a backward error: the height of a hit over the surface in units of what rounding
    the ray and ``t`` to 32 bits does to it, which stays small however badly a grazing hit is conditioned.
    "error" is the distance from the true hit in texels, reported and not judged.

    Examples
    --------
    >>> import bumpwgpu as bw
    >>> bool(bw.stress("exact", maps=["normal"], frames=[], rays=16))
    True
    """
    choice("device", device, ("all", "cpu", "gpu"))
    count = whole("rays", rays, 8, 1 << 16)
    start = whole("seed", seed, 0, 1 << 32)
    for name, given in (("march", march), ("bake", bake), ("tangents", tangents), ("progress", progress)):
        if given is not None and not callable(given):
            raise TypeError(f"{name} must be callable, got {type(given).__name__}")
    searches = [_techniques.get(part) for part in _several(techniques, _techniques.marching(), "techniques")]
    for technique in searches:
        if not technique.marches:
            raise ValueError(f"technique {technique.name!r} does not search")
    wanted = [choice("maps", name, tuple(MAPS)) for name in _several(maps, tuple(MAPS), "maps")]
    methods = [
        choice("frames", name, tuple(TANGENT_METHODS))
        for name in _several(frames, tuple(TANGENT_METHODS), "frames")
    ]
    if only is not None and not isinstance(only, str):
        raise TypeError(f"only must be a string, got {type(only).__name__}")

    def asked(*names: str) -> bool:
        return only is None or any(only in name for name in names)

    answers = device == "gpu" or (device == "all" and march is None and bool(_bumpwgpu.adapters()))
    places: list[tuple[Literal["cpu", "gpu"], RayCase]] = []
    for case in (*ray_cases(start, count), *shadow_cases(start, count)) if searches else ():
        if asked(case.group, case.name):
            if device != "gpu":
                places.append(("cpu", case))
            if answers and case.dtype is np.float32 and case.group != "shadow":
                places.append(("gpu", case))
    drawn = searches if answers and march is None and asked("picture") else []
    meshes = {name: mesh for name, mesh in frame_cases(start).items() if asked("mesh", name)}
    hard = {name: heights for name, heights in hard_maps(start).items() if asked("map", name)}
    if not (places or drawn or (wanted and hard) or (methods and meshes)) and only is not None:
        raise ValueError(f"no case contains {only!r}")
    total = len(places) + len(drawn) + len(hard) * len(wanted) + len(methods)
    done = 0
    rows: list[Row] = []

    def tell(text: str) -> None:
        nonlocal done
        if progress is not None:
            progress(done, total, text)
        done += 1

    for place, case in places:
        there = ", device" if place == "gpu" else ""
        tell(f"march{there}: {case.group}, {case.name}")
        for technique in searches:
            begin = {"subject": f"march {technique.name}{there}", "group": case.group, "case": case.name}
            if case.group in ("shadow", "bundles") and technique.name not in GUARANTEED:
                continue
            if case.group == "shadow":
                checks = shadow_checks(march or march_rays, technique, case)
            else:
                checks = march_checks(march or march_rays, technique, case, place)
            rows.extend({**begin, **check, "at": case.at} for check in checks)
    for technique in drawn:
        tell(f"picture: {technique.name}")
        begin = {"subject": f"picture {technique.name}", "group": "picture"}
        for label, check in picture_checks(render_picture, technique, start):
            rows.append({**begin, "case": label, **check, "at": None})
    for map_name in wanted:
        for case_name, heights in hard.items():
            tell(f"bake {map_name}: {case_name}")
            for label, check in bake_checks(bake or bake_maps, map_name, heights, case_name):
                begin = {"subject": f"bake {map_name}", "group": "map", "case": label}
                rows.append({**begin, **check, "at": None})
    for method in methods:
        tell(f"frames: {method}")
        for case_name, mesh in meshes.items():
            begin = {"subject": f"frames {method}", "group": "mesh", "case": case_name}
            for check in frame_checks(tangents or find_tangents, method, case_name, mesh):
                rows.append({**begin, **check, "at": None})
    if progress is not None:
        progress(total, total, "done")
    environment = {
        **machine(answers),
        "rays_per_case": count,
        "seed": start,
        "promise the first hit": list(GUARANTEED),
    }
    return StressResult(rows, environment)


def _several(given: Any, everything: tuple[str, ...], name: str) -> list[Any]:
    if given is None:
        return list(everything)
    if isinstance(given, str | Technique):
        return [given]
    try:
        return list(given)
    except TypeError:
        raise TypeError(f"{name} must be a name or several, got {type(given).__name__}") from None


def _severity(row: Row) -> float:
    limit = row["limit"]
    if limit in (0.0, math.inf):
        return float(row["worst"])
    return float(row["worst"] / limit)


def _finite(row: Row) -> Row:
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in row.items()
    }
