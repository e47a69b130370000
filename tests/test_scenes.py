"""Scenes of instances: what is taken and refused, places near and a million units away, what is skipped."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import bumpwgpu as bw
from bumpwgpu.rendering import SKIPS

CAMERA = bw.Camera.look_at((1.4, 1.0, 2.2), (0.1, 0, 0), fov_y=40.0)
SUN = bw.Light.directional((-0.5, -0.7, -0.6))
FAR = np.array([1e6, -1e6, 1e6])
#: One of each kind of technique.
KINDS = ("flat", "bump", "bump_derivative", "normal", "parallax", "relief", "exact", "displacement", "dot3")


def place(turn: Any = None, shift: Any = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) if turn is None else turn
    matrix[:3, 3] = shift
    return matrix


def rotation(axis: tuple[float, float, float], degrees: float) -> NDArray[np.float64]:
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def relief(scale: float = 0.1, tile: float = 1.0) -> bw.Material:
    heights = bw.HeightMap.procedural("fbm", 64, scale=scale, base=0.5, tile_size=(tile, tile))
    return bw.Material(height=heights, specular=0.0)


def draw(what: Any, material: Any = None, **options: Any) -> bw.Frame:
    defaults: dict[str, Any] = {"camera": CAMERA, "lights": [SUN], "size": (96, 80), "technique": "relief"}
    return bw.render(what, material, **{**defaults, **options})


def test_instances_are_checked_and_frozen() -> None:
    mesh, wall = bw.Mesh.quad(), relief()
    matrix = place(shift=(1, 2, 3))
    instance = bw.Instance(mesh, wall, matrix)
    matrix[0, 0] = 7.0
    assert instance.mesh is mesh
    assert instance.material is wall
    np.testing.assert_array_equal(instance.world_from_object, place(shift=(1, 2, 3)))
    assert not instance.world_from_object.flags.writeable
    assert "(1, 2, 3)" in repr(instance)
    np.testing.assert_array_equal(bw.Instance(mesh).world_from_object, np.eye(4))
    with pytest.raises(AttributeError):
        instance.mesh = mesh  # type: ignore[misc]
    for bad, error, words in [
        (np.eye(3), ValueError, r"shape \(4, 4\)"),
        (place(np.diag([1, np.nan, 1])), ValueError, "NaN"),
        (place(np.diag([1, 0, 1])), ValueError, "no inverse"),
        (np.ones((4, 4)), ValueError, "last row"),
        ("here", TypeError, "numbers"),
        (object(), TypeError, "numbers"),
    ]:
        with pytest.raises(error, match=words):
            bw.Instance(mesh, wall, bad)
    # Small is not flat.
    bw.Instance(mesh, wall, place(np.diag([1e-9, 2e-9, 1e-6])))
    with pytest.raises(TypeError, match="mesh must be a Mesh"):
        bw.Instance("quad", wall)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="material must be"):
        bw.Instance(mesh, "wall")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="1 materials given"):
        bw.Instance(mesh, [wall])


def test_scenes_are_checked() -> None:
    mesh, wall = bw.Mesh.quad(), relief()
    for what, material, error, words in [
        (bw.Instance(mesh, wall), wall, ValueError, "material must be None"),
        ([mesh, mesh], wall, ValueError, "material must be None"),
        ([], None, ValueError, "empty"),
        ([mesh, "quad"], None, TypeError, r"mesh\[1\]"),
        ("quad", None, TypeError, "mesh must be"),
        (None, None, TypeError, "mesh must be"),
        ({"mesh": mesh}, None, TypeError, "mesh must be"),
        (7, None, TypeError, "mesh must be"),
    ]:
        with pytest.raises(error, match=words):
            bw.render(what, material)
    senseless = [("weather", ValueError), (["frustum", 3], TypeError), (1, TypeError), (None, TypeError)]
    for skip, error in senseless:
        with pytest.raises(error, match="skip"):
            bw.render(mesh, wall, skip=skip)  # type: ignore[arg-type]


@pytest.mark.gpu
def test_a_scene_of_one_is_the_mesh() -> None:
    mesh, wall = bw.Mesh.sphere(), relief()
    alone = draw(mesh, wall, camera=None)
    for same in (bw.Instance(mesh, wall), [bw.Instance(mesh, wall)], iter([bw.Instance(mesh, wall)])):
        np.testing.assert_array_equal(draw(same, camera=None).color, alone.color)
    bare = draw(mesh, technique="flat", camera=None)
    np.testing.assert_array_equal(draw([mesh], technique="flat", camera=None).color, bare.color)


@pytest.mark.gpu
def test_each_instance_stands_where_it_should_with_its_own_look() -> None:
    mesh = bw.Mesh.quad(0.8)
    red, blue = (bw.Material(albedo=colour, specular=0.0) for colour in ((1.0, 0, 0), (0, 0, 1.0)))
    scene = [
        bw.Instance(mesh, red, place(shift=(-1, 0, 0))),
        bw.Instance(mesh, blue, place(shift=(1, 0, 0))),
        bw.Instance(bw.Mesh.sphere(0.3), red, place(shift=(0, 0, 1))),
    ]
    front = bw.Camera.look_at((0, 0, 5), (0, 0, 0), fov_y=40)
    frame = draw(
        scene, camera=front, lights=[bw.Light.directional((0, 0, -1))], technique="flat", aovs="depth"
    )
    row = frame.color[40].astype(int)
    assert row[48 - 22, 0] > 200 > 50 > row[48 - 22, 2]
    assert row[48 + 22, 2] > 200 > 50 > row[48 + 22, 0]
    np.testing.assert_allclose(frame.aovs["depth"][40, [26, 48, 70]], [5.0, 3.7, 5.0], atol=2e-3)
    # The default camera holds them all.
    whole = draw(scene, camera=None, technique="flat", aovs="mask")
    mask = whole.aovs["mask"]
    assert mask.sum() > 300
    assert mask[0].sum() == mask[-1].sum() == mask[:, 0].sum() == mask[:, -1].sum() == 0


@pytest.mark.gpu
@pytest.mark.parametrize(
    ("technique", "silhouettes"), [*((technique, False) for technique in KINDS), ("exact", True)]
)
def test_a_million_units_away_nothing_changes(technique: str, silhouettes: bool) -> None:
    turn = rotation((1, 2, 3), 40.0) @ np.diag([1.3, 0.7, -0.9])
    ball, wall = bw.Mesh.sphere(0.5), bw.Mesh.quad(2.0)
    rough = relief(0.06)

    def picture(shift: NDArray[np.float64]) -> bw.Frame:
        lamp = bw.Light.point(tuple(np.array([1.0, 1.5, 2.0]) + shift), intensity=4.0)
        camera = bw.Camera.look_at(tuple(shift + CAMERA.eye), tuple(shift + CAMERA.target), fov_y=40.0)
        scene = [bw.Instance(ball, rough, place(turn, shift)), bw.Instance(wall, rough, place(shift=shift))]
        return draw(
            scene, camera=camera, lights=[lamp], technique=technique, silhouettes=silhouettes,
            aovs=("uv", "depth", "normal", "position", "mask"),
        )  # fmt: skip

    near, far = picture(np.zeros(3)), picture(FAR)
    np.testing.assert_array_equal(near.aovs["mask"], far.aovs["mask"])
    # The shift is no power of two: camera and objects are a ten-billionth off in 64 bits.
    texels = np.abs(near.aovs["uv"] - far.aovs["uv"]).max() * 64
    assert texels < 1e-3
    shown = near.aovs["mask"] > 0
    np.testing.assert_allclose(far.aovs["depth"][shown], near.aovs["depth"][shown], rtol=1e-6)
    np.testing.assert_allclose(far.aovs["normal"], near.aovs["normal"], atol=1e-4)
    assert np.abs(far.color.astype(int) - near.color).max() <= 1
    offset = far.aovs["position"][shown] - near.aovs["position"][shown] - FAR
    assert np.abs(offset).max() <= np.spacing(np.float32(1e6))


@pytest.mark.gpu
@pytest.mark.parametrize("technique", KINDS)
def test_turned_scaled_and_mirrored_meshes_are_what_arrays_so_transformed_are(technique: str) -> None:
    mesh = bw.Mesh.torus(0.7, 0.3, 48, 24)
    for scale, mirror in [(0.6, 1.0), (1.3, -1.0)]:
        turn = rotation((1, -1, 0.3), 70.0) @ np.diag([1.0, mirror, 1.0]) * scale
        baked = bw.Mesh(
            (mesh.positions.astype(np.float64) @ turn.T).astype(np.float32),
            mesh.indices if mirror > 0 else mesh.indices[:, ::-1],
            mesh.uvs,
            normals=(mesh.normals @ turn.T / scale).astype(np.float32),
        )
        # Turned around, triangles still face outwards; heights grow along with the mesh.
        options: dict[str, Any] = {"technique": technique, "aovs": ("uv", "depth", "normal", "mask")}
        placed = draw(bw.Instance(mesh, relief(0.1), place(turn)), **options)
        truth = draw(baked, relief(0.1 * scale, scale), **options)
        other = draw(baked, relief(0.13 * scale, scale), **options)
        both = (placed.aovs["mask"] > 0) & (truth.aovs["mask"] > 0)
        assert (placed.aovs["mask"] != truth.aovs["mask"]).sum() <= 8
        assert both.sum() > 1000

        def off(frame: bw.Frame, both: NDArray[np.bool_] = both, truth: bw.Frame = truth) -> dict[str, float]:
            turns = frame.aovs["uv"] - truth.aovs["uv"]
            cosines = (frame.aovs["normal"] * truth.aovs["normal"]).sum(axis=2)[both]
            return {
                "texels": float(np.quantile(np.abs(turns - np.rint(turns))[both], 0.97)) * 64,
                "normal": float(np.degrees(np.quantile(np.arccos(np.clip(cosines, -1, 1)), 0.97))),
                "color": float(np.quantile(np.abs(frame.color.astype(int) - truth.color)[both], 0.97)),
            }

        found = off(placed)
        assert found["texels"] < 0.02, found
        assert found["normal"] < 0.7, found
        assert found["color"] <= 3.0, found
        if technique != "flat":
            assert off(other)["normal"] > 2 * found["normal"] + 0.5


@pytest.mark.gpu
@pytest.mark.parametrize("skip", [False, *SKIPS])
def test_skipping_changes_nothing_here(skip: Any) -> None:
    mesh, wall = bw.Mesh.sphere(0.5), relief(0.05)
    scene = [bw.Instance(mesh, wall, place(shift=shift)) for shift in ((0, 0, 0), (0.4, 0.2, -1), (9, 9, 9))]
    plain = draw(scene, skip=False)
    assert set(plain.stats["skipped"]) == set(SKIPS)
    assert not any(plain.stats["skipped"].values())
    frame = draw(scene, skip=skip)
    assert np.abs(frame.color.astype(int) - plain.color).max() <= 8
    assert {name for name, count in frame.stats["skipped"].items() if count} <= {skip}
    if skip == "frustum":
        assert frame.stats["skipped"]["frustum"] >= len(mesh.indices)


@pytest.mark.gpu
@pytest.mark.parametrize(
    ("technique", "silhouettes"), [("relief", False), ("displacement", False), ("exact", True)]
)
def test_a_renderer_draws_what_render_draws(technique: str, silhouettes: bool) -> None:
    mesh, wall = bw.Mesh.sphere(0.5), relief(0.05)
    scene = [bw.Instance(mesh, wall), bw.Instance(mesh, wall, place(shift=(9, 0, 0)))]
    options: dict[str, Any] = {
        "lights": [bw.Light.point((2, 2, 2), intensity=5)],
        "technique": technique,
        "silhouettes": silhouettes,
        "size": (48, 40),
        "aovs": ("depth", "uv"),
    }
    # The second ball comes into view late.
    cameras = [bw.Camera.look_at((x, 0.5, 3), (x, 0, 0)) for x in (0.0, 0.4, 8.5, 9.0, 0.0)]
    alone = [bw.render(scene, camera=camera, **options) for camera in cameras]
    with bw.Renderer(scene, **options) as renderer:
        together = list(renderer.render_many(cameras))
        again = renderer.render(cameras[2])
    assert len(together) == len(cameras)
    for one, other in [*zip(alone, together, strict=True), (alone[2], again)]:
        np.testing.assert_array_equal(one.color, other.color)
        np.testing.assert_array_equal(one.aovs["depth"], other.aovs["depth"])
        np.testing.assert_array_equal(one.aovs["uv"], other.aovs["uv"])
    # Prepared once: only micro-polygons, which go with the view, are sent again.
    if technique == "relief":
        sent = [frame.stats["bytes_uploaded"] for frame in together]
        assert sent[0] > 50_000
        assert max(sent[1], sent[2], sent[3], sent[4]) < 2_000
        assert all(frame.stats["pipelines_compiled"] == 0 for frame in together[1:])


@pytest.mark.gpu
@pytest.mark.slow
def test_a_first_picture_comes_quickly(tmp_path: Path) -> None:
    """In a new process, NumPy's import included, with and without programs that the driver has kept."""
    code = (
        "import time; start = time.perf_counter()\n"
        "import bumpwgpu as bw; imported = time.perf_counter()\n"
        "wall = bw.HeightMap.procedural('bricks', 256, scale=0.05)\n"
        "frame = bw.render(bw.Mesh.quad(), bw.Material(height=wall), technique='relief', size=512)\n"
        "print(imported - start, time.perf_counter() - imported, frame.color[..., 3].max())\n"
    )
    # The best of several, since other work may be running.
    imports, cold, warm = [], [], []
    for turn in range(4):
        for pictures in (cold, warm):
            done = subprocess.run(
                [sys.executable, "-c", code],
                env={**os.environ, "MESA_SHADER_CACHE_DIR": str(tmp_path / str(turn))},
                capture_output=True,
                text=True,
                timeout=120,
                check=True,
            )
            seconds, picture, opaque = map(float, done.stdout.split())
            assert opaque == 255
            imports.append(seconds)
            pictures.append(picture)
    print(f"import {min(imports):.3f} s, first picture {min(cold):.2f} s cold, {min(warm):.2f} s warm")
    assert min(imports) < 0.15
    assert min(cold) < 1
    assert min(warm) < 1


