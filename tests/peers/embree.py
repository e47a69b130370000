"""Exact hits against Embree, as Mitsuba 3 runs it, on the same surface and rays.

1024 x 1024 rays from the lid of a fractal of 1024 x 1024 texels, all in one direction, so that they
cross 0.13, 0.65 or 3.2 tiles on the way down. For Embree the surface is a triangle mesh, two triangles
a bilinear cell, of just the tiles and parts of tiles that these rays can meet. Both sides run on two
threads. What is timed, in turns and best of several:

* ours: `bw.march(..., outputs=("t",))`, from NumPy arrays to a NumPy array;
* Embree: `Scene.ray_intersect_preliminary` on rays that already lie in Dr.Jit arrays, evaluated to the
  ray parameter; compiled beforehand, with and without Embree's flag for coherent rays, the faster counts.

Between turns there is a pause, and each call that counts follows one that does not: threads of the one side
would still turn in circles in the time of the other, and find the caches full of its data.

Rays are marched in the order of a picture and shuffled. The build is timed once.
"""

# requires: mitsuba==3.9.1 numpy pillow

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ.setdefault("RAYON_NUM_THREADS", "2")

import drjit as dr
import mitsuba as mi
import numpy as np

import bumpwgpu as bw

SIDE = 1024
THREADS = int(os.environ["RAYON_NUM_THREADS"])
SHIFTS = (0.13, 0.65, 3.2)
#: Along no axis and no diagonal, rather along u, so that few tiles are crossed.
AZIMUTH = 0.2
#: Seconds in which the threads of the side before fall asleep; until then they turn in circles.
PAUSE = 0.1
#: What a triangle has cost at most, building included.
BYTES_A_TRIANGLE = 300


def resident() -> int:
    """Bytes of memory that this process has to itself."""
    with open("/proc/self/status") as file:
        for line in file:
            if line.startswith("RssAnon"):
                return int(line.split()[1]) << 10
    return 0


def available() -> int:
    """Bytes of memory that the machine can still give."""
    with open("/proc/meminfo") as file:
        for line in file:
            if line.startswith("MemAvailable"):
                return int(line.split()[1]) << 10
    return 0


def rays(shift: float) -> tuple[np.ndarray, np.ndarray]:
    """A ray for each texel, off its centre, in the order of a picture."""
    row, column = np.divmod(np.arange(SIDE * SIDE, dtype=np.float32), np.float32(SIDE))
    origins = np.stack(((column + 0.3) / SIDE, (row + 0.6) / SIDE, np.ones_like(row)), axis=1)
    way = [shift * np.cos(AZIMUTH), shift * np.sin(AZIMUTH), -1.0]
    return origins.astype(np.float32), np.tile(np.float32(way), (len(origins), 1))


class Embree:
    """The surface as triangles in a Mitsuba scene."""

    def __init__(self, heights: np.ndarray, shift: float) -> None:
        # Cells from half a texel before the first ray to beyond where the last one can reach the floor.
        columns, rows = (int(np.ceil(SIDE * (1 + shift * f(AZIMUTH)))) + 3 for f in (np.cos, np.sin))
        self.triangles = 2 * (columns - 1) * (rows - 1)
        i, j = np.arange(-1, columns - 1), np.arange(-1, rows - 1)
        vertices = np.empty((rows, columns, 3), np.float32)
        vertices[..., 0] = (i + 0.5) / SIDE
        vertices[..., 1] = ((j + 0.5) / SIDE)[:, None]
        vertices[..., 2] = heights[np.ix_(j % SIDE, i % SIDE)]
        corner = (
            np.arange(rows - 1, dtype=np.uint32)[:, None] * columns + np.arange(columns - 1, dtype=np.uint32)
        ).ravel()
        faces = np.concatenate(
            (
                np.stack((corner, corner + 1, corner + columns), axis=1),
                np.stack((corner + 1, corner + columns + 1, corner + columns), axis=1),
            )
        )
        before, start = resident(), time.perf_counter()
        mesh = mi.Mesh("relief", vertex_count=rows * columns, face_count=self.triangles)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = mi.Float(vertices.ravel())
        parameters["faces"] = mi.UInt32(faces.ravel())
        parameters.update()
        self.scene = mi.load_dict({"type": "scene", "mesh": mesh})
        dr.sync_thread()
        self.seconds = time.perf_counter() - start
        self.bytes = resident() - before

    def tracer(self, origins: np.ndarray, ways: np.ndarray, coherent: bool) -> Callable[[], Any]:
        """A call that finds the ray parameter of every hit."""
        ray = mi.Ray3f(
            o=mi.Point3f(*(mi.Float(np.ascontiguousarray(column)) for column in origins.T)),
            d=mi.Vector3f(*(mi.Float(np.ascontiguousarray(column)) for column in ways.T)),
        )
        dr.eval(ray)
        dr.sync_thread()

        def trace() -> Any:
            hits = self.scene.ray_intersect_preliminary(ray, coherent=coherent)
            t = dr.select(hits.is_valid(), hits.t, dr.inf)
            dr.eval(t)
            dr.sync_thread()
            return t

        return trace


def best(contestants: dict[str, Callable[[], Any]], repeats: int) -> dict[str, float]:
    """Seconds of the best of several turns, each right after one that is not counted."""
    seconds = dict.fromkeys(contestants, np.inf)
    for _ in range(repeats):
        for name, call in contestants.items():
            time.sleep(PAUSE)
            call()
            start = time.perf_counter()
            call()
            seconds[name] = min(seconds[name], time.perf_counter() - start)
    return seconds


