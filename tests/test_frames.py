"""Tangents for plain arrays: every method, Blender's results, splitting and welding, bad input."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw
from bumpwgpu.frames import TANGENT_METHODS

SQUARE: dict[str, Any] = {
    "positions": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    "uvs": [[0, 1], [1, 1], [1, 0], [0, 0]],
}
TRIANGLES = [[0, 1, 2], [0, 2, 3]]


def degrees(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.float64]:
    a, b = a.astype(np.float64), b.astype(np.float64)
    apart, together = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    return np.asarray(np.degrees(2 * np.arctan2(apart, together)))


def corner_faces(sizes: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Corners in a row as quads; triangles repeat their last one."""
    start = np.concatenate(([0], np.cumsum(sizes, dtype=np.int64)[:-1]))
    last = np.where(sizes == 4, start + 3, start + 2)
    return np.column_stack((start, start + 1, start + 2, last)).astype(np.uint32)


def test_blender_agrees_at_every_corner(root: Path) -> None:
    golden = np.load(root / "tests" / "golden" / "blender_tangents.npz")
    faces = corner_faces(golden["sizes"])
    made = bw.tangents(golden["positions"], faces, golden["uvs"], golden["normals"], flip_v=True)
    found = np.zeros_like(golden["tangents"])
    found[faces] = made.tangents[made.indices]
    # Blender leaves (1, 0, 0) where the map gives nothing.
    known = (golden["tangents"][:, :3] != [1, 0, 0]).any(axis=1)
    assert known.mean() > 0.9
    assert (golden["tangents"][known, 3] < 0).any(), "there are mirrored corners"
    assert degrees(found[known, :3], golden["tangents"][known, :3]).max() < 0.01  # 0.0004 measured
    np.testing.assert_array_equal(found[known, 3], golden["tangents"][known, 3])
    # Negative control: triangles instead of quads, or v the other way, are not Blender's.
    halves = np.concatenate((faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]))
    halves = halves[halves[:, 1] != halves[:, 2]]
    other = bw.tangents(golden["positions"], halves, golden["uvs"], golden["normals"], flip_v=True)
    wrong = np.zeros_like(found)
    wrong[halves] = other.tangents[other.indices]
    assert degrees(wrong[known, :3], golden["tangents"][known, :3]).max() > 1
    down = bw.tangents(golden["positions"], faces, golden["uvs"], golden["normals"])
    assert (down.tangents[down.indices][..., 3].mean() > 0) != (golden["tangents"][:, 3].mean() > 0)


