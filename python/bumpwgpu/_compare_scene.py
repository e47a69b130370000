"""Comparing techniques on a rendered mesh: every pixel against the exact surface, and the pictures."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from . import techniques as _techniques
from ._quality import flip, psnr, ssim
from .compare_result import REGIONS, CompareResult, Picture, Progress, Row, label
from .errors import BumpWarning, CompareError
from .rendering import Frame, render
from .system import machine
from .techniques import Technique

if TYPE_CHECKING:
    from .compare_scene import Scene
    from .heightmap import HeightMap
    from .scene import Camera

__all__ = ["compare_scene", "verify_scene"]

#: The exact picture must agree with the reference in double precision to this many texels at p99;
#: measured on a quad, a cube and a torus: 0.002.
EXACT_TOLERANCE_TEXELS = 0.02
_AOVS = ("uv", "height", "mask", "normal", "shadow", "steps")
#: Shadow values, shares of the lights, that differ by more than this differ by a light.
_SHADOW_TOLERANCE = 0.01
_NORMAL_AOV_FLOOR = 1e-6


@dataclass(frozen=True)
class _View:
    """One camera: the exact picture, and which pixels of it show the mesh."""

    camera: Camera
    exact: Frame
    pixels: NDArray[np.bool_]


@dataclass(frozen=True)
class _Truth:
    """What the exact pictures and the reference say about the pixels of the mesh, camera by camera.

    `groups` is the index of a pixel's elevation times the number of regions, plus that of its region.
    """

    views: list[_View]
    reference: Any
    groups: NDArray[np.uint8]
    angles: list[float]

    @property
    def count(self) -> int:
        return len(self.groups)


def compare_scene(
    scene: Scene,
    chosen: list[Technique],
    angles: list[float],
    device: str,
    repeats: int,
    progress: Progress | None,
) -> CompareResult:
    """Compare techniques on a scene; see :func:`bumpwgpu.compare`."""
    if device == "cpu":
        raise ValueError("comparing a scene renders it, which needs a Vulkan device: device='auto' or 'gpu'")
    settings = chosen or [_techniques.get(name) for name in _techniques.names()]
    total = 1 + len(settings) * (1 + repeats)
    tell = _teller(progress, total)
    tell("exact surface")
    truth = _truth(scene, scene.cameras, angles)
    has_flip = _has_flip()
    rows: list[Row] = []
    exact = _techniques.get("exact")
    picture, check, _ = _measure(scene, exact, truth, False)
    pictures = [Picture("exact", *picture)]
    height_map = scene.height
    for technique in settings:
        tell(f"errors of {technique!r}")
        name = label(technique.name, technique.parameters)
        picture, metrics, by_angle = _measure(scene, technique, truth, has_flip)
        if technique != exact:
            pictures.append(Picture(name, *picture))
        start = {
            "technique": technique.name,
            "parameters": technique.parameters,
            "label": name,
            **_stored(technique, height_map),
        }
        rows += [{**start, "elevation": angle, **part} for angle, part in by_angle]
        rows.append({**start, "elevation": "all", **metrics})
    stated = machine(True)
    # A software device works on threads of this process, and other programs take its cores away for a while.
    software = "(software)" in stated.get("device", "")
    times: dict[str, list[float]] = {row["label"]: [] for row in rows}
    left_out: dict[str, None] = {}
    for turn in range(1, repeats + 1):
        # Every other time backwards: a machine that slows down is then fair to all.
        for technique in settings if turn % 2 else reversed(settings):
            tell(f"timing {technique!r}, round {turn} of {repeats}")
            spent = 0.0
            for camera in scene.cameras:
                before = time.process_time()
                frame = _shoot(scene, camera, technique)
                worked = 1e3 * (time.process_time() - before)
                spent += worked if software else frame.stats["draw_ms"]
                left_out.update(dict.fromkeys(frame.warnings))
            times[label(technique.name, technique.parameters)].append(spent)
    tell("done")
    rows = [{**row, **_times(times[row["label"]], truth.count, len(scene.cameras))} for row in rows]
    _check_exact(check)
    environment = {
        **stated,
        "map": repr(height_map),
        "mesh": [repr(part) for part in scene.mesh] if isinstance(scene.mesh, tuple) else repr(scene.mesh),
        "picture": f"{scene.size[0]} x {scene.size[1]}, {truth.count} pixels compared",
        "cameras": len(scene.cameras),
        "repeats": repeats,
        "exact picture against double precision": {
            key: check[key]
            for key in ("rays", "uv_error_p99_texels", "uv_error_max_texels", "miss_rate", "false_hit_rate")
        },
        "left out": list(left_out),
        "time": "drawing a frame, shading and shadows included, over the pixels compared"
        + ("; processor time, the host's part included, as the device is software" if software else ""),
    }
    return CompareResult(rows, "scene", environment, scene, pictures)


def verify_scene(scene: Scene, row: Row, angles: list[float], elevation: float | str) -> Row:
    """Metrics of a setting from cameras a little aside of those it was chosen by."""
    aside = [_turned(camera, degrees) for camera in scene.cameras for degrees in (-2.3, 1.7)]
    truth = _truth(scene, aside, angles)
    technique = type(_techniques.get(row["technique"]))(**row["parameters"])
    _, metrics, by_angle = _measure(scene, technique, truth, False)
    return metrics if elevation == "all" else dict(by_angle).get(float(elevation), metrics)


def _turned(camera: Camera, degrees: float) -> Camera:
    """The camera moved around its target, about the up direction and a quarter as much over it."""
    up = np.asarray(camera.up, np.float64) / np.linalg.norm(camera.up)
    arm = np.subtract(camera.eye, camera.target)
    side = np.cross(up, arm)
    side /= np.linalg.norm(side)
    turned = _rotated(_rotated(arm, up, degrees), side, 0.25 * degrees)
    x, y, z = (float(part) for part in np.add(camera.target, turned))
    return replace(camera, eye=(x, y, z))


def _rotated(vector: Any, axis: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    """Rodrigues' rotation."""
    turn = math.radians(degrees)
    along = axis * np.dot(axis, vector) * (1.0 - math.cos(turn))
    rotated: NDArray[np.float64] = (
        np.multiply(vector, math.cos(turn)) + np.cross(axis, vector) * math.sin(turn) + along
    )
    return rotated


