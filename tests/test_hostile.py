"""Hostile files and senseless arguments over every entry point: a documented exception, or a result.

Each file is tried in a child process of its own batch, so a crash, a hang or a word on stderr is caught.
"""

from __future__ import annotations

import itertools
import math
import os
import subprocess
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bumpwgpu as bw

CORPUS = Path(__file__).parent / "hostile"
IMAGES = {".png", ".tif", ".tiff", ".exr", ".jpg", ".jpeg", ".webp", ".bmp", ".tga", ".npy"}
MESHES = {".obj", ".gltf", ".glb"}
# What the documentation promises for anything that is wrong.
DOCUMENTED = (bw.BumpError, ValueError, TypeError, OSError)
BATCH = 40
SECONDS_PER_BATCH = 120

TRY_FILES = """
import sys, warnings
import bumpwgpu as bw
warnings.simplefilter("ignore")
images, meshes = {images!r}, {meshes!r}
for path in sys.stdin.read().splitlines():
    suffix = path[path.rfind("."):].lower()
    print(path, end="\\t", flush=True)
    try:
        if suffix in meshes:
            mesh = bw.Mesh.open(path)
            mesh.tangents()
            mesh.load_materials()
        else:
            bw.bake(bw.HeightMap(path, channel=0, height_range="auto"), ("normal", "pyramid"))
        print("ok")
    except (bw.BumpError, ValueError, TypeError, OSError) as error:
        text = str(error)
        assert text and "internal error" not in text and "panicked" not in text, text
        print(type(error).__name__)
"""


def replay(files: list[Path]) -> dict[str, str]:
    """What became of each file: "ok" or the name of its exception."""
    code = TRY_FILES.format(images=IMAGES, meshes=MESHES)
    outcomes: dict[str, str] = {}
    for start in range(0, len(files), BATCH):
        batch = files[start : start + BATCH]
        done = subprocess.run(
            [sys.executable, "-c", code],
            input="\n".join(map(str, batch)),
            capture_output=True,
            text=True,
            timeout=SECONDS_PER_BATCH,
        )
        lines = done.stdout.splitlines()
        assert done.returncode == 0, f"{lines[-1] if lines else ''}: {done.stderr}"
        assert done.stderr == ""
        outcomes.update(line.split("\t") for line in lines)
    assert len(outcomes) == len(files)
    return outcomes


def files_below(folder: Path, suffixes: set[str]) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in suffixes and path.is_file())


def test_the_corpus() -> None:
    files = files_below(CORPUS, IMAGES | MESHES)
    assert len(files) > 20
    outcomes = replay(files)
    for path in files:
        if "refused" in path.parts:
            assert outcomes[str(path)] != "ok", path
        if "accepted" in path.parts and path.suffix.lower() in MESHES:
            # The mesh is good; an image that it carries may not be.
            assert outcomes[str(path)] in ("ok", "BakeError"), path


def test_malformed_assets(assets: Path) -> None:
    files = files_below(assets / "malformed", IMAGES | MESHES)
    assert len(files) > 100
    outcomes = replay(files)
    corrupt = [path for path in files if path.name.startswith("x") and path.parent.name == "pngsuite"]
    # A bad checksum of the data is let through by some decoders; the rest is plainly broken.
    assert sum(outcomes[str(path)] != "ok" for path in corrupt) >= len(corrupt) - 1


