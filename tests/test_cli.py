"""The command line: what it writes, what it prints, how it exits."""

from __future__ import annotations

import inspect
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import bumpwgpu as bw
from bumpwgpu import cli
from bumpwgpu._cli_tools import CHECK_FAILED
from bumpwgpu.baking import MAPS, about


def run(*words: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from bumpwgpu.cli import main; main()", *map(str, words)]
    environment = {**os.environ, "NO_COLOR": "1", "COLUMNS": "200", "TERM": "dumb"}
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=180)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    heights = bw.HeightMap.procedural("bricks", 32).array
    Image.fromarray((heights * 65535).round().astype(np.uint16)).save(tmp_path / "height.png")
    return tmp_path


def test_bake(folder: Path) -> None:
    done = run("bake", "height.png", "--maps", "normal,relief", "-o", "out", "--bits", 16, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(Path("out") / "normal.png"), str(Path("out") / "relief.png")]
    assert done.stderr == ""
    expected = bw.bake(bw.HeightMap(folder / "height.png"))["normal"]
    red = bw.HeightMap(folder / "out" / "normal.png", channel="r").array
    np.testing.assert_allclose(red * 2 - 1, expected[:, :, 0], atol=1e-4)


def test_bake_options_reach_the_bake(folder: Path) -> None:
    words = (
        "--scale 0.5 --tile-size 2 1 --wrap clamp --invert --kernel scharr --convention directx --format npy"
    )
    done = run("bake", "height.png", "--prefix", "wall", *words.split(), "-o", ".", cwd=folder)
    assert done.returncode == 0, done.stderr
    hm = bw.HeightMap(folder / "height.png", scale=0.5, tile_size=(2, 1), wrap="clamp", invert=True)
    expected = bw.bake(hm, kernel="scharr", convention="directx")["normal"]
    np.testing.assert_array_equal(np.load(folder / "wall_normal.npy"), expected)


def test_every_option_of_every_map_is_a_flag(folder: Path) -> None:
    text = run("bake", "--help", cwd=folder).stdout
    for name in MAPS:
        for option in about(name).options:
            assert f"--{option.name.replace('_', '-')} " in text


def test_json_and_quiet(folder: Path) -> None:
    done = run("bake", "height.png", "--json", cwd=folder)
    data = json.loads(done.stdout)
    assert data["files"] == [str(Path("maps") / "normal.png")]
    assert (data["width"], data["bits"]) == (32, 16)
    quiet = run("bake", "height.png", "-q", cwd=folder)
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")


def test_warnings_are_one_line(folder: Path) -> None:
    Image.fromarray(np.zeros((8, 8), np.uint8)).save(folder / "lossy.jpg")
    done = run("bake", "lossy.jpg", cwd=folder)
    assert done.returncode == 0
    assert re.fullmatch(r"warning: lossy\.jpg: .*\n", done.stderr)
    assert run("bake", "lossy.jpg", "-q", cwd=folder).stderr == ""


