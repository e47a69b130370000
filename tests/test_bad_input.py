"""Every map of constant, narrow, broken and enormous heights: a right result, or an error that says why."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw
from bumpwgpu.baking import MAPS, about, estimate

WRAPS = ("repeat", "clamp", "mirror")
# What each channel of a level surface holds, whatever its height.
LEVEL = {"x": 0.0, "y": 0.0, "z": 1.0, "ao": 1.0, "sine": 0.0, "mean": 0.0, "gaussian": 0.0}


def arrays(baked: Any) -> tuple[NDArray[np.float32], ...]:
    return baked if isinstance(baked, tuple) else (baked,)


def channels(name: str, array: NDArray[np.float32]) -> NDArray[np.float32]:
    return array if len(about(name).channels) > 1 else array[..., np.newaxis]


@pytest.mark.parametrize("name", MAPS)
def test_constant_maps_are_level(name: str) -> None:
    for wrap in WRAPS:
        for height in (0.0, 0.3, 1.0):
            flat = np.full((6, 9), height, np.float32)
            for array in arrays(bw.bake(flat, name, wrap=wrap)[name]):
                assert np.isfinite(array).all(), (wrap, height)
                planes = channels(name, array)
                assert (planes == planes.reshape(-1, planes.shape[-1])[0]).all() or name == "distance"
                for at, channel in enumerate(about(name).channels):
                    if channel.name in LEVEL:
                        np.testing.assert_allclose(planes[..., at], LEVEL[channel.name], atol=1e-6)


@pytest.mark.parametrize("name", MAPS)
def test_a_row_is_the_map_that_repeats_it(name: str) -> None:
    rng = np.random.default_rng(3)
    row = rng.random((1, 13), dtype=np.float32)
    for wrap in WRAPS:
        for heights, along in ((row, 0), (np.ascontiguousarray(row.T), 1)):
            narrow = arrays(bw.bake(heights, name, wrap=wrap, scale=0.2)[name])
            assert all(np.isfinite(array).all() for array in narrow), wrap
            if about(name).form != "single" or name in ("cone", "relaxed_cone"):
                continue
            # Four times the row in four times the tile is the same surface.
            tile = (1.0, 4.0) if along == 0 else (4.0, 1.0)
            wide = bw.bake(np.repeat(heights, 4, along), name, wrap=wrap, scale=0.2, tile_size=tile)[name]
            np.testing.assert_allclose(wide.take([1], along), narrow[0], atol=2e-4, err_msg=wrap)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", ["float32", "float64", "float16"])
def test_what_is_not_finite_is_found_and_named(bad: float, dtype: str, tmp_path: Path) -> None:
    heights = np.full((40, 70), 0.5, dtype)
    heights[17, 66] = bad
    for source in (heights, np.asfortranarray(heights), heights[:, ::-1][:, ::-1]):
        with pytest.raises(ValueError, match="row 17, column 66"):
            bw.bake(source)
    if dtype == "float32":
        np.save(tmp_path / "h.npy", heights)
        with pytest.raises((ValueError, bw.BakeError), match="row 17, column 66"):
            bw.bake_file(tmp_path / "h.npy", tmp_path / "n.png")
        assert not (tmp_path / "n.png").exists()


@pytest.mark.parametrize(("name", "options"), [("horizon", {"azimuths": 4096}), ("distance", {"depth": 512})])
def test_what_does_not_fit_is_said_in_bytes_before_it_is_made(name: str, options: dict[str, int]) -> None:
    side = 2048 if name == "horizon" else 4096
    total = sum(estimate((side, side), name, **options))
    if total < 1.1 * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"):
        pytest.skip("this machine could hold it")
    heights = bw.HeightMap(np.zeros((side, side), np.uint8))
    _ = heights._field
    started = time.process_time()
    with pytest.raises(bw.BakeError, match=rf"{total} bytes"):
        bw.bake(heights, name, **options)
    assert time.process_time() - started < 0.5


def test_an_array_of_the_callers_is_neither_kept_nor_changed() -> None:
    heights = np.random.default_rng(5).random((30, 80), dtype=np.float32)
    before = heights.copy()
    normal = bw.bake(heights, dtype="uint8")["normal"]
    np.testing.assert_array_equal(normal, bw.bake(bw.HeightMap(heights), dtype="uint8")["normal"])
    np.testing.assert_array_equal(heights, before)
    heights[:] = 0.5
    assert heights.flags.writeable
    kept = bw.HeightMap(before)
    before[:] = 0.0
    assert kept.array.max() > 0.9
    assert kept.bits == 32


SHARED = """
import numpy as np, os, pathlib, bumpwgpu as bw
folder = pathlib.Path(os.environ["BUMPWGPU_CACHE"])
entries = lambda: {path.name: path.stat().st_ino for path in folder.glob("*.bwmap")}
heights = bw.HeightMap.procedural("bricks", 24)
rays = np.tile([[0.2, 0.3, 1.0]], (4, 1)), np.tile([[0.3, 0.1, -1.0]], (4, 1))
bw.march(heights, *rays, "cone")
first = entries()
assert len(first) == 1, first
bw.march(heights.replace(), *rays, "cone")
bw.march(heights.replace(), *rays, "distance")
both = entries()
assert len(both) == 2 and first.items() <= both.items(), (first, both)
bw.bake(heights, ("cone", "distance"))
assert entries() == both, "a map that a search baked is the one that is asked for"
print("ok")
"""


def test_maps_that_searches_bake_are_kept_too(tmp_path: Path) -> None:
    environment = {**os.environ, "BUMPWGPU_CACHE": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", SHARED], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.stdout == "ok\n", done.stderr
