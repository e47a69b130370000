"""march: against an independent walk of the bilinear surface in NumPy, closed forms, and the device."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw

SEARCHES = bw.techniques.marching()
# Largest hit error in texels on a smooth map seen from above; measured 0.0045, 0.31, 0.0031 and 0.
REFINED = {"relief": 0.01, "pom": 0.4, "interval": 0.01, "exact": 0.0}
# t in units of the ray parameter; measured 6e-8 relative, the rounding of a float32.
T_TOLERANCE = 1e-6


def wrapped(index: int, size: int, wrap: str) -> int:
    if wrap == "repeat":
        return index % size
    if wrap == "clamp":
        return min(max(index, 0), size - 1)
    index %= 2 * size
    return index if index < size else 2 * size - 1 - index


def walk(
    heights: NDArray[np.float32], origin: NDArray[np.float64], way: NDArray[np.float64], wrap: str
) -> float:
    """The first t with z(t) <= h(t), cell by cell in float64; inf when the ray gets below 0 or above 1."""
    rows, columns = heights.shape
    x0, y0 = origin[0] * columns - 0.5, origin[1] * rows - 0.5
    dx, dy = way[0] * columns, way[1] * rows
    end = -origin[2] / way[2] if way[2] < 0 else (1 - origin[2]) / way[2]
    borders = [0.0, end]
    for start, step in ((x0, dx), (y0, dy)):
        if step != 0:
            low, high = sorted((start, start + step * end))
            borders += [(k - start) / step for k in range(int(np.ceil(low)), int(np.floor(high)) + 1)]
    borders = sorted(t for t in borders if 0 <= t <= end)
    for near, far in itertools.pairwise(borders):
        middle = (near + far) / 2
        i, j = int(np.floor(x0 + dx * middle)), int(np.floor(y0 + dy * middle))
        corner = {
            (a, b): float(heights[wrapped(j + b, rows, wrap), wrapped(i + a, columns, wrap)])
            for a in (0, 1)
            for b in (0, 1)
        }
        h0, hx = corner[0, 0], corner[1, 0] - corner[0, 0]
        hy = corner[0, 1] - corner[0, 0]
        hxy = corner[1, 1] - corner[1, 0] - corner[0, 1] + corner[0, 0]
        px, py = x0 + dx * near - i, y0 + dy * near - j
        # gap(s) = z - h along the cell, s = t - near.
        c = origin[2] + way[2] * near - (h0 + hx * px + hy * py + hxy * px * py)
        b = way[2] - (hx * dx + hy * dy + hxy * (px * dy + py * dx))
        a = -hxy * dx * dy
        if c <= 0:
            return near
        roots = np.roots([a, b, c]) if a != 0 else np.array([-c / b] if b != 0 else [])
        inside = [
            r.real
            for r in np.atleast_1d(roots)
            if abs(np.imag(r)) < 1e-12 and -1e-12 <= r.real <= far - near + 1e-12
        ]
        if inside:
            return float(near + min(inside))
    return float("inf")


def rays(count: int, elevation_deg: float, seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rays that enter through the lid at an elevation in texture space, from all sides."""
    rng = np.random.default_rng(seed)
    origins = np.column_stack((rng.uniform(-2, 3, (count, 2)), np.ones(count)))
    azimuth = rng.uniform(0, 2 * np.pi, count)
    elevation = np.radians(elevation_deg)
    lateral = np.cos(elevation) * np.column_stack((np.cos(azimuth), np.sin(azimuth)))
    return origins, np.column_stack((lateral, np.full(count, -np.sin(elevation))))


MAPS = {
    "noise": bw.HeightMap.procedural("noise", (24, 17), seed=3).array,
    "fbm": bw.HeightMap.procedural("fbm", 32, seed=1).array,
    "bricks": bw.HeightMap.procedural("bricks", 48).array,
    "thin": bw.HeightMap.procedural("thin", 40).array,
    "dot": bw.HeightMap.procedural("dot", 16).array,
}


@pytest.mark.parametrize("wrap", ["repeat", "clamp", "mirror"])
@pytest.mark.parametrize("name", MAPS)
def test_exact_agrees_with_the_walk(name: str, wrap: str) -> None:
    hm = bw.HeightMap(MAPS[name], wrap=wrap)
    for elevation in (80, 30, 10, 2):
        origins, ways = rays(25, elevation, seed=elevation)
        hits = bw.march(hm, origins, ways, outputs=("t", "status"))
        expected = np.array([walk(MAPS[name], o, d, wrap) for o, d in zip(origins, ways, strict=True)])
        # Every ray from the lid to the floor meets a surface between them.
        assert (hits.status == 0).all()
        np.testing.assert_allclose(hits.t, expected, rtol=T_TOLERANCE, atol=T_TOLERANCE)