def differences(ours: np.ndarray, theirs: np.ndarray, shift: float) -> str:
    """How far apart the hits are; the directions have z = -1, so that t is the depth."""
    both = np.isfinite(ours) & np.isfinite(theirs)
    apart = np.abs(ours[both].astype(np.float64) - theirs[both])
    texels = apart * shift * SIDE
    return (
        f"depth apart: median {np.median(apart):.1e}, p99 {np.percentile(apart, 99):.1e}, "
        f"over a texel {100 * (texels > 1).mean():.3f} %; "
        f"hit by one only: {int((np.isfinite(ours) != np.isfinite(theirs)).sum())}"
    )


def compare(hm: bw.HeightMap, shift: float, repeats: int) -> None:
    """One line of the table for each order of the rays."""
    heights = hm.array
    triangles = (
        2 * int(SIDE * (1 + shift * np.cos(AZIMUTH)) + 3) * int(SIDE * (1 + shift * np.sin(AZIMUTH)) + 3)
    )
    if triangles * BYTES_A_TRIANGLE > 0.7 * available():
        need, have = triangles * BYTES_A_TRIANGLE / 2**30, available() / 2**30
        print(
            f"{shift:>5}  skipped: {triangles / 1e6:.1f} M triangles may take {need:.1f} GB, "
            f"and {have:.1f} GB are free"
        )
        return
    embree = Embree(heights, shift)
    origins, ways = rays(shift)
    shuffle = np.random.default_rng(1).permutation(len(origins))
    note = ""
    for order, (o, d) in {"picture": (origins, ways), "shuffled": (origins[shuffle], ways[shuffle])}.items():
        calls: dict[str, Callable[[], Any]] = {
            "exact": lambda o=o, d=d: bw.march(hm, o, d, outputs=("t",)).t,
            "relief": lambda o=o, d=d: (
                bw.march(hm, o, d, bw.techniques.Relief(linear=32, refine=8), outputs=("t",)).t
            ),
            "coherent": embree.tracer(o, d, True),
            "incoherent": embree.tracer(o, d, False),
        }
        seconds = best(calls, repeats)
        rate = {name: len(o) / s / 1e6 for name, s in seconds.items()}
        theirs = max(rate["coherent"], rate["incoherent"])
        print(
            f"{shift:>5}  {order:<8} {rate['exact']:>8.2f} {rate['relief']:>8.2f} {theirs:>8.2f} "
            f"{rate['exact'] / theirs:>9.2f} {rate['exact'] / rate['relief']:>9.2f}"
        )
        if order == "picture":
            relief = np.abs(calls["relief"]() - calls["exact"]()) * shift * SIDE
            note = differences(calls["exact"](), np.array(calls["coherent"]()), shift)
            note += f"; relief over a texel from exact: {100 * (relief > 1).mean():.2f} %"
    print(
        f"       {embree.triangles / 1e6:.1f} M triangles: {embree.seconds:.2f} s, "
        f"{embree.bytes / 2**20:.0f} MB; {note}",
        flush=True,
    )


def fractal() -> np.ndarray:
    """The heights, made in another process: what is freed in this one would hide what is allocated."""
    code = (
        "import sys, numpy, bumpwgpu; "
        f"numpy.save(sys.argv[1], bumpwgpu.HeightMap.procedural('fbm', {SIDE}).array)"
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "heights.npy"
        subprocess.run([sys.executable, "-c", code, str(path)], check=True)
        return np.load(path)


def ours(heights: np.ndarray) -> bw.HeightMap:
    """Our side of the build: the field and its pyramid, which the first ray asks for."""
    bw.march(bw.HeightMap(heights[:4, :4]), [[0.5, 0.5, 1]], [[0, 0, -1]])
    before, start = resident(), time.perf_counter()
    hm = bw.HeightMap(heights)
    made = time.perf_counter()
    bw.march(hm, [[0.5, 0.5, 1]], [[0, 0, -1]])
    end = time.perf_counter()
    megabytes = (resident() - before) / 2**20
    print(
        f"ours: height map {1e3 * (made - start):.0f} ms, "
        f"what the search builds {1e3 * (end - made):.0f} ms, {megabytes:.0f} MB in all"
    )
    return hm


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--shifts", type=float, nargs="+", default=SHIFTS)
    chosen = parser.parse_args()
    variant = "llvm_ad_rgb"
    if variant not in mi.variants():
        sys.exit(f"this Mitsuba has no {variant}")
    try:
        mi.set_variant(variant)
        dr.eval(mi.Float(1.0) + 1)
    except Exception as error:
        # A missing LLVM library: the package asks for it only now.
        print(f"skipped: {variant} does not run here ({error}); Debian: apt install libllvm15")
        return
    dr.set_thread_count(THREADS)
    cpu = next(
        (
            line.split(":")[1].strip()
            for line in Path("/proc/cpuinfo").read_text().splitlines()
            if "model name" in line
        ),
        platform.processor(),
    )
    print(f"Mitsuba {mi.__version__} {variant}, Embree {mi.MI_ENABLE_EMBREE}; {THREADS} threads each; {cpu}")
    hm = ours(fractal())
    print(f"{SIDE}^2 rays, {SIDE}^2 texels, best of {chosen.repeats} in turns; million rays a second:")
    columns = ("exact", "relief", "Embree"), ("ex/Embree", "ex/relief")
    heads = [f"{name:>8}" for name in columns[0]] + [f"{name:>9}" for name in columns[1]]
    print(f"{'shift':>5}  {'rays':<8} {' '.join(heads)}")
    for shift in chosen.shifts:
        compare(hm, shift, chosen.repeats)


if __name__ == "__main__":
    main()