@pytest.mark.gpu
def test_a_renderer_holds_what_it_has_until_it_is_closed() -> None:
    scene = [bw.Instance(bw.Mesh.quad(), relief())]
    renderer = bw.Renderer(scene, size=16)
    assert isinstance(renderer.camera, bw.Camera)
    # Frames that nobody takes are given up; others are not mistaken for them.
    many = renderer.render_many([renderer.camera] * 3)
    first = next(many)
    np.testing.assert_array_equal(renderer.render().color, first.color)
    many.close()
    assert list(renderer.render_many([])) == []
    with pytest.raises(TypeError, match="camera must be"):
        renderer.render("front")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="camera must be"):
        list(renderer.render_many([renderer.camera, "front"]))  # type: ignore[list-item]
    left = renderer.render_many([renderer.camera] * 2)
    next(left)
    assert not renderer.closed
    renderer.close()
    renderer.close()
    assert renderer.closed
    assert "closed" in repr(renderer)
    with pytest.raises(bw.RenderError, match="closed"):
        renderer.render()
    with pytest.raises(bw.RenderError, match="closed"):
        next(left)
    with pytest.raises(ValueError, match="empty"):
        bw.Renderer([])


@pytest.mark.gpu
def test_a_renderer_warns_once() -> None:
    with bw.Renderer(bw.Mesh.quad(), relief(), technique="normal", shadows=True, size=16) as renderer:
        with pytest.warns(bw.BumpWarning, match="casts no shadows"):
            assert renderer.render().warnings
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert renderer.render().warnings
            assert len(list(renderer.render_many([renderer.camera] * 2))) == 2