def test_the_walk_catches_a_wrong_search() -> None:
    """Negative control: bisection of the whole ray finds some crossing, not the first."""
    hm = bw.HeightMap(MAPS["thin"])
    origins, ways = rays(40, 10, seed=0)
    expected = np.array([walk(MAPS["thin"], o, d, "repeat") for o, d in zip(origins, ways, strict=True)])
    wrong = bw.march(hm, origins, ways, "binary", outputs=("t",)).t
    assert (np.abs(wrong - expected) > 1e-2).mean() > 0.2


def test_ridge_in_closed_form() -> None:
    hm = bw.HeightMap.procedural("ridge", 64)
    # Between texel centres the ridge is h = 2u for u < 0.5; straight down and along the slope.
    u = np.array([0.1, 0.2, 0.3, 0.4])
    origins = np.column_stack((u, np.full(4, 0.5), np.ones(4)))
    hits = bw.march(hm, origins, np.tile([0.0, 0.0, -2.0], (4, 1)))
    np.testing.assert_allclose(hits.t, (1 - 2 * u) / 2, atol=1e-6)
    np.testing.assert_allclose(hits.z, 2 * u, atol=1e-6)
    np.testing.assert_allclose(hits.uv, origins[:, :2], atol=1e-6)
    # Normal in texture space: (-2, 0, 1) normalised.
    expected = np.array([-2, 0, 1]) / np.sqrt(5)
    np.testing.assert_allclose(hits.normal, np.tile(expected, (4, 1)), atol=1e-5)
    # u = 0.1 + t, z = 1 - t meet h = 2u at t = 0.8 / 3.
    slanted = bw.march(hm, [[0.1, 0.5, 1.0]], [[1.0, 0.0, -1.0]])
    assert slanted.t[0] == pytest.approx(0.8 / 3, abs=1e-6)


def test_flat_map_and_misses() -> None:
    hm = bw.HeightMap.procedural("flat", 8)
    origins = [[0.5, 0.5, 1.0], [0.5, 0.5, 0.8], [0.5, 0.5, 2.0], [0.5, 0.5, 0.3]]
    ways = [[0.3, 0.1, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, -1.0]]
    hits = bw.march(hm, origins, ways)
    assert hits.status.tolist() == [0, 1, 1, 0]
    assert hits.t.tolist() == [0.5, np.inf, np.inf, 0.0]
    assert np.isnan(hits.uv[1:3]).all()
    assert np.isnan(hits.normal[1:3]).all()


@pytest.mark.parametrize("technique", REFINED)
def test_searches_find_a_smooth_surface(technique: str) -> None:
    hm = bw.HeightMap.procedural("sines", 128)
    origins, ways = rays(200, 60, seed=5)
    found = bw.march(hm, origins, ways, technique, outputs=("uv",)).uv
    exact = bw.march(hm, origins, ways, outputs=("uv",)).uv
    assert np.abs(found - exact).max() * 128 <= REFINED[technique]


@pytest.mark.parametrize("technique", SEARCHES)
def test_every_search_takes_every_ray(technique: str) -> None:
    hm = bw.HeightMap(MAPS["noise"])
    origins, ways = rays(100, 20, seed=1)
    hits = bw.march(hm, origins, ways, technique)
    assert set(hits.outputs) == {"t", "uv", "z", "normal", "steps", "status"}
    assert hits.t.shape == (100,)
    assert hits.uv.shape == (100, 2)
    assert hits.normal.shape == (100, 3)
    assert [hits.t.dtype, hits.steps.dtype, hits.status.dtype] == [np.float32, np.uint32, np.uint8]
    assert not np.isnan(hits.t).any()
    hit = hits.status == 0
    np.testing.assert_allclose(np.linalg.norm(hits.normal[hit], axis=1), 1.0, atol=1e-5)


def test_more_steps_cost_more_and_err_less() -> None:
    hm = bw.HeightMap.procedural("fbm", 64)
    origins, ways = rays(500, 45, seed=2)
    exact = bw.march(hm, origins, ways, outputs=("uv",)).uv

    def run(linear: int) -> tuple[float, float]:
        technique = bw.techniques.Relief(linear=linear, refine=8)
        hits = bw.march(hm, origins, ways, technique, outputs=("uv", "steps"))
        return float(np.abs(hits.uv - exact).mean()), float(hits.steps.mean())

    (coarse_error, coarse_steps), (fine_error, fine_steps) = run(4), run(64)
    assert fine_error < coarse_error
    assert fine_steps > coarse_steps