def test_cut_and_flipped_files(tmp_path: Path) -> None:
    """Every kind of file we write, cut short and with bytes changed."""
    bw.bake(bw.HeightMap.procedural("noise", 24)).save(tmp_path, format="exr")
    maps = bw.bake(bw.HeightMap.procedural("noise", 24))
    good = maps.save(tmp_path, format="png", bits=16) + maps.save(tmp_path, format="npy")
    good.append(tmp_path / "normal.exr")
    rng = np.random.default_rng(0)
    files = []
    for path in good:
        data = path.read_bytes()
        for trial in range(24):
            changed = bytearray(data)
            if trial % 2:
                changed = changed[: int(rng.integers(len(data)))]
            else:
                for _ in range(1 + trial // 4):
                    changed[int(rng.integers(min(len(data), 400)))] = int(rng.integers(256))
            made = tmp_path / f"{path.stem}_{trial}{path.suffix}"
            made.write_bytes(changed)
            files.append(made)
    outcomes = replay(files)
    assert "ok" not in {outcomes[str(f)] for f in files if f.stat().st_size < 60}


# One of everything that is no sensible argument.
SENSELESS: list[Any] = [
    None,
    True,
    -1,
    0,
    10**30,
    2**63,
    -(2**63) - 1,
    1.5,
    math.nan,
    math.inf,
    -math.inf,
    1e308,
    1e-320,
    1j,
    "",
    "relief",
    "\0",
    "\ud800",
    "x" * 100_000,
    b"",
    b"\xff",
    (),
    [],
    {},
    set(),
    [[]],
    [[[]]],
    (1,),
    (1, 2),
    (1, 2, 3),
    (math.nan, 0, 0),
    [1, "two", None],
    {"a": 1},
    object(),
    int,
    len,
    range(3),
    Decimal("1.5"),
    Fraction(1, 3),
    np.float32(2),
    np.int64(-3),
    np.array(1.0),
    np.empty((0, 3)),
    np.zeros((0, 0)),
    np.full((2, 3), np.nan),
    np.zeros((2, 3), complex),
    np.zeros((2, 3), object),
    np.zeros((2, 3), "M8[s]"),
    np.zeros((2, 3), [("x", "f4")]),
    np.zeros((1, 1, 1, 1)),
    np.array(["a", "b"]),
    np.zeros((3, 3))[::-1, ::-1],
    np.array([np.zeros(3)]),
    iter([1, 2]),
    (x for x in ()),
    Path("/nonexistent/place.png"),
    Path("."),
]

HM = bw.HeightMap.procedural("noise", 8)
MESH = bw.Mesh.quad()
RAY = ([[0.5, 0.5, 1.0]], [[0.1, 0.0, -1.0]])
CAMERA = bw.Camera.look_at((0, 0, 2), (0, 0, 0))
TRIANGLE = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [[0, 0], [1, 0], [0, 1]])


