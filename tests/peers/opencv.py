"""Normal maps against OpenCV and against the usual NumPy lines, on the same 4096 x 4096 heights.

float32 heights in, 8-bit RGB out, two threads, in turns and best of several; beside the time that passed,
the processor's time, which other work on the machine disturbs less. Edges are clamped in all of them. The
results are compared first: codes may differ by one where a rounding falls the other way.

* ours: `bw.bake(height_map, dtype="uint8")`, and the same from a bare array, which is checked and
  copied first;
* OpenCV: two Sobel filters, then the normal from whole-image operations, the faster of two ways;
* NumPy: `np.gradient` (central differences), `np.dstack`, a norm, and a cast;
* copying the heights, as a yardstick.
"""

# requires: numpy opencv-python-headless

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("RAYON_NUM_THREADS", "2")

import cv2
import numpy as np

import bumpwgpu as bw

SCALE = 0.02


def rough(side: int) -> Any:
    """A few octaves of waves and some noise: slopes of all sizes."""
    y, x = np.mgrid[0:side, 0:side].astype(np.float32) * np.float32(2 * np.pi / side)
    heights = sum(np.sin(k * x + k) * np.cos((k + 3) * y) / k for k in (5, 23, 111))
    heights += np.random.default_rng(1).normal(0, 0.02, (side, side)).astype(np.float32)
    heights -= heights.min()
    return np.ascontiguousarray(heights / heights.max(), np.float32)


def opencv_operations(heights: Any) -> Any:
    """Every step an operation of OpenCV's on a whole image."""
    factor = SCALE * heights.shape[1] / 8
    gx = cv2.Sobel(heights, cv2.CV_32F, 1, 0, ksize=3, scale=-factor, borderType=cv2.BORDER_REPLICATE)
    gy = cv2.Sobel(heights, cv2.CV_32F, 0, 1, ksize=3, scale=factor, borderType=cv2.BORDER_REPLICATE)
    length = cv2.magnitude(cv2.magnitude(gx, gy), np.ones_like(gx))
    x, y, z = cv2.divide(gx, length), cv2.divide(gy, length), cv2.divide(1.0, length)
    return cv2.merge([encoded(plane) for plane in (x, y, z)])


def encoded(plane: Any) -> Any:
    """-1..1 in 8 bits; convertScaleAbs rounds to nearest."""
    return cv2.convertScaleAbs(plane, alpha=127.5, beta=127.5)


def opencv_power(heights: Any) -> Any:
    """The same with one inverse square root instead of three divisions."""
    factor = SCALE * heights.shape[1] / 8
    gx = cv2.Sobel(heights, cv2.CV_32F, 1, 0, ksize=3, scale=-factor, borderType=cv2.BORDER_REPLICATE)
    gy = cv2.Sobel(heights, cv2.CV_32F, 0, 1, ksize=3, scale=factor, borderType=cv2.BORDER_REPLICATE)
    length = cv2.accumulateSquare(gx, np.ones_like(gx))
    inverse = cv2.pow(cv2.accumulateSquare(gy, length), -0.5)
    x, y = cv2.multiply(gx, inverse), cv2.multiply(gy, inverse)
    return cv2.merge([encoded(plane) for plane in (x, y, inverse)])


def numpy_lines(heights: Any) -> Any:
    """What one finds when one looks for it."""
    gy, gx = np.gradient(heights, axis=(0, 1))
    factor = np.float32(SCALE * heights.shape[1])
    normal = np.dstack((-gx * factor, gy * factor, np.ones_like(heights)))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return ((normal * 0.5 + 0.5) * 255 + 0.5).astype(np.uint8)


def best(ways: dict[str, Callable[[], Any]], rounds: int) -> dict[str, tuple[float, float]]:
    """Seconds that passed and seconds of processor, the least of each, taken in turns."""
    found = dict.fromkeys(ways, (float("inf"), float("inf")))
    for _ in range(rounds):
        for name, way in ways.items():
            wall, cpu = time.perf_counter(), time.process_time()
            result = way()
            wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
            del result
            found[name] = (min(found[name][0], wall), min(found[name][1], cpu))
    return found


def main() -> None:
    """Compares, times and prints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--side", type=int, default=4096)
    parser.add_argument("--rounds", type=int, default=15)
    chosen = parser.parse_args()
    cv2.setNumThreads(int(os.environ["RAYON_NUM_THREADS"]))
    heights = rough(chosen.side)
    hm = bw.HeightMap(heights, scale=SCALE, wrap="clamp")
    ours = bw.bake(hm, dtype="uint8")["normal"]
    for name, other in {"operations": opencv_operations(heights), "power": opencv_power(heights)}.items():
        apart = np.abs(ours.astype(np.int16) - other)
        share = np.count_nonzero(apart) / apart.size
        print(f"OpenCV, {name}: codes differ by {apart.max()} at most, {share:.2e} of them at all")
        if apart.max() > 1:
            raise SystemExit("the results differ: nothing to compare")
    central = bw.bake(hm, dtype="uint8", kernel="central")["normal"][1:-1, 1:-1]
    apart = np.abs(central.astype(np.int16) - numpy_lines(heights)[1:-1, 1:-1])
    print(f"NumPy: codes differ by {apart.max()} at most inside")
    if apart.max() > 1:
        raise SystemExit("the results differ: nothing to compare")
    ways: dict[str, Callable[[], Any]] = {
        "ours, 8 bits": lambda: bw.bake(hm, dtype="uint8"),
        "ours, floats": lambda: bw.bake(hm),
        "ours from an array, 8 bits": lambda: bw.bake(heights, scale=SCALE, wrap="clamp", dtype="uint8"),
        "OpenCV, operations": lambda: opencv_operations(heights),
        "OpenCV, power": lambda: opencv_power(heights),
        "NumPy": lambda: numpy_lines(heights),
        "copy": heights.copy,
    }
    found = best(ways, chosen.rounds)
    side, threads = chosen.side, os.environ["RAYON_NUM_THREADS"]
    print(f"\nNormal map, {side} x {side} float32 to 8-bit RGB, {threads} threads, best of {chosen.rounds}")
    print(f"{'':28}{'passed':>10}{'processor':>11}")
    for name, (wall, cpu) in found.items():
        print(f"{name:28}{wall * 1e3:8.1f} ms{cpu * 1e3:8.1f} ms")
    opencv = min(("OpenCV, operations", "OpenCV, power"), key=lambda name: found[name][0])
    for name in (opencv, "NumPy"):
        wall, cpu = (found[name][at] / found["ours, 8 bits"][at] for at in range(2))
        print(f"{name} takes {wall:.1f} times our time, {cpu:.1f} times our processor's")


if __name__ == "__main__":
    main()