@pytest.mark.gpu
def test_render(folder: Path) -> None:
    words = "--mesh torus --technique relief(linear=16,refine=4) --size 64 48 --aovs depth,uv --shadows -v"
    done = run("render", "height.png", *words.split(), "-o", "torus.png", cwd=folder)
    assert done.returncode == 0, done.stderr
    with Image.open(folder / "torus.png") as image:
        assert image.size == (64, 48)
        assert np.asarray(image)[:, :, 3].max() == 255
    assert np.load(folder / "torus_depth.npy").shape == (48, 64)
    assert "draw_ms" in done.stdout
    camera = "--eye 0,-1,1 --target 0,0,0 --fov-y 30 --light 1,0,-1 --light=-1,0,-1 --size 32 32 --json"
    done = run("render", "height.png", *camera.split(), cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["files"] == ["render.png"]


@pytest.mark.gpu
def test_render_a_mesh_with_its_own_material(folder: Path) -> None:
    (folder / "a.mtl").write_text("newmtl m\nmap_Bump height.png\n")
    (folder / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n"
    )
    done = run("render", "a.obj", "--size", 32, 32, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "render.png").exists()


def test_compare(folder: Path) -> None:
    words = "--techniques steep(steps=8),exact --elevations 45,10 --device cpu --rays 200 --repeats 1"
    files = "--report report.html --rows rows.json"
    done = run("compare", "height.png", *words.split(), *files.split(), cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "exact" in done.stdout
    assert (folder / "report.html").read_text().startswith("<!")
    assert json.loads((folder / "rows.json").read_text())["rows"]
    done = run("compare", "height.png", *words.split(), "--json", cwd=folder)
    assert json.loads(done.stdout)["recommendation"] == "exact"


def test_info_and_version(folder: Path) -> None:
    done = run("info", "--json", cwd=folder)
    assert json.loads(done.stdout)["version"] == bw.__version__
    assert bw.__version__ in run("info", cwd=folder).stdout
    assert run("--version", cwd=folder).stdout == f"bumpwgpu {bw.__version__}\n"


USAGE = [
    "",
    "paint height.png",
    "bake",
    "bake height.png --maps cones",
    "bake height.png --kernel roberts",
    "bake height.png --bits 12",
    "bake height.png --scale -1",
    "bake height.png --scale deep",
    "bake height.png --height-range 1",
    "render",
    "render height.png --technique magic",
    "render height.png --technique relief(steps=4)",
    "render height.png --technique relief(linear=0)",
    "render height.png --technique relief(linear)",
    "render height.png --size 0 10",
    "render height.png --eye 0,0",
    "render height.png --eye 0,0,0",
    "render height.png --light 0,0,0",
    "render height.png --aovs colour",
    "render mesh.obj --mesh quad",
    "compare height.png --elevations 0,45",
    "compare height.png --elevations steep",
    "compare height.png --techniques magic",
    "compare height.png --plot plot.doc",
]


@pytest.mark.parametrize("line", USAGE)
def test_usage_errors(line: str, folder: Path) -> None:
    before = sorted(path.name for path in folder.iterdir())
    done = run(*line.split(), cwd=folder)
    assert done.returncode == 2, (done.stdout, done.stderr)
    assert "Traceback" not in done.stderr
    assert sorted(path.name for path in folder.iterdir()) == before


ERRORS = [
    ("bake nowhere.png", "nowhere.png"),
    ("bake text.png", "text.png"),
    ("bake height.png --channel b", "channel"),
    ("bake height.png -o text.png", "not a folder"),
    ("render nowhere.obj", "nowhere.obj"),
    ("render height.png --mesh nowhere.glb", "nowhere.glb"),
    ("compare text.png", "text.png"),
]


@pytest.mark.parametrize(("line", "message"), ERRORS)
def test_errors_are_one_line(line: str, message: str, folder: Path) -> None:
    (folder / "text.png").write_text("no image")
    done = run(*line.split(), cwd=folder)
    assert done.returncode == 1, (done.stdout, done.stderr)
    assert re.fullmatch(r"error: [^\n]*\n", done.stderr)
    assert message in done.stderr
    assert "Traceback" in run(*line.split(), "-v", cwd=folder).stderr


def test_defaults_are_those_of_the_api() -> None:
    pairs = [
        (cli.bake, bw.HeightMap, ("scale", "base", "tile_size", "wrap", "channel", "invert", "height_range")),
        (cli.bake, bw.Maps.save, ("format", "bits", "prefix")),
        (cli.render, bw.Material, ("albedo", "normal", "specular", "shininess")),
        (cli.render, bw.render, ("size", "technique", "shadows")),
        (cli.render, bw.Camera.look_at, ("fov_y",)),
        (cli.compare, bw.compare, ("device", "rays", "repeats", "seed")),
    ]
    for command, function, names in pairs:
        ours, theirs = inspect.signature(command).parameters, inspect.signature(function).parameters
        for name in names:
            default = ours[name].default
            assert getattr(default, "value", default) == theirs[name].default, name
    elevations = inspect.signature(bw.compare).parameters["elevations"].default
    given = inspect.signature(cli.compare).parameters["elevations"].default
    assert [float(part) for part in given.split(",")] == list(elevations)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c(folder: Path) -> None:
    words = ["compare", "height.png", "--rays", "200000", "--repeats", "50", "--device", "cpu"]
    command = [sys.executable, "-c", "from bumpwgpu.cli import main; main()", *words]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(3)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "Traceback" not in err


def test_compare_fails_above_a_limit(folder: Path) -> None:
    words = [
        "compare",
        "height.png",
        "--elevations",
        "30",
        "--rays",
        "500",
        "--repeats",
        "1",
        "--device",
        "cpu",
    ]
    sound = run(*words, "--techniques", "exact", "--fail-above", 0.1, cwd=folder)
    assert sound.returncode == 0, sound.stderr
    coarse = run(*(*words, "--techniques", "steep(steps=4),exact", "--fail-above", 0.1, "--json"), cwd=folder)
    assert coarse.returncode == CHECK_FAILED
    assert "steep(steps=4): p99 error" in coarse.stderr
    assert json.loads(coarse.stdout)["above"] == ["steep(steps=4)"]


def test_compare_writes_what_an_engine_needs(folder: Path) -> None:
    words = (
        "compare height.png --elevations 40 --rays 500 --repeats 1 --device cpu --techniques pom(steps=200)"
    )
    more = (
        "--max-error 9 --mips 2 --engine bevy --shader wall.glsl --rows rows.csv --formats r32float,r8unorm"
    )
    done = run(*words.split(), *more.split(), cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "ParallaxMappingMethod::Occlusion" in done.stdout
    assert "mip 1, from" in done.stdout
    assert "#version 300 es" in (folder / "wall.glsl").read_text()
    assert "pom(steps=200) r8unorm" in (folder / "rows.csv").read_text()
    for bad in ("--shader wall.txt", "--engine quake", "--formats bc5", "--rows rows.xml"):
        assert run(*words.split(), *bad.split(), cwd=folder).returncode == 2


def test_stress(folder: Path) -> None:
    words = [
        "stress",
        "--techniques",
        "exact",
        "--maps",
        "normal",
        "--frames",
        "none",
        "--only",
        "odd",
        "--rays",
        "16",
    ]
    done = run(*words, "--rows", "stress.json", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "checks, 0 failed" in done.stdout
    assert (folder / "stress.json").stat().st_size > 1000
    data = json.loads(run(*words, "--json", cwd=folder).stdout)
    assert data["passed"]
    assert data["failures"] == []
    assert run("stress", "--maps", "norml", cwd=folder).returncode == 2
    nothing = run("stress", "--only", "no such case", cwd=folder)
    assert (nothing.returncode, "no case contains" in nothing.stderr) == (1, True)


def test_lint(folder: Path) -> None:
    assert run("lint", "height.png", cwd=folder).returncode == 0
    heights = bw.HeightMap(folder / "height.png")
    down = bw.bake(heights, convention="directx")["normal"]
    Image.fromarray(((down * 0.5 + 0.5) * 255).round().astype(np.uint8)).save(folder / "normal.png")
    done = run("lint", ".", cwd=folder)
    assert done.returncode == CHECK_FAILED
    assert "[wrong-green]" in done.stdout
    assert run("lint", ".", "--convention", "directx", cwd=folder).returncode == 0
    data = json.loads(
        run("lint", "--normal", "normal.png", "--height", "height.png", "--json", cwd=folder).stdout
    )
    assert [finding["code"] for finding in data["findings"]] == ["wrong-green"]
    assert run("lint", cwd=folder).returncode == 2
