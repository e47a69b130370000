"""The pytest plugin: goldens are written when asked for, hold, and fail when something changes."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import bumpwgpu as bw
from bumpwgpu.pytest_plugin import BumpRegression

SUITE = """
import numpy as np
import bumpwgpu as bw

def test_wall(bump_regression):
    wall = bw.HeightMap.procedural("bricks", 32, scale={scale})
    bump_regression.normals("normal", bw.bake(wall)["normal"], degrees=0.1)
    bump_regression.values("heights", wall.array)
"""


def suite(folder: Path, *words: str, scale: float = 0.1) -> subprocess.CompletedProcess[str]:
    (folder / "test_wall.py").write_text(SUITE.format(scale=scale))
    command = [sys.executable, "-m", "pytest", "-q", "--rootdir", str(folder)]
    installed = importlib.metadata.entry_points(group="pytest11")
    if not any(point.value == "bumpwgpu.pytest_plugin" for point in installed):
        # An installation from before the plugin: it has to be named.
        command += ["-p", "bumpwgpu.pytest_plugin"]
    return subprocess.run(
        [*command, *words, str(folder)], capture_output=True, text=True, timeout=120, check=False
    )


def test_a_whole_session(tmp_path: Path) -> None:
    missing = suite(tmp_path)
    assert missing.returncode == 1
    assert "--bump-update" in missing.stdout
    assert suite(tmp_path, "--bump-update").returncode == 0
    goldens = sorted(path.name for path in (tmp_path / "bump_goldens" / "test_wall").iterdir())
    assert goldens == ["test_wall--heights.npz", "test_wall--normal.npz"]
    assert suite(tmp_path).returncode == 0
    changed = suite(tmp_path, scale=0.11)
    assert changed.returncode == 1
    assert "degrees (allowed 0.1)" in changed.stdout
    assert "normal differs from its golden" in changed.stdout


@pytest.fixture
def pair(tmp_path: Path) -> tuple[BumpRegression, Any]:
    """One that writes, and a maker of ones that check."""
    return BumpRegression(tmp_path, "t", True), lambda: BumpRegression(tmp_path, "t", False)


def test_hits_are_held_in_texels_and_degrees(pair: Any) -> None:
    write, check = pair
    rng = np.random.default_rng(1)
    wall = bw.HeightMap.procedural("sines", 32)
    origins = np.concatenate([rng.random((200, 2)), np.ones((200, 1))], axis=1)
    directions = np.concatenate([rng.random((200, 2)) - 0.5, -np.ones((200, 1))], axis=1)
    hits = bw.march(wall, origins, directions)
    write.hits("view", hits, wall.shape)
    check().hits("view", hits, wall.shape, texels=0.0, degrees=0.0)

    def other(**changes: Any) -> SimpleNamespace:
        kept = {"uv": hits.uv, "normal": hits.normal, "status": hits.status, "outputs": hits.outputs}
        return SimpleNamespace(**{**kept, **changes})

    check().hits("view", other(uv=hits.uv + 3.0), wall.shape)
    moved = other(uv=hits.uv + np.float32(0.2 / 32))
    with pytest.raises(pytest.fail.Exception, match=r"texels \(allowed 0.1\)"):
        check().hits("view", moved, wall.shape)
    check().hits("view", moved, wall.shape, texels=0.3)
    lost = hits.status.copy()
    lost[0] = 1
    with pytest.raises(pytest.fail.Exception, match=r"0\.50%"):
        check().hits("view", other(status=lost), wall.shape)
    check().hits("view", other(status=lost), wall.shape, share=0.01)
    tilted = hits.normal + np.array([0.1, 0.0, 0.0], np.float32)
    with pytest.raises(pytest.fail.Exception, match="degrees"):
        check().hits("view", other(normal=tilted), wall.shape)
    with pytest.raises(pytest.fail.Exception, match="shape"):
        check().hits("view", bw.march(wall, origins[:5], directions[:5]), wall.shape)


def test_values_and_pictures_are_held(pair: Any) -> None:
    write, check = pair
    values = np.linspace(0.0, 1.0, 100)
    write.values("ramp", values)
    check().values("ramp", values + 0.5e-4)
    with pytest.raises(pytest.fail.Exception, match="ramp differs"):
        check().values("ramp", values + 2e-4)
    with pytest.raises(pytest.fail.Exception, match=r"100\.00%"):
        check().values("ramp", values * np.nan)
    color = np.full((8, 8, 4), 100, np.uint8)
    aovs = {"uv": np.zeros((8, 8, 2), np.float32), "normal": np.tile(np.float32([0, 0, 1]), (8, 8, 1))}
    write.frame("picture", SimpleNamespace(color=color, aovs=aovs), (16, 16))
    check().frame("picture", SimpleNamespace(color=color + np.uint8(3), aovs=aovs), (16, 16))
    with pytest.raises(pytest.fail.Exception, match="levels"):
        check().frame("picture", SimpleNamespace(color=color + np.uint8(9), aovs=aovs), (16, 16))
    moved = {**aovs, "uv": aovs["uv"] + np.float32(0.1)}
    with pytest.raises(pytest.fail.Exception, match="texels"):
        check().frame("picture", SimpleNamespace(color=color, aovs=moved), (16, 16))
    tilted = {**aovs, "normal": np.tile(np.float32([0.2, 0, 1]), (8, 8, 1))}
    with pytest.raises(pytest.fail.Exception, match="degrees"):
        check().frame("picture", SimpleNamespace(color=color, aovs=tilted), (16, 16))


def test_names_are_checked(pair: Any) -> None:
    write, _ = pair
    write.values("one", [1.0])
    with pytest.raises(ValueError, match="twice"):
        write.values("one", [1.0])
    with pytest.raises(ValueError, match="letters"):
        write.values("../one", [1.0])
