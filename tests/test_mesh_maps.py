"""Maps baked from meshes: the Python face, files, the command line, and the way back into a picture."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import bumpwgpu as bw
from bumpwgpu.cli import app
from bumpwgpu.mesh_maps import MESH_MAPS


def sheet(size: int, height: Any) -> bw.Mesh:
    """The square of `bw.Mesh.quad()` in `size` x `size` cells, raised by `height(u, v)`."""
    u, v = np.meshgrid(np.arange(size + 1) / size, np.arange(size + 1) / size)
    u, v = u.ravel(), v.ravel()
    positions = np.column_stack([u - 0.5, 0.5 - v, height(u, v)])
    first = np.arange((size + 1) * size).reshape(size, size + 1)[:, :size].ravel()
    below = first + size + 1
    triangles = np.concatenate(
        [np.stack([first, below, below + 1], 1), np.stack([first, below + 1, first + 1], 1)]
    )
    return bw.Mesh(positions, triangles, np.column_stack([u, v]))


def bumps(u: Any, v: Any) -> Any:
    return 0.05 * np.sin(9 * u) * np.cos(7 * v)


@pytest.fixture(scope="module")
def bumpy() -> bw.Mesh:
    return sheet(96, bumps)


def centres(size: int) -> tuple[np.ndarray, np.ndarray]:
    at = (np.arange(size) + 0.5) / size
    u, v = np.meshgrid(at, at)
    return u, v


def test_all_maps(bumpy: bw.Mesh) -> None:
    maps = bw.bake(bw.Mesh.quad(), MESH_MAPS, detail=bumpy, size=(64, 48), front=0.1, rear=0.06, rays=8)
    assert isinstance(maps, bw.MeshMaps)
    shapes = {name: maps[name].shape for name in maps}
    assert shapes == {
        "normal": (48, 64, 3),
        "height": (48, 64),
        "ao": (48, 64),
        "tangents": (48, 64, 4),
    }
    assert all(maps[name].dtype == np.float32 for name in maps)
    assert np.allclose(np.linalg.norm(maps["normal"], axis=-1), 1, atol=1e-5)
    assert 0 <= maps["ao"].min() < maps["ao"].max() <= 1
    assert (maps["tangents"] == (1, 0, 0, 1)).all()
    report = maps.report
    assert report is not None
    assert (report.texels, report.rays, report.missed) == (64 * 48, 64 * 48, 0)
    assert report.met == pytest.approx((-0.05, 0.05), abs=1e-3)
    assert repr(maps).startswith("<Maps: normal (48, 64, 3)")


def test_heights_come_back(bumpy: bw.Mesh) -> None:
    # Distances are measured, reported, and lead back to mesh units.
    maps = bw.bake(bw.Mesh.quad(), "height", detail=bumpy, size=64)
    relief = maps.height_map()
    heights = (relief.array - relief.base) * relief.scale
    expected = bumps(*centres(64))
    assert abs(heights - expected).max() < 3e-4
    assert abs(heights.T - expected).max() > 0.04  # negative control
    with pytest.raises(ValueError, match="height"):
        bw.bake(bw.Mesh.quad(), "normal", detail=bumpy, size=8).height_map()


def test_normals_agree_with_those_of_the_heights(bumpy: bw.Mesh) -> None:
    maps = bw.bake(bw.Mesh.quad(), ("normal", "height"), detail=bumpy, size=128)
    from_heights = bw.bake(maps.height_map(), "normal", kernel="scharr")["normal"]
    inner = (slice(4, -4), slice(4, -4))
    cosine = (maps["normal"] * from_heights).sum(-1)[inner]
    assert np.degrees(np.arccos(cosine.clip(-1, 1))).max() < 1.0
    assert (np.degrees(np.arccos((maps["normal"] * [0, 0, 1]).sum(-1).clip(-1, 1))) > 15).any()


def test_options_reach_the_core(bumpy: bw.Mesh) -> None:
    plain = bw.Mesh.quad()
    usual = bw.bake(plain, detail=bumpy, size=32)["normal"]
    flipped = bw.bake(plain, detail=bumpy, size=32, convention="directx")["normal"]
    assert np.allclose(flipped * (1, -1, 1), usual)
    assert np.allclose(bw.bake(plain, detail=bumpy, size=32, space="object")["normal"], usual, atol=1e-6)
    averaged = bw.bake(plain, detail=bumpy, size=32, samples=4)["normal"]
    assert 1e-4 < abs(averaged - usual).max() < 0.1
    cage = bw.Mesh(np.add(plain.positions, (0, 0, 0.2)), plain.indices, plain.uvs)
    caged = bw.bake(plain, ("height",), detail=bumpy, size=32, cage=cage, rear=0.2)
    given = bw.bake(plain, ("height",), detail=bumpy, size=32, front=0.2, rear=0.2)
    assert np.allclose(caged["height"], given["height"], atol=1e-6)
    seeds = [bw.bake(plain, "ao", detail=bumpy, size=16, rays=4, seed=seed)["ao"] for seed in (0, 0, 1)]
    assert (seeds[0] == seeds[1]).all()
    assert (seeds[0] != seeds[2]).any()
    near = bw.bake(plain, "ao", detail=bumpy, size=16, distance=1e-4)["ao"]
    assert near.min() > seeds[0].min()


def test_padding_and_back_faces() -> None:
    square = bw.Mesh.quad()
    small = bw.Mesh(square.positions, square.indices, square.uvs * 0.5)
    raised = bw.Mesh(np.add(square.positions, (0, 0, 0.1)), square.indices, square.uvs)
    for padding, reached in ((0, 16), (3, 19)):
        height = bw.bake(small, "height", detail=raised, size=32, padding=padding, front=0.2, rear=0.2)[
            "height"
        ]
        assert height[0, reached - 1] == pytest.approx(0.75)
        assert height[0, reached] == pytest.approx(0.5)
    inside_out = bw.Mesh(raised.positions, raised.indices[:, ::-1].copy(), raised.uvs)
    with pytest.warns(bw.BumpWarning, match="from behind"):
        maps = bw.bake(square, "height", detail=inside_out, size=8, front=0.2, rear=0.2)
    assert maps.report is not None
    assert maps.report.averted == 64
    both = bw.bake(square, "height", detail=inside_out, size=8, front=0.2, rear=0.2, back_faces=True)
    assert both["height"][4, 4] == pytest.approx(0.75)


@pytest.mark.parametrize("format", ["png", "exr", "npy"])
def test_maps_are_saved(bumpy: bw.Mesh, tmp_path: Path, format: Any) -> None:
    maps = bw.bake(bw.Mesh.quad(), MESH_MAPS, detail=bumpy, size=16, rays=4)
    paths = maps.save(tmp_path, format=format, prefix="rock")
    assert [path.name for path in paths] == [f"rock_{name}.{format}" for name in MESH_MAPS]
    if format == "npy":
        for name, path in zip(MESH_MAPS, paths, strict=True):
            assert (np.load(path) == maps[name]).all()
    else:
        back = bw.HeightMap(paths[1]).array
        assert abs(back - maps["height"]).max() <= (0.5 / 255 + 1e-6 if format == "png" else 0)


def test_what_cannot_be_is_refused(bumpy: bw.Mesh) -> None:
    plain = bw.Mesh.quad()
    with pytest.raises(ValueError, match="needs detail="):
        bw.bake(plain, "ao")
    with pytest.raises(ValueError, match="known: normal, height, ao, tangents"):
        bw.bake(plain, "cone", detail=bumpy)
    with pytest.raises(ValueError, match="empty"):
        bw.bake(plain, (), detail=bumpy)
    with pytest.raises(TypeError, match="kernel"):
        bw.bake(plain, detail=bumpy, kernel="scharr")
    with pytest.raises(TypeError, match="detail must be a Mesh"):
        bw.bake(plain, detail=bw.HeightMap([[0.0]]))
    with pytest.raises(TypeError, match="detail"):
        bw.bake(bw.HeightMap([[0.0]]), detail=bumpy)
    for name, value in {
        "size": 0,
        "front": -1,
        "rear": np.nan,
        "samples": 9,
        "padding": -1,
        "space": "world",
        "convention": "unity",
        "rays": 0,
        "distance": 0,
        "seed": -1,
    }.items():
        with pytest.raises(ValueError, match=name):
            bw.bake(plain, "ao", detail=bumpy, **{"size": 8, name: value})
    with pytest.raises(TypeError, match="back_faces"):
        bw.bake(plain, detail=bumpy, back_faces=1)
    with pytest.raises(ValueError, match="32768"):
        bw.bake(plain, detail=bumpy, size=40_000)
    with pytest.raises(ValueError, match="triangles"):
        bw.bake(plain, detail=bumpy, cage=bumpy, size=8)
    with pytest.raises(FileNotFoundError):
        bw.bake(plain, detail="nowhere.obj")


def test_settings_without_effect_warn(bumpy: bw.Mesh) -> None:
    plain = bw.Mesh.quad()
    with pytest.warns(bw.BumpWarning, match="rays has no effect: only ao"):
        bw.bake(plain, "height", detail=bumpy, size=8, rays=3)
    with pytest.warns(bw.BumpWarning, match="needs no rays"):
        bw.bake(plain, "tangents", size=8, front=1.0)
    with pytest.warns(bw.BumpWarning, match="cage"):
        bw.bake(plain, "height", detail=bumpy, cage=plain, size=8, front=1.0, rear=0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bw.bake(plain, "tangents", size=8)


def test_progress_and_interruption(bumpy: bw.Mesh) -> None:
    seen: list[tuple[int, int]] = []
    bw.bake(bw.Mesh.quad(), detail=bumpy, size=64, progress=lambda done, total: seen.append((done, total)))
    assert seen[-1] == (64, 64)

    def stop(done: int, total: int) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        bw.bake(bw.Mesh.quad(), "ao", detail=bumpy, size=512, rays=256, progress=stop)


def obj(path: Path, mesh: bw.Mesh) -> Path:
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.positions]
    lines += [f"vt {u} {1 - v}" for u, v in mesh.uvs]
    lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in mesh.indices + 1]
    path.write_text("\n".join(lines))
    return path


def test_command_line(bumpy: bw.Mesh, tmp_path: Path) -> None:
    plain, detail = obj(tmp_path / "plain.obj", bw.Mesh.quad()), obj(tmp_path / "fine.obj", bumpy)
    out = tmp_path / "maps"
    command = ["bake", str(plain), "--detail", str(detail), "--maps", "normal,height", "--size", "32", "16"]
    command += ["--front", "0.2", "--rear", "0.1", "-o", str(out), "--json"]
    run = CliRunner().invoke(app, command)
    assert run.exit_code == 0, run.output
    found = json.loads(run.stdout)
    assert (found["width"], found["height"], found["report"]["missed"]) == (32, 16, 0)
    assert sorted(path.name for path in out.glob("*.png")) == ["height.png", "normal.png"]
    wrong = CliRunner().invoke(app, ["bake", str(out / "height.png"), "--front", "0.2"])
    assert wrong.exit_code == 2
    assert "need a mesh" in wrong.output.replace("\n", " ")
    missing = CliRunner().invoke(app, ["bake", str(plain)])
    assert missing.exit_code == 1
    assert "detail" in missing.output


def test_the_picture_of_the_maps_is_that_of_the_detail(bumpy: bw.Mesh, gpu: None) -> None:
    """A plain quad with the baked normals is lit as the detailed mesh is, seen from above."""
    maps = bw.bake(bw.Mesh.quad(), detail=bumpy, size=256, samples=2)
    camera = bw.Camera.look_at((0, 0, 3), (0, 0, 0), fov_y=18.0)
    lights = [bw.Light.directional((1, 2, -2))]

    def picture(mesh: bw.Mesh, material: bw.Material) -> np.ndarray:
        frame = bw.render(
            mesh,
            material,
            camera=camera,
            lights=lights,
            technique="flat" if material.normal is None else "normal",
            size=(96, 96),
            shadows=False,
        )
        return frame.color[8:-8, 8:-8, :3].astype(float)

    encoded = ((maps["normal"] + 1) * 127.5 + 0.5).astype(np.uint8)
    matte = {"specular": 0.0}
    fine = picture(bumpy, bw.Material(**matte))
    baked = picture(bw.Mesh.quad(), bw.Material(normal=encoded, **matte))
    plain = picture(bw.Mesh.quad(), bw.Material(**matte))
    # Parallax is not in a normal map: the bumps are 0.05 high and the camera is 3 away.
    assert abs(baked - fine).mean() < 3
    assert abs(plain - fine).mean() > 12


def test_real_meshes(assets: Path) -> None:
    for name in ("obj/meshoptimizer/pirate.obj", "bevy/FlightHelmet/FlightHelmet.gltf"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", bw.BumpWarning)
            mesh = bw.Mesh.open(assets / name)
            reach = float(np.ptp(mesh.bounds, axis=0).max()) * 1e-3
            maps = bw.bake(mesh, ("normal", "height"), detail=mesh, size=256, front=reach, rear=reach)
        assert maps.report is not None
        assert maps.report.missed < 0.02 * maps.report.rays
        flat = (maps["normal"][..., 2] > np.cos(np.radians(2))) & (abs(maps["height"] - 0.5) < 0.02)
        assert flat.mean() > 0.9, name