def entry_points(folder: Path) -> dict[str, Callable[[Any], Any]]:
    """Every public function with one argument replaced."""
    maps = bw.bake(HM)
    calls: dict[str, Callable[[Any], Any]] = {
        "HeightMap": lambda x: bw.HeightMap(x),
        "HeightMap auto": lambda x: bw.HeightMap(x, height_range="auto", channel=0),
        "procedural name": lambda x: bw.HeightMap.procedural(x, 8),
        "procedural size": lambda x: bw.HeightMap.procedural("flat", x),
        "procedural seed": lambda x: bw.HeightMap.procedural("noise", 8, x),
        "march map": lambda x: bw.march(x, *RAY),
        "march origins": lambda x: bw.march(HM, x, RAY[1]),
        "march directions": lambda x: bw.march(HM, RAY[0], x),
        "march technique": lambda x: bw.march(HM, *RAY, x),
        "technique": lambda x: bw.techniques.get(x),
        "linear": lambda x: bw.techniques.Relief(linear=x),
        "bake": lambda x: bw.bake(x),
        "bake maps": lambda x: bw.bake(HM, x),
        "save": lambda x: maps.save(folder / "saved", format=x),
        "save bits": lambda x: maps.save(folder / "saved", bits=x),
        "save prefix": lambda x: maps.save(folder / "saved", prefix=x),
        "Mesh.open": lambda x: bw.Mesh.open(x),
        "quad": lambda x: bw.Mesh.quad(x),
        "cube": lambda x: bw.Mesh.cube(x),
        "sphere radius": lambda x: bw.Mesh.sphere(x, 8),
        "sphere segments": lambda x: bw.Mesh.sphere(1, x),
        "torus": lambda x: bw.Mesh.torus(x, 0.1, 8, 8),
        "torus minor": lambda x: bw.Mesh.torus(1, x, 8, 8),
        "positions": lambda x: bw.Mesh(x, *TRIANGLE[1:]),
        "indices": lambda x: bw.Mesh(TRIANGLE[0], x, TRIANGLE[2]),
        "uvs": lambda x: bw.Mesh(*TRIANGLE[:2], x),
        "normals": lambda x: bw.Mesh(*TRIANGLE, normals=x),
        "tangents": lambda x: bw.Mesh(*TRIANGLE, tangents=x),
        "tangent method": lambda x: MESH.tangents(x),
        "material scale": lambda x: MESH.load_materials(scale=x),
        "eye": lambda x: bw.Camera.look_at(x, (0, 0, 9)),
        "target": lambda x: bw.Camera.look_at((0, 0, 9), x),
        "up": lambda x: bw.Camera.look_at((0, 0, 9), (0, 0, 0), x),
        "fov_y": lambda x: bw.Camera.look_at((0, 0, 9), (0, 0, 0), fov_y=x),
        "directional": lambda x: bw.Light.directional(x),
        "point": lambda x: bw.Light.point(x),
        "color": lambda x: bw.Light.point((0, 0, 1), x),
        "intensity": lambda x: bw.Light.point((0, 0, 1), intensity=x),
        "compare": lambda x: bw.compare(x, "parallax", device="cpu", rays=8, repeats=1),
        "compare techniques": lambda x: bw.compare(HM, x or "parallax", device="cpu", rays=8, repeats=1),
    }
    for name in ("scale", "base", "tile_size", "wrap", "channel", "invert", "height_range"):
        calls[f"HeightMap {name}"] = lambda x, name=name: bw.HeightMap([[0.0, 1.0]], **{name: x})
    for name in ("scale", "base", "tile_size"):
        calls[f"replace {name}"] = lambda x, name=name: HM.replace(**{name: x})
    for name in ("device", "outputs", "from_surface"):
        calls[f"march {name}"] = lambda x, name=name: bw.march(HM, *RAY, **{name: x})
    for name in ("kernel", "convention", "progress", "scale"):
        calls[f"bake {name}"] = lambda x, name=name: bw.bake(HM, **{name: x})
    for name in ("height", "albedo", "normal", "specular", "shininess", "normal_convention", "double_sided"):
        calls[f"Material {name}"] = lambda x, name=name: bw.Material(**{name: x})
    for name in ("elevations", "device", "rays", "repeats", "seed", "progress"):
        fixed = {"device": "cpu", "rays": 8, "repeats": 1}
        calls[f"compare {name}"] = lambda x, name=name, fixed=fixed: bw.compare(
            HM, "parallax", **{**fixed, name: x}
        )
    return calls


def survives(call: Callable[[Any], Any], argument: Any) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            call(argument)
        except DOCUMENTED as error:
            text = str(error)
            assert text, "an exception without a message"
            assert "internal error" not in text, text


NAMES = list(entry_points(Path()))


