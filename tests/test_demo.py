"""The demo: a small version of it here, the whole of it among the slow tests."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
DEMO = ROOT / "examples" / "demo.py"

pytest.importorskip("matplotlib")


@pytest.fixture
def demo(load_example: Callable[[str], ModuleType]) -> ModuleType:
    return load_example("demo")


def check_output(folder: Path, text: str) -> None:
    """The page links files that exist, pictures show something, and the console says what to use."""
    page = (folder / "report.html").read_text()
    links = re.findall(r"(?:src|href)='([^']+)'", page)
    assert len(links) > 10
    assert [link for link in links if not (folder / link).is_file()] == []
    pictures = list((folder / "pictures").glob("*.png"))
    assert {path.stem.split("_")[1] for path in pictures} == {"quad", "cube", "torus"}
    for path in pictures:
        rgba = np.asarray(Image.open(path))
        assert (rgba[..., 3] == 255).mean() > 0.2, path.name
        assert rgba[rgba[..., 3] == 255][:, :3].std() > 5.0, path.name
    for name in ("terrain, map", "bricks, map", "bricks, torus"):
        assert name in text
    assert "report.html" in text


@pytest.mark.gpu
def test_small_demo(
    demo: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(demo, "SIZE", (48, 40))
    monkeypatch.setattr(demo, "TECHNIQUES", ("flat", "relief"))
    monkeypatch.setattr(demo, "COMPARED", ("relief", "exact"))
    monkeypatch.setattr(demo, "ELEVATIONS", (45,))
    monkeypatch.setattr(sys, "argv", ["demo.py", "--output", str(tmp_path / "out")])
    demo.main()
    check_output(tmp_path / "out", capsys.readouterr().out)


def test_terrain_is_in_metres(demo: ModuleType) -> None:
    subject = demo.terrain()
    assert subject.height.shape == (344, 403)
    # 840 m of relief over 30 km, and one degree of longitude is shorter than one of latitude.
    assert subject.height.scale == pytest.approx(840 / 30_000, rel=0.01)
    assert subject.height.tile_size == (1.0, pytest.approx(31.9 / 30.0, rel=0.01))


@pytest.mark.gpu
@pytest.mark.slow
def test_whole_demo_within_a_minute(tmp_path: Path) -> None:
    began = time.monotonic()
    command = [sys.executable, str(DEMO), "--output", str(tmp_path / "out")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    seconds = time.monotonic() - began
    assert done.returncode == 0, done.stderr
    check_output(tmp_path / "out", done.stdout)
    assert seconds < 60.0
