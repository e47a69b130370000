"""The wheel in an empty environment, with a Vulkan device and without any."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

# Everything below runs in the empty environment, from a folder that is not the checkout.
PLANAR = """
import numpy as np
import bumpwgpu as bw

assert ".venv" not in bw.__file__.split("/"), bw.__file__
hm = bw.HeightMap.procedural("bricks", size=64)
maps = bw.bake(hm, maps=("normal", "pyramid"))
assert maps["normal"].shape == (64, 64, 3)
maps.save("maps")
hits = bw.march(hm, np.array([[0.5, 0.5, 2.0]]), np.array([[0.1, 0.2, -1.0]]))
assert hits.status[0] == 0 and 0.0 <= hits.z[0] <= 1.0
result = bw.compare(hm, techniques=["relief", "exact"], elevations=(45,), device="cpu")
assert {row["technique"] for row in result.rows} == {"relief", "exact"}
"""

RENDER = """
import bumpwgpu as bw

hm = bw.HeightMap.procedural("bricks", size=64)
camera = bw.Camera.look_at((0, 0, 3), (0, 0, 0))
light = bw.Light.directional((-1, -1, -1))
scene = dict(camera=camera, lights=[light], technique="relief", size=(33, 17))
"""

DRAW = """
frame = bw.render(bw.Mesh.quad(), bw.Material(height=hm), **scene)
assert frame.color.shape == (17, 33, 4), frame.color.shape
frame.save("frame.png")
"""

REFUSE = """
try:
    bw.render(bw.Mesh.quad(), bw.Material(height=hm), **scene)
except bw.RenderError as error:
    print(error)
else:
    raise SystemExit("render worked without a device")
"""


def run(command: list[str | Path], cwd: Path, env: dict[str, str] | None = None) -> str:
    """The output of a command that must succeed."""
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def build(folder: Path, source: Path, out: Path) -> Path:
    """Builds the wheel of the sources in `source`, with the checkout's own build cache."""
    environment = os.environ | {"CARGO_TARGET_DIR": str(ROOT / "target")}
    command = [sys.executable, "-m", "maturin", "build", "--release", "--quiet", "--out", out]
    run([*command, "--manifest-path", source / "crates/python/Cargo.toml"], folder, environment)
    (wheel,) = out.glob("*.whl")
    return wheel


def install(wheel: Path, folder: Path) -> Path:
    """Installs the wheel into a new environment; its python."""
    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", wheel], folder)
    return python


def clean_environment() -> dict[str, str]:
    """The environment without what would let the checkout in."""
    return {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL_ENV"))}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(ROOT, ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(wheel, tmp_path_factory.mktemp("empty") / "venv")


def test_one_abi3_wheel_with_types(wheel: Path) -> None:
    assert re.fullmatch(r"bumpwgpu-[\d.]+-cp310-abi3-\w+\.whl", wheel.name)
    names = zipfile.ZipFile(wheel).namelist()
    assert "bumpwgpu/py.typed" in names
    assert any(name.endswith(".pyi") for name in names)
    assert sum(name.endswith(".so") or name.endswith(".pyd") for name in names) == 1
    assert any(name.endswith("LICENSE-MIT") for name in names)
    assert not any(name.startswith(("tests", "examples")) for name in names)


def test_planar_work_from_another_folder(python: Path, tmp_path: Path) -> None:
    run([python, "-c", PLANAR], tmp_path, clean_environment())
    assert list((tmp_path / "maps").iterdir())


def test_the_command_line_answers(python: Path, tmp_path: Path) -> None:
    assert "compare" in run([python.with_name("bumpwgpu"), "--help"], tmp_path, clean_environment())


@pytest.mark.gpu
def test_render_from_another_folder(python: Path, tmp_path: Path) -> None:
    run([python, "-c", RENDER + DRAW], tmp_path, clean_environment())
    assert (tmp_path / "frame.png").stat().st_size > 100


@pytest.fixture(params=["no driver", "no loader"])
def no_vulkan(request: pytest.FixtureRequest, tmp_path: Path) -> dict[str, str]:
    """An environment in which Vulkan has no driver, or in which libvulkan cannot be loaded."""
    environment = clean_environment()
    if request.param == "no driver":
        return environment | {"VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"}
    hidden = tmp_path / "hidden"
    hidden.mkdir()
    for name in ("libvulkan.so", "libvulkan.so.1"):
        (hidden / name).write_bytes(b"not a library")
    return environment | {"LD_LIBRARY_PATH": str(hidden)}


@pytest.mark.skipif(sys.platform != "linux", reason="hides Vulkan the way Linux finds it")
def test_without_vulkan(python: Path, tmp_path: Path, no_vulkan: dict[str, str]) -> None:
    run([python, "-c", PLANAR], tmp_path, no_vulkan)
    message = run([python, "-c", RENDER + REFUSE], tmp_path, no_vulkan)
    assert "Vulkan" in message
    assert "mesa-vulkan-drivers" in message


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_import_touches_no_gpu(python: Path, tmp_path: Path) -> None:
    code = "import bumpwgpu; print(open('/proc/self/maps').read())"
    assert "libvulkan" not in run([python, "-c", code], tmp_path, clean_environment())


@pytest.mark.slow
def test_source_distribution_builds_from_itself(tmp_path: Path) -> None:
    run([sys.executable, "-m", "maturin", "sdist", "--out", tmp_path], ROOT)
    (archive,) = tmp_path.glob("*.tar.gz")
    run(["tar", "xzf", archive], tmp_path)
    (source,) = (path for path in tmp_path.iterdir() if path.is_dir())
    built = build(source, source, tmp_path / "wheels")
    run([install(built, tmp_path / "venv"), "-c", PLANAR], tmp_path, clean_environment())