@pytest.mark.parametrize("method", TANGENT_METHODS)
def test_every_method_on_a_square(method: str) -> None:
    about = TANGENT_METHODS[method]
    assert about.name == method
    assert about.summary
    assert about.guarantee
    assert about.source
    made = bw.tangents(SQUARE["positions"], TRIANGLES, SQUARE["uvs"], method=method)
    np.testing.assert_allclose(made.tangents, [[1, 0, 0, 1]] * len(made.tangents), atol=1e-6)
    assert made.tangents.dtype == np.float32
    assert made.indices.dtype == made.source.dtype == np.uint32
    np.testing.assert_array_equal(made.source[made.indices], TRIANGLES)
    assert len(made.source) == (6 if method == "split" else 4)
    same = bw.Mesh(SQUARE["positions"], TRIANGLES, SQUARE["uvs"]).tangents(method)
    for ours, theirs in zip(made, same, strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_soup_welds_again() -> None:
    mesh = bw.Mesh.torus(0.7, 0.3, 24, 12)
    corners = mesh.indices.ravel()
    soup = [array[corners] for array in (mesh.positions, mesh.uvs, mesh.normals)]
    plain = bw.tangents(soup[0], None, soup[1], soup[2])
    np.testing.assert_array_equal(plain.source, np.arange(len(corners)))
    welded = bw.tangents(soup[0], None, soup[1], soup[2], weld=True)
    assert len(welded.source) == len(mesh.positions)
    # The same corners with the same tangents, whichever way they came.
    indexed = bw.tangents(mesh.positions, mesh.indices, mesh.uvs, mesh.normals)
    expected = indexed.tangents[indexed.indices]
    for made in (plain, welded):
        np.testing.assert_array_equal(soup[0][made.source][made.indices], mesh.positions[mesh.indices])
        np.testing.assert_array_equal(soup[1][made.source][made.indices], mesh.uvs[mesh.indices])
        assert degrees(made.tangents[made.indices].reshape(-1, 4), expected.reshape(-1, 4)).max() < 0.01


def test_mirrored_charts_split_and_carry_attributes() -> None:
    positions = np.array([[x, y, 0] for y in (1, 0) for x in (0, 1, 2)], np.float32)
    uvs = [[0, 0], [1, 0], [0, 0], [0, 1], [1, 1], [0, 1]]
    faces = [[3, 4, 1], [3, 1, 0], [4, 5, 2], [4, 2, 1]]
    made = bw.tangents(positions, faces, uvs)
    assert len(made.source) == 8
    np.testing.assert_array_equal(made.source[:6], np.arange(6))
    np.testing.assert_array_equal(positions[made.source][made.indices], positions[np.array(faces)])
    signs = made.tangents[made.indices][..., 3]
    np.testing.assert_array_equal(signs, [[1] * 3] * 2 + [[-1] * 3] * 2)


@pytest.mark.parametrize("method", TANGENT_METHODS)
@pytest.mark.parametrize(
    "uvs",
    [
        [[0.5, 0.5]] * 4,
        [[0, 0], [1, 1], [2, 2], [3, 3]],
        [[1e30, 1e30], [-1e30, 1e30], [1e30, -1e30], [0, 0]],
        [[0, 1e-40], [1e-40, 0], [0, 0], [0, 0]],
    ],
)
def test_degenerate_uvs_are_finite(method: str, uvs: list[list[float]]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bw.BumpWarning)
        made = bw.tangents(SQUARE["positions"], [*TRIANGLES, [0, 0, 1], [2, 2, 2]], uvs, method=method)
    np.testing.assert_allclose(np.linalg.norm(made.tangents[:, :3], axis=1), 1, atol=1e-3)
    assert set(np.unique(made.tangents[:, 3])) <= {-1.0, 1.0}


def call(**changes: Any) -> Callable[[], bw.Tangents]:
    return lambda: bw.tangents(**{**SQUARE, "indices": TRIANGLES, **changes})


REFUSED: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "method": (call(method="nope"), ValueError, "mikktspace"),
    "method kind": (call(method=3), TypeError, "string"),
    "quads": (call(indices=[[0, 1, 2, 3]], method="averaged"), ValueError, "quads"),
    "soup": (call(indices=None), ValueError, "4 vertices"),
    "index": (call(indices=[[0, 1, 9]]), ValueError, "vertex 9"),
    "quad index": (call(indices=[[0, 1, 2, 9]]), ValueError, "vertex 9"),
    "five": (call(indices=[[0, 1, 2, 3, 0]]), ValueError, r"\(N, 3\)"),
    "float": (call(indices=[[0.0, 1.0, 2.0]]), TypeError, "whole"),
    "NaN": (call(uvs=[[np.nan, 0]] * 4), ValueError, "NaN"),
    "normals": (call(normals=[[0, 0, 1]]), ValueError, "1 normals for 4"),
    "weld": (call(weld=1), TypeError, "weld"),
    "flip": (call(flip_v="yes"), TypeError, "flip_v"),
    "none": (call(positions=np.empty((0, 3)), uvs=np.empty((0, 2)), indices=None), ValueError, "at least"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    action, kind, message = REFUSED[name]
    with pytest.raises(kind, match=message):
        action()


def test_other_threads_run_meanwhile() -> None:
    mesh = bw.Mesh.torus(0.7, 0.3, 512, 256)
    arrays = mesh.positions, mesh.indices, mesh.uvs, mesh.normals
    ticks: list[float] = []
    done = threading.Event()

    def tick() -> None:
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    clock = threading.Thread(target=tick)
    clock.start()
    start = time.perf_counter()
    bw.tangents(*arrays)
    end = time.perf_counter()
    done.set()
    clock.join()
    assert sum(start < at < end for at in ticks) >= 3