def test_double_precision_rays_are_not_rounded() -> None:
    hm = bw.HeightMap.procedural("sines", 64)
    # A third of a texel, a million tiles away: lost in float32.
    offset = 2.0**20
    origins = np.array([[0.1 + 1 / 192, 0.3, 1.0]])
    ways = np.array([[0.2, 0.1, -1.0]])
    near = bw.march(hm, origins, ways).t[0]
    away = origins + np.array([offset, 0, 0])
    far = bw.march(hm, away, ways).t[0]
    assert far == pytest.approx(near, abs=1e-6)
    rounded = bw.march(hm, away.astype(np.float32), ways).t[0]
    assert abs(rounded - near) > 1e-4


def test_mixed_and_odd_arrays() -> None:
    hm = bw.HeightMap(MAPS["fbm"])
    origins, ways = rays(64, 30, seed=9)
    expected = bw.march(hm, origins, ways).t
    kept = origins.copy()
    readonly = origins.copy()
    readonly.flags.writeable = False
    swapped = np.asfortranarray(origins)
    strided = np.repeat(origins, 2, axis=0)[::2]
    big = origins.astype(">f8")
    for variant in (readonly, swapped, strided, big, origins.tolist(), origins.astype(np.longdouble)):
        np.testing.assert_array_equal(bw.march(hm, variant, ways).t, expected)
    mixed = bw.march(hm, origins.astype(np.float32), ways).t
    np.testing.assert_allclose(mixed, expected, atol=1e-4)
    np.testing.assert_array_equal(origins, kept)


def test_results_belong_to_the_caller() -> None:
    hits = bw.march(bw.HeightMap(MAPS["fbm"]), *rays(8, 30, seed=9))
    assert hits.uv.flags.writeable
    assert hits.uv.flags.c_contiguous
    hits.uv[:] = 0


def test_only_what_is_asked_for() -> None:
    hits = bw.march(bw.HeightMap(MAPS["fbm"]), *rays(8, 30, seed=9), outputs=("status", "t", "t"))
    assert hits.outputs == ("t", "status")
    assert len(hits) == 8
    with pytest.raises(AttributeError, match="outputs=\\('uv'"):
        _ = hits.uv
    assert "8 rays" in repr(hits)


def test_shadow_rays_leave_the_surface() -> None:
    hm = bw.HeightMap.procedural("ridge", 64)
    ground = bw.march(hm, [[0.2, 0.5, 1.0]], [[0.0, 0.0, -1.0]])
    point = np.array([[0.2, 0.5, float(ground.z[0])]])
    up_slope, away = [[1.0, 0.0, 0.1]], [[-1.0, 0.0, 3.0]]
    assert bw.march(hm, point, up_slope, from_surface=True).status[0] == 0
    assert bw.march(hm, point, away, from_surface=True).status[0] == 1


BAD_RAYS = {
    "direction of ray 2 is zero": ([[0, 0, 1]] * 4, [[0, 0, -1]] * 2 + [[0, 0, 0]] * 2, "ray 2"),
    "NaN origin": ([[0, 0, 1], [np.nan, 0, 1]], [[0, 0, -1]] * 2, "ray 1"),
    "infinite direction": ([[0, 0, 1]], [[0, np.inf, -1]], "ray 0"),
    "different numbers": ([[0, 0, 1]] * 2, [[0, 0, -1]] * 3, "2 ray origins but 3"),
    "two components": ([[0, 0]], [[0, 0, -1]], r"shape \(N, 3\), got \(1, 2\)"),
    "flat": ([0, 0, 1], [[0, 0, -1]], r"got \(3,\)"),
    "empty": (np.empty((0, 3)), np.empty((0, 3)), "empty"),
    "ragged": ([[0, 0, 1], [0, 0]], [[0, 0, -1]], "not an array"),
}


@pytest.mark.parametrize("name", BAD_RAYS)
def test_bad_rays(name: str) -> None:
    origins, ways, message = BAD_RAYS[name]
    with pytest.raises(ValueError, match=message):
        bw.march(bw.HeightMap(MAPS["dot"]), origins, ways)


def test_bad_settings() -> None:
    hm = bw.HeightMap(MAPS["dot"])
    ray = ([[0, 0, 1]], [[0, 0, -1]])
    for bad in ("nope", "flat", "normal"):
        with pytest.raises(ValueError, match="relief"):
            bw.march(hm, *ray, bad)
    with pytest.raises(ValueError, match="status"):
        bw.march(hm, *ray, outputs=("depth",))
    with pytest.raises(ValueError, match="empty"):
        bw.march(hm, *ray, outputs=())
    with pytest.raises(ValueError, match="cpu"):
        bw.march(hm, *ray, device="tpu")
    with pytest.raises(ValueError, match="from_surface"):
        bw.march(hm, *ray, device="gpu", from_surface=True)
    for bad_type in (3, None, bw.techniques.Relief):
        with pytest.raises(TypeError):
            bw.march(hm, *ray, bad_type)
    with pytest.raises(TypeError, match="HeightMap"):
        bw.march(np.zeros((4, 4)), *ray)
    with pytest.raises(TypeError, match="numbers"):
        bw.march(hm, [["a", "b", "c"]], ray[1])