def _stored(technique: Technique, height_map: HeightMap) -> Row:
    """What a scene's textures take: 32-bit floats."""
    plain = ("r32float", "r32float")
    if not technique.marches:
        return {"heights_format": plain[0], "cones_format": None, "memory_bytes": 4 * height_map.array.size}
    memory = _bumpwgpu.compare_memory(height_map._field, (technique.name, [], *plain))
    cones = plain[1] if "cone" in technique.name else None
    return {"heights_format": plain[0], "cones_format": cones, "memory_bytes": memory}


def _teller(progress: Progress | None, total: int) -> Callable[[str], None]:
    done = -1

    def tell(text: str) -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(min(done, total), total, text)

    return tell


def _has_flip() -> bool:
    try:
        import flip_evaluator  # noqa: F401
    except ImportError:
        warnings.warn(
            "flip_mean is left out: install NVIDIA's flip-evaluator with pip install 'bumpwgpu[compare]'",
            BumpWarning,
            stacklevel=4,
        )
        return False
    return True


def _shoot(scene: Scene, camera: Camera, technique: Technique, aovs: tuple[str, ...] = ()) -> Frame:
    # A comparison tries techniques on lights and materials that are not made for them; what each of
    # them leaves out is stated once, in the environment.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BumpWarning)
        return render(
            scene.mesh,
            scene.material,
            camera=camera,
            lights=scene.lights or None,
            technique=technique,
            size=scene.size,
            shadows=None if scene.shadows else False,
            aovs=aovs,
            skip=False,  # errors and times are those of the technique itself
        )