@pytest.mark.gpu
def test_nothing_is_compiled_anew_for_another_picture() -> None:
    # Mesa's software device compiles when it first draws, and again for each picture where a program branches
    # on uniforms only. Without its cache on disk that takes much longer than these pictures.
    code = """
import bumpwgpu as bw
bumps = bw.Material(bw.HeightMap.procedural("bricks", 32))
for technique in ("normal", "relief", "exact", "cone", "dot3"):
    with bw.Renderer(bw.Mesh.quad(), bumps, technique=technique, size=16) as renderer:
        first, *others = [renderer.render().stats["draw_ms"] for _ in range(5)]
        print(technique, first, min(others))
"""
    environment = {**os.environ, "MESA_SHADER_CACHE_DISABLE": "true"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    times = [line.split() for line in done.stdout.splitlines()]
    assert len(times) == 5
    for technique, first, later in times:
        assert float(later) < max(float(first) / 4, 5.0), (technique, first, later)


@pytest.mark.gpu
@pytest.mark.parametrize("technique", ["flat", "relief", "exact"])
def test_what_stands_behind_a_wall_is_not_drawn(technique: str) -> None:
    ball, wall = bw.Mesh.sphere(0.4), bw.Mesh.quad(2.0)
    heights = bw.HeightMap.procedural("fbm", 64, scale=0.05)
    rough = bw.Material(height=heights, specular=0.0)
    raised = bw.Material(height=bw.HeightMap.procedural("fbm", 64, scale=0.05, base=0.0), specular=0.0)
    front = bw.Camera.look_at((0.2, 0.3, 3), (0, 0, 0))
    hidden, beside = place(shift=(0, 0, -1.5)), place(shift=(1.3, 0, -1.5))
    wall_there = bw.Instance(wall, rough)
    for scene, all_hidden in [
        ([wall_there, bw.Instance(ball, rough, hidden)], True),
        ([bw.Instance(ball, rough, hidden), wall_there], True),
        ([wall_there, bw.Instance(ball, rough, beside)], False),
        # Before the wall, and with a wall that faces away.
        ([wall_there, bw.Instance(ball, rough, place(shift=(0, 0, 1)))], False),
        ([bw.Instance(wall, rough, place(np.diag([-1.0, 1, 1]))), bw.Instance(ball, rough, hidden)], True),
        (
            [bw.Instance(wall, rough, place(rotation((0, 1, 0), 180))), bw.Instance(ball, rough, hidden)],
            False,
        ),
        # Raised relief may come out in front of the mesh that it is on.
        ([wall_there, bw.Instance(ball, raised, hidden)], technique == "flat"),
    ]:
        frame = draw(scene, camera=front, technique=technique, skip="occlusion", aovs=("depth", "uv"))
        plain = draw(scene, camera=front, technique=technique, skip=False, aovs=("depth", "uv"))
        np.testing.assert_array_equal(frame.color, plain.color)
        np.testing.assert_array_equal(frame.aovs["depth"], plain.aovs["depth"])
        assert (frame.stats["skipped"]["occlusion"] >= len(ball.indices)) == all_hidden
        assert plain.stats["skipped"]["occlusion"] == 0
