"""Marching into arrays of the caller's, out of files, and in a stream."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw
from bumpwgpu import _blocks

SHAPES = {"t": (), "uv": (2,), "z": (), "normal": (3,), "steps": (), "status": ()}
DTYPES = {"steps": np.uint32, "status": np.uint8}


@pytest.fixture(scope="module")
def hm() -> bw.HeightMap:
    return bw.HeightMap.procedural("noise", (48, 64), seed=2)


def rays(count: int, seed: int = 0) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    random = np.random.default_rng(seed)
    origins = random.random((count, 3), np.float32)
    origins[:, 2] = 1
    ways = random.random((count, 3), np.float32) - np.float32(0.5)
    ways[:, 2] = -1
    return origins, ways


def places(count: int, fill: int = 7) -> dict[str, NDArray[Any]]:
    return {
        name: np.full((count, *shape), fill, DTYPES.get(name, np.float32)) for name, shape in SHAPES.items()
    }


@pytest.fixture
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> int:
    """Blocks of few rays, so that a few rays make many."""
    monkeypatch.setattr(_blocks, "BLOCK", 1000)
    monkeypatch.setattr("bumpwgpu.marching.BLOCK", 1000)
    return 1000


def same(hits: bw.Hits, expected: bw.Hits, technique: str = "exact") -> None:
    assert hits.outputs == expected.outputs
    for name in hits.outputs:
        same_array(name, getattr(hits, name), getattr(expected, name), technique)


def same_array(name: str, array: NDArray[Any], expected: NDArray[Any], technique: str = "exact") -> None:
    if name == "steps" and technique == "exact":
        # Its rays share steps with those they come along with, which blocks and streams cut apart.
        assert array.shape == expected.shape
        assert array.sum(dtype=np.int64) == pytest.approx(expected.sum(dtype=np.int64), rel=0.01)
        assert np.median(array) == pytest.approx(np.median(expected), abs=1)
    else:
        np.testing.assert_array_equal(array, expected, err_msg=name)


# ---- out ----


def test_results_go_where_they_are_wanted(hm: bw.HeightMap) -> None:
    origins, ways = rays(5000)
    expected = bw.march(hm, origins, ways)
    out = places(5000)
    hits = bw.march(hm, origins, ways, out=out)
    same(hits, expected)
    for name, array in out.items():
        assert np.shares_memory(array, getattr(hits, name))
        np.testing.assert_array_equal(array, getattr(expected, name))


def test_out_says_what_is_wanted(hm: bw.HeightMap) -> None:
    origins, ways = rays(10)
    out = {"z": np.empty(10, np.float32), "t": np.empty(10, np.float32)}
    assert bw.march(hm, origins, ways, out=out).outputs == ("t", "z")
    assert bw.march(hm, origins, ways, out=out, outputs=("z", "t")).outputs == ("t", "z")
    with pytest.raises(ValueError, match="out has z, t but outputs are t"):
        bw.march(hm, origins, ways, out=out, outputs=("t",))


def test_out_of_the_wrong_kind(hm: bw.HeightMap) -> None:
    origins, ways = rays(10)
    packed = np.zeros((20, 3), np.float32)
    readonly = np.zeros(10, np.float32)
    readonly.flags.writeable = False
    for bad, message in (
        ({}, "empty"),
        ({"depth": np.zeros(10)}, "unknown name 'depth'"),
        ({"t": np.zeros(10)}, r"float32 of shape \(10,\), got float64"),
        ({"t": np.zeros(9, np.float32)}, r"got float32 of shape \(9,\)"),
        ({"uv": np.zeros(20, np.float32)}, r"of shape \(10, 2\)"),
        ({"t": np.zeros(20, np.float32)[::2]}, "contiguous"),
        ({"t": np.zeros(10, ">f4")}, "got >f4"),
        ({"t": readonly}, "writable"),
        ({"t": origins.reshape(-1)[:10]}, "overlaps origins"),
        ({"normal": packed[:10], "uv": packed.reshape(-1)[20:40].reshape(10, 2)}, "overlaps"),
    ):
        with pytest.raises(ValueError, match=message):
            bw.march(hm, origins, ways, out=bad)
    for bad_type in ([np.zeros(10, np.float32)], "t", {"t": [0.0] * 10}):
        with pytest.raises(TypeError, match="out"):
            bw.march(hm, origins, ways, out=bad_type)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="progress"):
        bw.march(hm, origins, ways, progress=3)  # type: ignore[arg-type]


@pytest.mark.gpu
def test_the_device_writes_to_out_too(hm: bw.HeightMap) -> None:
    origins, ways = rays(100)
    out = {"t": np.empty(100, np.float32)}
    hits = bw.march(hm, origins, ways, out=out, device="gpu")
    assert hits.seconds is not None
    np.testing.assert_allclose(out["t"], bw.march(hm, origins, ways).t, atol=1e-3)


# ---- blocks ----


@pytest.mark.parametrize("kind", ["float32", "float64", "big-endian", "columns", "reversed", "integers"])
def test_blocks_change_nothing(hm: bw.HeightMap, kind: str, small_blocks: int) -> None:
    origins, ways = rays(4321)
    table = np.concatenate((origins, ways), axis=1)
    variants: dict[str, tuple[NDArray[Any], NDArray[Any]]] = {
        "float32": (origins, ways),
        "float64": (origins.astype(np.float64), ways),
        "big-endian": (origins.astype(">f4"), ways.astype(">f8")),
        "columns": (table[:, :3], table[:, 3:]),
        "reversed": (origins[::-1].copy()[::-1], ways),
        "integers": (np.tile(np.int16([0, 0, 1]), (4321, 1)), ways),
    }
    starts, directions = variants[kind]
    native = [array if array.dtype == np.float32 else array.astype(np.float64) for array in variants[kind]]
    whole = [np.ascontiguousarray(array) for array in native]
    for technique in ("exact", "relief"):
        calls: list[tuple[int, int]] = []

        def note(done: int, total: int, calls: list[tuple[int, int]] = calls) -> None:
            calls.append((done, total))

        hits = bw.march(hm, starts, directions, technique, progress=note)
        assert calls == [(n, 4321) for n in (1000, 2000, 3000, 4000, 4321)]
        same(hits, bw.march(hm, *whole, technique), technique)


def test_a_bad_ray_keeps_its_number(hm: bw.HeightMap, small_blocks: int) -> None:
    origins, ways = rays(4000)
    ways[3456] = 0
    with pytest.raises(ValueError, match="ray 3456: direction is zero"):
        bw.march(hm, origins[::-1][::-1], ways, progress=lambda done, total: None)
    origins[2222, 1] = np.inf
    with pytest.raises(ValueError, match="ray 2222: origin"):
        bw.march(hm, origins, ways, progress=lambda done, total: None)


def test_progress_may_stop_it(hm: bw.HeightMap, small_blocks: int) -> None:
    class Enough(Exception):
        pass

    def stop(done: int, total: int) -> None:
        if done >= 2000:
            raise Enough

    out = {"status": np.full(5000, 9, np.uint8)}
    with pytest.raises(Enough):
        bw.march(hm, *rays(5000), out=out, progress=stop)
    assert (out["status"][:2000] == 0).all()
    assert (out["status"][2000:] == 9).all()


def test_rays_and_results_in_files(hm: bw.HeightMap, tmp_path: Path, small_blocks: int) -> None:
    origins, ways = rays(4500)
    expected = bw.march(hm, origins, ways, outputs=("t", "uv"))
    np.save(tmp_path / "origins.npy", origins)
    np.save(tmp_path / "ways.npy", ways)
    starts, directions = (np.load(tmp_path / f"{name}.npy", mmap_mode="r") for name in ("origins", "ways"))
    out = {
        name: np.lib.format.open_memmap(tmp_path / f"{name}.npy", "w+", np.float32, (4500, *SHAPES[name]))
        for name in ("t", "uv")
    }
    hits = bw.march(hm, starts, directions, out=out)
    same(hits, expected)
    del hits, out
    for name in ("t", "uv"):
        np.testing.assert_array_equal(np.load(tmp_path / f"{name}.npy"), getattr(expected, name))
    readonly = np.load(tmp_path / "t.npy", mmap_mode="r")
    with pytest.raises(ValueError, match="writable"):
        bw.march(hm, starts, directions, out={"t": readonly})


def test_private_pages_are_kept(hm: bw.HeightMap, tmp_path: Path, small_blocks: int) -> None:
    """Copy-on-write arrays live in memory only: dropping their pages would lose what was written."""
    origins, ways = rays(9000)
    np.save(tmp_path / "origins.npy", np.zeros_like(origins))
    private = np.load(tmp_path / "origins.npy", mmap_mode="c")
    private[:] = origins
    assert _blocks.mapped_file(private) is None
    same(bw.march(hm, private, ways), bw.march(hm, origins, ways))
    np.testing.assert_array_equal(private, origins)


def test_which_arrays_lie_in_files(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros((5000, 3), np.float32))
    mapped = np.load(tmp_path / "a.npy", mmap_mode="r+")
    for view in (mapped, mapped[10:], np.asarray(mapped), mapped[::2].reshape(-1)):
        expected = np.shares_memory(view, mapped)
        assert (_blocks.mapped_file(view) is not None) == expected
    assert _blocks.mapped_file(np.zeros(3)) is None
    mapped[:] = 3
    window = _blocks.Window(mapped)
    for first, last in ((0, 5000), (100, 4000), (4999, 9000), (6000, 7000)):
        window.read_ahead(first, last)
        window.let_go(first, last)
    assert (mapped == 3).all()


# ---- streams ----


def test_a_stream_gives_what_a_batch_gives(hm: bw.HeightMap) -> None:
    origins, ways = rays(6000)
    edges = [0, 1, 1, 500, 3000, 6000]
    chunks = [(origins[a:b], ways[a:b]) for a, b in itertools.pairwise(edges)]
    for overlap, technique in itertools.product((True, False), ("exact", "relief")):
        hits = list(bw.march_stream(hm, iter(chunks), technique, overlap=overlap))
        assert [len(part) for part in hits] == [1, 0, 499, 2500, 3000]
        expected = bw.march(hm, origins, ways, technique)
        for name in expected.outputs:
            joined = np.concatenate([getattr(part, name) for part in hits])
            same_array(name, joined, getattr(expected, name), technique)
    assert list(bw.march_stream(hm, [])) == []
    lists = [([[0.1, 0.2, 1.0]], [[0.0, 0.0, -1.0]])]
    (only,) = bw.march_stream(hm, lists, "relief", outputs=("z", "status"))
    assert only.outputs == ("z", "status")
    shadow = next(iter(bw.march_stream(hm, [(origins * [1, 1, 0], -ways)], from_surface=True)))
    same(shadow, bw.march(hm, origins * [1, 1, 0], -ways, from_surface=True))


def test_a_stream_makes_the_next_chunk_meanwhile(hm: bw.HeightMap) -> None:
    made: list[int] = []

    def chunks() -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
        for number in range(6):
            made.append(number)
            yield rays(10, number)

    ahead = [len(made) for _ in bw.march_stream(hm, chunks())]
    assert ahead == [2, 3, 4, 5, 6, 6]
    made.clear()
    ahead = [len(made) for _ in bw.march_stream(hm, chunks(), overlap=False)]
    assert ahead == [1, 2, 3, 4, 5, 6]


def test_one_buffer_for_all_chunks(hm: bw.HeightMap) -> None:
    buffer = np.empty((1000, 3), np.float32)

    def chunks() -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
        for number in range(5):
            buffer[:], ways = rays(1000, number)
            yield buffer, ways

    for number, hits in enumerate(bw.march_stream(hm, chunks(), outputs=("t",), overlap=False)):
        np.testing.assert_array_equal(hits.t, bw.march(hm, *rays(1000, number)).t)


def test_bad_chunks(hm: bw.HeightMap) -> None:
    good = rays(20)
    bad = (good[0], good[1].copy())
    bad[1][7] = np.nan
    stream = bw.march_stream(hm, [good, good, bad, good])
    assert len(next(stream)) == len(next(stream)) == 20
    with pytest.raises(ValueError, match="chunk 2: ray 7: direction"):
        next(stream)
    assert list(stream) == []
    for chunk, error, message in (
        ((good[0], good[1][:-1]), ValueError, "chunk 0: 20 ray origins but 19"),
        ((good[0][:, :2], good[1]), ValueError, r"chunk 0: origins must have shape \(N, 3\)"),
        (good[0], TypeError, "chunk 0 must be a pair"),
        ((*good, good[0]), TypeError, "chunk 0 must be a pair"),
        (None, TypeError, "chunk 0 must be a pair"),
    ):
        with pytest.raises(error, match=message):
            list(bw.march_stream(hm, [chunk]))  # type: ignore[list-item]


def test_bad_settings_are_named_at_once(hm: bw.HeightMap) -> None:
    for call, error, message in (
        (lambda: bw.march_stream(3, []), TypeError, "HeightMap"),
        (lambda: bw.march_stream(hm, 3), TypeError, "iterable"),
        (lambda: bw.march_stream(hm, [], "flat"), ValueError, "does not march"),
        (lambda: bw.march_stream(hm, [], outputs=()), ValueError, "empty"),
        (lambda: bw.march_stream(hm, [], overlap=2), TypeError, "overlap"),
        (lambda: bw.march_stream(hm, [], from_surface=None), TypeError, "from_surface"),
    ):
        with pytest.raises(error, match=message):
            call()


def workers() -> list[str]:
    return [thread.name for thread in threading.enumerate() if thread.name.startswith("bumpwgpu-stream")]


def test_a_stream_ends_with_its_reader(hm: bw.HeightMap) -> None:
    def endless() -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
        while True:
            yield rays(1000)

    for number, _ in enumerate(bw.march_stream(hm, endless())):
        if number == 3:
            break
    stream = bw.march_stream(hm, endless())
    next(stream)
    assert workers()
    stream.close()  # type: ignore[attr-defined]
    assert not workers()

    def broken() -> Iterator[tuple[NDArray[Any], NDArray[Any]]]:
        yield rays(10)
        raise OSError("no more")

    with pytest.raises(OSError, match="no more"):
        list(bw.march_stream(hm, broken()))
    assert not workers()


HOPELESS = """
import numpy as np, bumpwgpu as bw
hm = bw.HeightMap.procedural("noise", 512)
origins = np.tile(np.float32([0.1, 0.2, 1.0]), (400_000, 1))
ways = np.tile(np.float32([1.0, 0.77, -1e-4]), (400_000, 1))
def chunks():
    while True: yield origins, ways