def _truth(scene: Scene, cameras: Sequence[Camera], angles: list[float]) -> _Truth:
    views, starts, deltas, elevations, edges, dark = [], [], [], [], [], []
    for camera in cameras:
        exact = _shoot(scene, camera, _techniques.get("exact"), (*_AOVS, "ray_start", "ray_delta"))
        start, delta = exact.aovs["ray_start"], exact.aovs["ray_delta"]
        mesh = exact.aovs["mask"] > 0.0
        pixels = mesh & (delta[:, :, 2] < 0.0)
        views.append(_View(camera, exact, pixels))
        starts.append(start[pixels])
        deltas.append(delta[pixels])
        elevations.append(_elevation(scene, camera, pixels))
        edges.append(_outline(mesh)[pixels])
        dark.append(exact.aovs["shadow"][pixels] > _SHADOW_TOLERANCE)
    if not any(view.pixels.any() for view in views):
        raise CompareError("no pixel shows the mesh from the front: nothing to compare; move the camera")
    reference = _bumpwgpu.SegmentReference(
        scene.height._field,
        np.ascontiguousarray(np.concatenate(starts)),
        np.ascontiguousarray(np.concatenate(deltas)),
    )
    seen = np.concatenate(elevations)
    angle = np.abs(seen[:, None] - np.array(angles)[None, :]).argmin(axis=1)
    region = np.where(np.concatenate(dark), REGIONS.index("shadow"), REGIONS.index("interior"))
    region[np.concatenate(edges) | reference.silhouettes()] = REGIONS.index("silhouette")
    return _Truth(views, reference, (angle * len(REGIONS) + region).astype(np.uint8), angles)


def _elevation(scene: Scene, camera: Camera, pixels: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Angles of the view rays above the smooth surface, degrees."""
    smooth = _shoot(scene, camera, _techniques.get("flat"), ("position", "normal"))
    view = np.asarray(camera.eye) - smooth.aovs["position"][pixels].astype(np.float64)
    normal = smooth.aovs["normal"][pixels].astype(np.float64)
    lengths = np.linalg.norm(view, axis=1) * np.linalg.norm(normal, axis=1)
    sine = np.abs((view * normal).sum(axis=1)) / np.maximum(lengths, _NORMAL_AOV_FLOOR)
    elevation: NDArray[np.float64] = np.degrees(np.arcsin(np.clip(sine, 0.0, 1.0)))
    return elevation


def _outline(mesh: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels of the mesh beside one that is none of it; the picture's border is no outline."""
    padded = np.pad(mesh, 1, mode="edge")
    inside = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return mesh & ~inside


Shown = tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.float32]]


def _measure(
    scene: Scene, technique: Technique, truth: _Truth, has_flip: bool
) -> tuple[Shown, Row, list[tuple[float, Row]]]:
    """The first picture with its errors and steps, the metrics of all pixels, those of each elevation."""
    frames = [_shoot(scene, view.camera, technique, _AOVS) for view in truth.views]

    def gather(name: str) -> NDArray[np.float32]:
        pairs = zip(truth.views, frames, strict=True)
        return np.concatenate([frame.aovs[name][view.pixels] for view, frame in pairs])

    uv, height = (np.ascontiguousarray(gather(name)) for name in ("uv", "height"))
    status = (gather("mask") <= 0.0).astype(np.uint8)
    parts = len(REGIONS)
    sets: list[list[int]] = []
    for at in range(len(truth.angles)):
        sets += [[at * parts + region] for region in range(parts)]
        sets.append([at * parts + region for region in range(parts)])
    for region in range(parts):
        sets.append([at * parts + region for at in range(len(truth.angles))])
    metrics, found, errors = truth.reference.measure(uv, height, status, truth.groups, sets)
    shadows = scene.shadows and technique.casts_shadows
    here = {name: gather(name) for name in ("normal", "shadow", "steps")}
    there = {
        name: np.concatenate([view.exact.aovs[name][view.pixels] for view in truth.views])
        for name in ("normal", "shadow")
    }
    _complete(metrics, here, there, np.ones(truth.count, bool), shadows)
    for part, chosen in zip(found, sets, strict=True):
        _complete(part, here, there, np.isin(truth.groups, chosen), shadows)
    metrics["regions"] = {
        name: part for name, part in zip(REGIONS, found[-parts:], strict=True) if part["rays"]
    }
    by_angle = []
    for at, angle in enumerate(truth.angles):
        *regions, total = found[at * (parts + 1) : (at + 1) * (parts + 1)]
        total["regions"] = {name: part for name, part in zip(REGIONS, regions, strict=True) if part["rays"]}
        if total["rays"]:
            by_angle.append((angle, total))
    metrics.update(_picture_metrics([view.exact for view in truth.views], frames, has_flip))
    pixels = truth.views[0].pixels
    texels = np.full(pixels.shape, np.nan, np.float32)
    texels[pixels] = errors[: int(pixels.sum())]
    steps = np.where(frames[0].aovs["mask"] > 0.0, frames[0].aovs["steps"], np.float32(np.nan))
    shown = (np.ascontiguousarray(frames[0].color[:, :, :3]), texels, steps.astype(np.float32))
    return shown, metrics, by_angle


