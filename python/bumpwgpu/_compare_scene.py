"""Comparing techniques on a rendered mesh: every pixel against the exact surface, and the pictures."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _bumpwgpu
from . import techniques as _techniques
from ._quality import flip, psnr, ssim
from .errors import BumpWarning, CompareError
from .rendering import Frame, render
from .techniques import Technique

if TYPE_CHECKING:
    from .compare import CompareResult, Progress, Row, Scene

__all__ = ["compare_scene"]

#: The exact picture must agree with the reference in double precision to this many texels at p99;
#: measured on a quad, a cube and a torus: 0.002.
EXACT_TOLERANCE_TEXELS = 0.02
_AOVS = ("uv", "height", "mask", "normal", "shadow", "steps")
#: Shadow values, shares of the lights, that differ by more than this differ by a light.
_SHADOW_TOLERANCE = 0.01
_NORMAL_AOV_FLOOR = 1e-6


@dataclass(frozen=True)
class _Truth:
    """What the exact picture and the reference say about the pixels of the mesh."""

    exact: Frame
    pixels: NDArray[np.bool_]
    reference: Any
    groups: NDArray[np.uint8]
    angles: list[float]


def compare_scene(
    scene: Scene,
    chosen: list[Technique],
    angles: list[float],
    device: str,
    repeats: int,
    progress: Progress | None,
) -> CompareResult:
    """Compare techniques on a scene; see :func:`bumpwgpu.compare`."""
    from .compare import CompareResult, Picture, label, machine

    if device == "cpu":
        raise ValueError("comparing a scene renders it, which needs a Vulkan device: device='auto' or 'gpu'")
    settings = chosen or [_techniques.get(name) for name in _techniques.names()]
    total = 1 + len(settings) * (1 + repeats)
    tell = _teller(progress, total)
    tell("exact surface")
    truth = _truth(scene, angles)
    has_flip = _has_flip()
    rows: list[Row] = []
    exact = _techniques.get("exact")
    picture, check, _ = _measure(scene, exact, truth, False)
    pictures = [Picture("exact", *picture)]
    for technique in settings:
        tell(f"errors of {technique!r}")
        name = label(technique.name, technique.parameters)
        picture, metrics, by_angle = _measure(scene, technique, truth, has_flip)
        if technique != exact:
            pictures.append(Picture(name, *picture))
        start = {"technique": technique.name, "parameters": technique.parameters, "label": name}
        rows += [{**start, "elevation": angle, **part} for angle, part in by_angle]
        rows.append({**start, "elevation": "all", **metrics})
    times: dict[str, list[float]] = {row["label"]: [] for row in rows}
    left_out: dict[str, None] = {}
    for turn in range(1, repeats + 1):
        for technique in settings:
            tell(f"timing {technique!r}, round {turn} of {repeats}")
            frame = _shoot(scene, technique)
            times[label(technique.name, technique.parameters)].append(frame.stats["draw_ms"])
            left_out.update(dict.fromkeys(frame.warnings))
    tell("done")
    count = int(truth.pixels.sum())
    rows = [{**row, **_times(times[row["label"]], count)} for row in rows]
    _check_exact(check)
    environment = {
        **machine(True),
        "map": repr(scene.material.height),
        "mesh": repr(scene.mesh),
        "picture": f"{scene.size[0]} x {scene.size[1]}, {count} pixels compared",
        "repeats": repeats,
        "exact picture against double precision": {
            key: check[key]
            for key in ("rays", "uv_error_p99_texels", "uv_error_max_texels", "miss_rate", "false_hit_rate")
        },
        "left out": list(left_out),
        "time": "drawing a frame, shading and shadows included, over the pixels compared",
    }
    return CompareResult(rows, "scene", environment, scene, pictures)


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


def _shoot(scene: Scene, technique: Technique, aovs: tuple[str, ...] = ()) -> Frame:
    # A comparison tries techniques on lights and materials that are not made for them; what each of
    # them leaves out is stated once, in the environment.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BumpWarning)
        return render(
            scene.mesh,
            scene.material,
            camera=scene.camera,
            lights=scene.lights or None,
            technique=technique,
            size=scene.size,
            shadows=None if scene.shadows else False,
            aovs=aovs,
        )


def _truth(scene: Scene, angles: list[float]) -> _Truth:
    assert scene.material.height is not None
    exact = _shoot(scene, _techniques.get("exact"), (*_AOVS, "ray_start", "ray_delta"))
    start, delta = exact.aovs["ray_start"], exact.aovs["ray_delta"]
    pixels = (exact.aovs["mask"] > 0.0) & (delta[:, :, 2] < 0.0)
    if not pixels.any():
        raise CompareError("no pixel shows the mesh from the front: nothing to compare; move the camera")
    reference = _bumpwgpu.SegmentReference(
        scene.material.height._field, np.ascontiguousarray(start[pixels]), np.ascontiguousarray(delta[pixels])
    )
    smooth = _shoot(scene, _techniques.get("flat"), ("position", "normal"))
    view = np.asarray(scene.camera.eye) - smooth.aovs["position"][pixels].astype(np.float64)
    normal = smooth.aovs["normal"][pixels].astype(np.float64)
    lengths = np.linalg.norm(view, axis=1) * np.linalg.norm(normal, axis=1)
    sine = np.abs((view * normal).sum(axis=1)) / np.maximum(lengths, _NORMAL_AOV_FLOOR)
    elevation = np.degrees(np.arcsin(np.clip(sine, 0.0, 1.0)))
    groups = np.abs(elevation[:, None] - np.array(angles)[None, :]).argmin(axis=1).astype(np.uint8)
    return _Truth(exact, pixels, reference, groups, angles)


Shown = tuple[NDArray[np.uint8], NDArray[np.float32]]


def _measure(
    scene: Scene, technique: Technique, truth: _Truth, has_flip: bool
) -> tuple[Shown, Row, list[tuple[float, Row]]]:
    """The picture with its errors, the metrics of all pixels, and those of each elevation."""
    frame = _shoot(scene, technique, _AOVS)
    pixels, aovs = truth.pixels, frame.aovs
    status = (aovs["mask"][pixels] <= 0.0).astype(np.uint8)
    metrics, by_group, errors = truth.reference.measure(
        np.ascontiguousarray(aovs["uv"][pixels]),
        np.ascontiguousarray(aovs["height"][pixels]),
        status,
        truth.groups,
        len(truth.angles),
    )
    shadows = scene.shadows and technique.casts_shadows
    everything = np.ones(len(errors), bool)
    _complete(metrics, frame, truth, everything, shadows)
    metrics.update(_picture_metrics(truth.exact, frame, has_flip))
    by_angle = []
    for at, (angle, part) in enumerate(zip(truth.angles, by_group, strict=True)):
        chosen = truth.groups == at
        if chosen.any():
            _complete(part, frame, truth, chosen, shadows)
            by_angle.append((angle, part))
    texels = np.full(pixels.shape, np.nan, np.float32)
    texels[pixels] = errors
    return (np.ascontiguousarray(frame.color[:, :, :3]), texels), metrics, by_angle


def _complete(metrics: Row, frame: Frame, truth: _Truth, chosen: NDArray[np.bool_], shadows: bool) -> None:
    """Adds what only pictures tell: normals, shadows and steps, against those of the exact picture."""
    pixels = truth.pixels
    here, there = frame.aovs["normal"][pixels][chosen], truth.exact.aovs["normal"][pixels][chosen]
    both = (np.linalg.norm(here, axis=1) > 0.5) & (np.linalg.norm(there, axis=1) > 0.5)
    if both.any():
        angle = _angle_deg(here[both].astype(np.float64), there[both].astype(np.float64))
        metrics["normal_error_median_deg"] = float(np.median(angle))
        metrics["normal_error_p99_deg"] = float(np.quantile(angle, 0.99, method="inverted_cdf"))
    if shadows:
        difference = np.abs(frame.aovs["shadow"][pixels][chosen] - truth.exact.aovs["shadow"][pixels][chosen])
        metrics["shadow_error_rate"] = float((difference > _SHADOW_TOLERANCE).mean())
    metrics["steps_mean"] = float(frame.aovs["steps"][pixels][chosen].mean())


def _angle_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles between unit vectors, sharp for small ones too."""
    distance, total = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    angles: NDArray[np.float64] = np.degrees(2.0 * np.arctan2(distance, total))
    return angles


def _picture_metrics(exact: Frame, frame: Frame, has_flip: bool) -> dict[str, float | None]:
    decibel = psnr(exact.color, frame.color)
    equal = math.isinf(decibel)
    return {
        "flip_mean": None if not has_flip else 0.0 if equal else flip(exact.color, frame.color)[0],
        "psnr_db": None if equal else decibel,
        "ssim": ssim(exact.color, frame.color),
    }


def _times(draw_ms: list[float], pixels: int) -> dict[str, Any]:
    low, median, high = np.percentile(draw_ms, (25, 50, 75)) * 1e6 / pixels
    return {
        "time_cpu_ns_per_ray": None,
        "time_cpu_ns_per_ray_low": None,
        "time_cpu_ns_per_ray_high": None,
        "time_device_ns_per_ray": float(median),
        "time_device_ns_per_ray_low": float(low),
        "time_device_ns_per_ray_high": float(high),
        "time_frame_ms": float(np.median(draw_ms)),
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