print("go", flush=True)
try:
    for _ in bw.march_stream(hm, chunks(), bw.techniques.Steep(steps=4096)): pass
except KeyboardInterrupt: print("stopped")
"""


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_stops_a_stream() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", HOPELESS], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "go\n"
    time.sleep(0.5)
    start = time.perf_counter()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert (out, err) == ("stopped\n", "")
    assert time.perf_counter() - start < 5


# ---- more than memory holds ----

FROM_FILES = """
import resource, sys, threading, time
import numpy as np, bumpwgpu as bw
folder, count = sys.argv[1], int(sys.argv[2])
hm = bw.HeightMap.procedural("fbm", 512)
peak, done = 0, False
def watch():
    global peak
    page = resource.getpagesize()
    while not done:
        with open("/proc/self/statm") as file:
            peak = max(peak, int(file.read().split()[1]) * page)
        time.sleep(0.005)
watcher = threading.Thread(target=watch)
watcher.start()
origins, ways = (np.load(f"{folder}/{name}.npy", mmap_mode="r") for name in ("origins", "ways"))
out = {"t": np.lib.format.open_memmap(f"{folder}/t.npy", "w+", np.float32, (count,))}
bw.march(hm, origins, ways, out=out)
done = True
watcher.join()
print(peak >> 20)
for first in range(0, count, max(1, count // 7)):
    part = bw.march(hm, origins[first:first + 1000], ways[first:first + 1000], outputs=("t",)).t
    np.testing.assert_array_equal(part, out["t"][first:first + 1000])
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_hundred_million_rays_in_files(tmp_path: Path) -> None:
    """2.4 GB of rays under 400 MB of memory, the process and its height map included."""
    count, step = 100_000_000, 4_000_000
    for name in ("origins", "ways"):
        array = np.lib.format.open_memmap(tmp_path / f"{name}.npy", "w+", np.float32, (count, 3))
        for first in range(0, count, step):
            array[first : first + step] = rays(step, first)[name == "ways"]
        array.flush()
        del array
    done = subprocess.run(
        [sys.executable, "-c", FROM_FILES, str(tmp_path), str(count)],
        capture_output=True,
        text=True,
        timeout=3000,
    )
    assert done.returncode == 0, done.stderr
    print(f"peak memory {done.stdout.strip()} MB")
    assert int(done.stdout) < 400