def _complete(
    metrics: Row,
    here: dict[str, NDArray[np.float32]],
    there: dict[str, NDArray[np.float32]],
    chosen: NDArray[np.bool_],
    shadows: bool,
) -> None:
    """Adds what only pictures tell: normals, shadows and steps, against those of the exact picture."""
    if not chosen.any():
        return
    ours, theirs = here["normal"][chosen], there["normal"][chosen]
    both = (np.linalg.norm(ours, axis=1) > 0.5) & (np.linalg.norm(theirs, axis=1) > 0.5)
    if both.any():
        angle = _angle_deg(ours[both].astype(np.float64), theirs[both].astype(np.float64))
        metrics["normal_error_median_deg"] = float(np.median(angle))
        metrics["normal_error_p99_deg"] = float(np.quantile(angle, 0.99, method="inverted_cdf"))
    if shadows:
        difference = np.abs(here["shadow"][chosen] - there["shadow"][chosen])
        metrics["shadow_error_rate"] = float((difference > _SHADOW_TOLERANCE).mean())
    metrics["steps_mean"] = float(here["steps"][chosen].mean())


def _angle_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles between unit vectors, sharp for small ones too."""
    distance, total = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    angles: NDArray[np.float64] = np.degrees(2.0 * np.arctan2(distance, total))
    return angles


def _picture_metrics(exact: list[Frame], frames: list[Frame], has_flip: bool) -> dict[str, float | None]:
    """Means over the cameras; the decibels are those of the mean squared error."""
    pairs = [(right.color, here.color) for right, here in zip(exact, frames, strict=True)]
    decibels = [psnr(right, here) for right, here in pairs]
    noise = float(np.mean([10.0 ** (-0.1 * decibel) for decibel in decibels]))
    flips = None
    if has_flip:
        flips = [
            0.0 if math.isinf(decibel) else flip(right, here)[0]
            for decibel, (right, here) in zip(decibels, pairs, strict=True)
        ]
    return {
        "flip_mean": None if flips is None else float(np.mean(flips)),
        "psnr_db": None if noise == 0.0 else -10.0 * math.log10(noise),
        "ssim": float(np.mean([ssim(right, here) for right, here in pairs])),
    }


def _times(draw_ms: list[float], pixels: int, cameras: int) -> dict[str, Any]:
    low, median, high = np.percentile(draw_ms, (0, 50, 75)) * 1e6 / pixels
    return {
        "time_cpu_ns_per_ray": None,
        "time_cpu_ns_per_ray_low": None,
        "time_cpu_ns_per_ray_high": None,
        "time_device_ns_per_ray": float(median),
        "time_device_ns_per_ray_low": float(low),
        "time_device_ns_per_ray_high": float(high),
        "time_frame_ms": float(np.median(draw_ms)) / cameras,
        "device_difference_p99_texels": None,
        "device_difference_hit_rate": None,
    }


def _check_exact(metrics: Row) -> None:
    """The picture that the others are held against must itself be right."""
    error, missed = metrics["uv_error_p99_texels"], metrics["miss_rate"]
    if error > EXACT_TOLERANCE_TEXELS or missed > 0.0:
        warnings.warn(
            f"the exact picture is off the reference in double precision by {error:.3g} texels at p99 and "
            f"misses {100.0 * missed:.3g} % of pixels; expected at most {EXACT_TOLERANCE_TEXELS:g} and none",
            BumpWarning,
            stacklevel=4,
        )
