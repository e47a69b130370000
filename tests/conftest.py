"""What all tests share: the folders, the device gate and the optional real assets."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent


def pytest_configure() -> None:
    """Lets children be interrupted: what a shell starts in the background inherits an ignored SIGINT.

    Costly maps are kept in a folder of these tests, not in the user's.
    """
    os.environ["BUMPWGPU_CACHE"] = tempfile.mkdtemp(prefix="bumpwgpu-test-cache-")
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_unconfigure() -> None:
    """Removes that folder."""
    shutil.rmtree(os.environ["BUMPWGPU_CACHE"], ignore_errors=True)


@pytest.fixture(scope="session")
def root() -> Path:
    """The checkout."""
    return ROOT


@pytest.fixture(scope="session")
def load_example() -> Callable[[str], ModuleType]:
    """Loads one of the examples by its name, anew each time."""

    def load(name: str) -> ModuleType:
        spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        return module

    return load


@pytest.fixture(scope="session")
def assets() -> Path:
    """Real assets, not part of the project: the folder BUMPWGPU_TEST_DATA, or ../shared/data."""
    folder = Path(os.environ.get("BUMPWGPU_TEST_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real assets in {folder}")
    return folder


@pytest.fixture(scope="session")
def _device_problem() -> str | None:
    import bumpwgpu as bw

    mesh = bw.Mesh.quad()
    material = bw.Material(height=bw.HeightMap([[0.5]]))
    camera = bw.Camera.look_at((0, 0, 3), (0, 0, 0))
    try:
        bw.render(mesh, material, camera=camera, lights=[], technique="flat", size=(8, 8), shadows=False)
    except bw.RenderError as error:
        return str(error)
    return None


@pytest.fixture
def gpu(_device_problem: str | None) -> None:
    """Skips when no Vulkan device answers; fails instead when BUMPWGPU_REQUIRE_GPU=1."""
    if _device_problem is None:
        return
    if os.environ.get("BUMPWGPU_REQUIRE_GPU") == "1":
        pytest.fail(f"a Vulkan device is required: {_device_problem}")
    pytest.skip(f"no Vulkan device: {_device_problem}")


@pytest.fixture(autouse=True)
def _gate(request: pytest.FixtureRequest) -> None:
    """Lets `@pytest.mark.gpu` stand for the `gpu` fixture."""
    if request.node.get_closest_marker("gpu"):
        request.getfixturevalue("gpu")