@pytest.mark.parametrize("name", NAMES)
def test_senseless_arguments(name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    call = entry_points(tmp_path)[name]
    for argument in SENSELESS:
        if isinstance(argument, Iterator):
            argument = iter([1, 2])
        survives(call, argument)
    # Mesa's drivers talk about their environment when a device is looked for; that is all.
    err = [line for line in capfd.readouterr().err.splitlines() if "XDG_RUNTIME_DIR" not in line]
    assert err == []
    saved = tmp_path / "saved"
    if saved.exists():
        assert not [path for path in saved.iterdir() if path.suffix not in (".png", ".exr", ".npy", ".json")]


def draw(arguments: dict[str, Any]) -> bw.Frame:
    mesh, material = arguments.pop("mesh"), arguments.pop("material", None)
    return bw.render(mesh, material, **arguments)


@pytest.mark.gpu
def test_senseless_renderings(capfd: pytest.CaptureFixture[str]) -> None:
    fixed: dict[str, Any] = {"camera": CAMERA, "size": 8, "technique": "flat"}
    for name in ("mesh", "material", *fixed, "lights", "shadows", "aovs", "device", "ambient", "background"):
        for argument in SENSELESS:
            arguments = {"mesh": MESH, **fixed, name: argument}
            survives(
                lambda given: bw.render(given.pop("mesh"), given.pop("material", None), **given), arguments
            )
    err = [line for line in capfd.readouterr().err.splitlines() if "XDG_RUNTIME_DIR" not in line]
    assert err == []


@pytest.mark.gpu
def test_extreme_scenes() -> None:
    """Legal but absurd: everything drawn is finite, nothing hangs."""
    maps = [
        bw.HeightMap([[1.0]]),
        bw.HeightMap([[0.0]]),
        bw.HeightMap.procedural("noise", (1, 64)),
        bw.HeightMap.procedural("noise", 16, scale=0.0),
        bw.HeightMap.procedural("noise", 16, scale=1e6),
        bw.HeightMap.procedural("dot", 16, tile_size=(1e-6, 1e6)),
    ]
    cameras = [
        bw.Camera.look_at((0, -5, 1e-3), (0, 0, 0)),
        bw.Camera.look_at((0, 0, 1e-4), (0, 0, 0)),
        bw.Camera.look_at((1e6, 0, 1e6), (0, 0, 0), fov_y=0.1),
        bw.Camera.look_at((0, 0, -2), (0, 0, 0), fov_y=179),
    ]
    lights = [bw.Light.directional((1, 0, -1e-9)), bw.Light.point((0, 0, 0)), bw.Light.point((0, 0, 1e30))]
    for hm, camera in itertools.product(maps, cameras):
        for technique in ("bump", "dot3", "parallax", "relief", "exact"):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                frame = bw.render(
                    MESH,
                    bw.Material(height=hm),
                    camera=camera,
                    lights=lights,
                    technique=technique,
                    size=(9, 7),
                    aovs=("depth", "uv", "mask", "normal"),
                )
            seen = frame.aovs["mask"] == 1
            for name, values in frame.aovs.items():
                assert np.isfinite(values[seen]).all(), (name, hm, camera, technique)


@pytest.mark.parametrize("technique", bw.techniques.marching())
def test_extreme_rays(technique: str) -> None:
    """Every finite ray has an answer: inside, outside, straight up, horizontal, vast and tiny."""
    values = [-1e30, -3.0, -1e-30, 0.0, 1e-30, 0.5, 1e30]
    origins = list(itertools.product([-1e12, 0.0, 0.5], [0.25], [-1.0, 0.0, 0.5, 1.0, 2.0, 1e12]))
    ways = [way for way in itertools.product(values, repeat=3) if any(way)]
    # Some of them run for ever between the peaks, and take milliseconds to give up.
    rng = np.random.default_rng(0)
    starts = np.array(origins)[rng.integers(len(origins), size=300)]
    directions = np.array(ways)[rng.integers(len(ways), size=300)]
    for hm in (HM, bw.HeightMap([[0.5]]), bw.HeightMap(HM.array, wrap="clamp")):
        for dtype in (np.float64, np.float32):
            hits = bw.march(hm, starts.astype(dtype), directions.astype(dtype), technique)
            assert np.isin(hits.status, (0, 1, 2)).all()
            assert not np.isnan(hits.t).any()
            assert (hits.t[hits.status == 0] >= 0).all()
            assert np.isinf(hits.t[hits.status != 0]).all()


def test_a_full_disk_or_a_forbidden_folder_leaves_nothing(tmp_path: Path) -> None:
    if os.name != "posix" or not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    code = """
        import resource, signal, sys, bumpwgpu as bw
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        maps = bw.bake(bw.HeightMap.procedural("noise", 128))
        for format in ("png", "exr", "npy"):
            try: maps.save(sys.argv[1], format=format)
            except (bw.BakeError, OSError): print("refused")
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code), str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout.split() == ["refused"] * 3, done.stderr
    assert list(tmp_path.iterdir()) == []