def test_techniques_check_their_parameters() -> None:
    for call in (
        lambda: bw.techniques.Relief(linear=0),
        lambda: bw.techniques.Relief(refine=99),
        lambda: bw.techniques.Steep(steps=10**9),
    ):
        with pytest.raises(ValueError, match="must be in"):
            call()
    with pytest.raises(TypeError, match="whole number"):
        bw.techniques.Steep(steps=1.5)
    with pytest.raises(TypeError, match="linear, refine"):
        bw.techniques.Relief(steps=3)


@pytest.mark.gpu
@pytest.mark.parametrize("technique", SEARCHES)
def test_device_agrees_with_the_processor(technique: str) -> None:
    hm = bw.HeightMap.procedural("bricks", (96, 64))
    origins, ways = (a.astype(np.float32) for a in rays(4000, 25, seed=4))
    cpu = bw.march(hm, origins, ways, technique)
    gpu = bw.march(hm, origins, ways, technique, device="gpu", outputs=("uv", "status"))
    assert gpu.outputs == ("uv", "status")
    assert gpu.seconds is not None
    assert gpu.seconds > 0
    assert (cpu.status != gpu.status).mean() <= 1e-3
    both = (cpu.status == 0) & (gpu.status == 0)
    if technique.endswith("_texel"):
        # Published cones lead below the surface, where the last bits of a step decide where the search ends.
        found = bw.march(hm, origins, ways, "exact").uv
        both &= (np.abs(cpu.uv - found) * [96, 64] < 0.05).all(axis=1)
    assert both.sum() > 500
    error = np.abs(cpu.uv[both] - gpu.uv[both]) * [96, 64]
    assert np.percentile(error, 99) < 0.01  # texels; measured 1e-4


@pytest.mark.gpu
def test_the_device_comparison_can_fail() -> None:
    """Negative control: another step count on the device is seen."""
    hm = bw.HeightMap.procedural("bricks", 64)
    origins, ways = (a.astype(np.float32) for a in rays(2000, 25, seed=4))
    cpu = bw.march(hm, origins, ways, bw.techniques.Steep(steps=32), outputs=("uv",)).uv
    gpu = bw.march(hm, origins, ways, bw.techniques.Steep(steps=31), outputs=("uv",), device="gpu").uv
    assert np.nanpercentile(np.abs(cpu - gpu) * 64, 99) > 0.1


LONG = """
import numpy as np, bumpwgpu as bw
hm = bw.HeightMap.procedural("noise", 512)
origins = np.tile(np.float32([0.1, 0.2, 1.0]), (400_000, 1))
ways = np.tile(np.float32([1.0, 0.77, -1e-4]), (400_000, 1))
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_stops_a_march() -> None:
    code = LONG + (
        "print('go', flush=True)\n"
        "try:\n"
        "    while True: bw.march(hm, origins, ways, bw.techniques.Steep(steps=4096))\n"
        "except KeyboardInterrupt: print('stopped')\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "go\n"
    time.sleep(0.3)
    start = time.perf_counter()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert out == "stopped\n", err
    assert err == ""
    assert time.perf_counter() - start < 5


def test_other_threads_run_during_a_march() -> None:
    hm = bw.HeightMap.procedural("noise", 256)
    origins = np.tile([0.1, 0.2, 1.0], (100_000, 1))
    ways = np.tile([1.0, 0.77, -0.01], (100_000, 1))
    worker = threading.Thread(
        target=bw.march, args=(hm, origins, ways, bw.techniques.Steep(steps=512)), daemon=True
    )
    worker.start()
    ticks = 0
    while worker.is_alive():
        ticks += 1
        time.sleep(0.001)
    assert ticks > 3


@pytest.mark.skipif(not hasattr(os, "fork"), reason="fork")
def test_a_forked_child_can_march() -> None:
    code = (
        "import os, bumpwgpu as bw\n"
        "hm = bw.HeightMap.procedural('fbm', 64)\n"
        "ray = ([[0.5, 0.5, 1.0]], [[0.1, 0.0, -1.0]])\n"
        "first = bw.march(hm, *ray).t[0]\n"
        "child = os.fork()\n"
        "if child == 0: os._exit(0 if bw.march(hm, *ray).t[0] == first else 1)\n"
        "print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout == "0\n", done.stderr
